"""Search for a motion of both grippers that puts the first hand through its armhole.

Whether a hand gets into an armhole depends on which side of a panel it passes. No gradient tells:
the cost is flat until the hand is inside. After a miss, motions are therefore drawn at random and
tried in the controller's own garment model, all the way, and the best one is followed while more
are drawn at every decision (model predictive control by sampling). The search is off by default:
in the simulated station its motions do not yet put more hands in (docs/dressing_findings.md).

A motion is a list of places of both grippers, which are passed on straight lines. It is drawn about
what brings a hand into a coat that hangs free: the armhole comes forward on the outer side of the
hand, so that the front panel passes outside, then inward over the hand, and up the forearm.
Meanwhile the coat turns about the vertical, and the other gripper rises, which turns the opening
toward a forearm that points down. How far, and by which way exactly, is what the search finds: one
to five of ten drawn motions put the hand in.

Frames: places are (front, inward, up) from the hand, m, in the person's heading, the same for both
sides. Row 0 of a pair is the gripper of the searched side, row 1 the other one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.control.budget import Cost, Spending
from drake_dress.models.control.costs import Grip
from drake_dress.models.control.task_parameters import unit
from drake_dress.models.control.tasks import TaskPlanner, arm_axes
from drake_dress.models.dressing.sight import free_sight, is_barred
from drake_dress.models.human.heading import Heading
from drake_dress.models.immutable import Immutable

# Draws of one motion before it counts as impossible to draw one that obeys the limits.
_MOST_DRAWS = 300
# A place is reached at this distance, m, and passed within the other one if the next is nearer.
_REACHED, _PASSED = 0.02, 0.1
_PLACES = 3  # of a motion that is drawn anew
_WAY = 20  # decisions, at most, on the way to where motions usually begin
# Points of a straight path at which its distance from the person is looked at.
_LOOKS = 12
_UP = np.array([0.0, 0.0, 1.0])

Vector = tuple[float, float, float]
Pair = tuple[float, float]


@dataclass(frozen=True)
class InsertionParameters:
    """Settings of the search.

    Attributes:
        after: how often a hand has been missed before the search for it begins.
        rollouts: largest number of motions tried at each decision until one puts the hand in,
            within `budget`. 0 disables the search, 6 suffices.
        budget: iterations of linear solves that the motions of one decision may use. It is larger
            than that of a plan, since the search stands still until it has found a motion.
        refined: motions tried at each decision afterwards.
        gain: cost by which another motion has to be better than one that puts the hand in.
        again: share of the motions that are drawn about the best one while none puts the hand in.
        again_near: the same once the armhole is within half of `near` of the hand. There a lost
            motion is mended, rather than begun anew behind the hand.
        patience: motions tried for a hand without one that puts it in, before the other hand is
            tried, if both arms can do the same, and before the search ends.
        start_distance: distance of a gripper from where motions usually begin below which the
            search begins, m.
        behind: place of the armhole behind the hand, where the way over it begins, (front, inward,
            up) from the hand, m.
        beside: place beside the hand, on its outer side, m.
        over: place over the hand, m.
        beyond: distance along the forearm, from hand to elbow, that is added to `over`, m: a range.
        spread: deviation with which places are drawn, m.
        fine: deviation about a motion that puts the hand in, m and, of angles, rad.
        shift: deviation by which a motion that puts the hand in is shifted to try it again, m.
        turn: deviation of the coat's turn about the vertical, rad.
        tilt_behind: slope of the line from the armhole's gripper up to the other one, rad: a range.
        tilt_beside: the same slope beside the hand, rad.
        tilt_over: the same slope over the hand, rad.
        stretch: distance of the grippers as a share of the garment's rest span: a range.
        least_level: least lateral lead of the left gripper, as a share of that span.
        clearance: least distance of a gripper from the person's skin, m.
        near: distance at which cloth between hand and opening begins to count, m.
        depth: depth of the hand in the sleeve at which a motion has reached its end, m.
        free_force: gripper force that costs nothing, N.
        force: cost of a force beyond, 1/N.
        time: cost of a motion's duration, 1/s.
        substeps: steps of the garment in the rollouts per step of the plan.
        iterations: of its linear solve per step.
        stretch_stiffness: of its fabric, N/m. The fabric through which gradients are taken is
            softer. Its panels lag behind the grippers by 3 to 6 cm, and then the hand finds ways
            that are barred.
    """

    after: int = 1
    rollouts: int = 0
    budget: int = 40000
    refined: int = 1
    gain: float = 0.2
    again: float = 0.3
    again_near: float = 0.9
    patience: int = 40
    start_distance: float = 0.12
    behind: Vector = (-0.33, -0.15, -0.02)
    beside: Vector = (-0.03, -0.20, -0.05)
    over: Vector = (0.01, 0.03, 0.0)
    beyond: Pair = (0.02, 0.14)
    spread: float = 0.03
    fine: float = 0.015
    shift: float = 0.02
    turn: float = 0.45
    tilt_behind: Pair = (0.1, 0.5)
    tilt_beside: Pair = (0.2, 0.7)
    tilt_over: Pair = (0.5, 1.05)
    stretch: Pair = (0.92, 1.02)
    least_level: float = 0.3
    clearance: float = 0.04
    near: float = 0.25
    depth: float = 0.06
    free_force: float = 6.0
    force: float = 0.05
    time: float = 0.02
    substeps: int = 4
    iterations: int = 12
    stretch_stiffness: float = 1000.0


@dataclass(frozen=True)
class SearchState(Immutable):
    """What is kept from one decision to the next.

    Attributes:
        side: side of the hand; -1 before the first search.
        places: (m,2,3) places of both grippers still ahead of the best motion; None without one.
        cost: its cost; below 0 if it puts the hand in.
        tried: motions tried for this hand without one that puts it in.
        count: searches so far, from which the draws follow.
        switched: whether this is the second hand that is searched for.
        spent_at: misses at which the last search ended without a motion; the next one begins after
            one more.
    """

    side: int = -1
    places: FloatArray | None = None
    cost: float = np.inf
    tried: int = 0
    count: int = 0
    switched: bool = False
    spent_at: int = -1


@dataclass(frozen=True)
class Scene:
    """What a motion is tried in.

    Attributes:
        x, v: (n,3) nodes of the garment and their velocities where the motion begins, m, m/s.
        joints: (6,3) shoulder, elbow, hand of left, then right arm that the motion meets, m.
        obstacles: the person at each step of the plan; the last one stays.
        kept_away: the person as grippers keep away from it.
        to: heading of the person.
        side: side of the hand.
        spending: what the solve has spent of its budget.
    """

    x: FloatArray
    v: FloatArray
    joints: FloatArray
    obstacles: Sequence[Obstacles]
    kept_away: Obstacles
    to: Heading
    side: int
    spending: Spending

    @property
    def hand(self) -> FloatArray:
        """The hand (3,), m."""
        hand: FloatArray = self.joints[3 * self.side + 2]
        return hand

    @property
    def axes(self) -> FloatArray:
        """Rows (3,3) are the unit vectors front, inward, up."""
        return np.stack([self.to.front, self.to.inward(self.side), _UP])

    @property
    def forearm(self) -> FloatArray:
        """Unit vector (3,) from hand to elbow, along `axes`."""
        direction: FloatArray = self.axes @ unit(self.joints[3 * self.side + 1] - self.hand)
        return direction

    def obstacles_at(self, step: int) -> Obstacles:
        """Returns the person at a step of the plan."""
        return self.obstacles[min(step, len(self.obstacles) - 1)]


@dataclass(frozen=True)
class InsertionSearch:
    """Draws, tries and follows motions.

    Args:
        cloth: the garment of the rollouts.
        grip: its held nodes.
        planner: its armholes, and whether arms are in them.
        max_speed: of a gripper, m/s.
        parameters: settings.
    """

    cloth: ExplicitBiasCloth
    grip: Grip
    planner: TaskPlanner
    max_speed: float
    parameters: InsertionParameters = field(default_factory=InsertionParameters)

    @property
    def _plan_step(self) -> float:
        """Time step of the plan, s."""
        return self.parameters.substeps * self.cloth.time_step

    def begun(
        self, state: SearchState, first: int, are_alike: bool, misses: int
    ) -> tuple[SearchState, int | None]:
        """Returns the state, and the side of the hand to search for now; None for no search.

        Args:
            state: of the last decision.
            first: side of the arm that is to go first.
            are_alike: whether both arms can do the same, so that the other one may go first.
            misses: how often a hand has been missed so far.
        """
        idle = SearchState(count=state.count, spent_at=state.spent_at)
        if self.parameters.rollouts == 0:
            return idle, None
        if misses < max(self.parameters.after, state.spent_at + 1):
            return idle, None
        if state.side < 0:
            return replace(idle, side=first), first
        if state.tried < self.parameters.patience:
            return state, state.side
        if are_alike and not state.switched:
            other = 1 - state.side
            return replace(idle, side=other, switched=True), other
        return replace(idle, spent_at=misses), None

    def advance(
        self, state: SearchState, scene: Scene, committed: FloatArray
    ) -> tuple[SearchState, FloatArray]:
        """Returns the state after one more search, and the best motion's velocities (M,2,3), m/s.

        Args:
            state: as `begun` returns it.
            scene: now.
            committed: (C,2,3) velocities of the plan until the motion can begin, m/s.
        """
        p = self.parameters
        scene = self._later(scene, committed)
        now = self._grippers(scene)
        if state.places is None and state.tried < _WAY:
            start = self._nominal(scene)[:1]
            far = np.abs(start[0] - now).max() > p.start_distance
            if far and self._is_allowed(start, now, scene):
                state = replace(state, tried=state.tried + 1)
                return state, self._velocity(start, now, scene)
        best, cost, tried = self._searched(state, now, scene)
        state = replace(state, places=best, cost=cost, tried=tried, count=state.count + 1)
        if best is None or (cost >= 0.0 and len(best) < _PLACES):
            return state, np.zeros((1, 2, 3))
        # until a motion puts the hand in, the coat goes no further than where the best one begins
        return state, self._velocity(best if cost < 0.0 else best[:1], now, scene)

    def _searched(
        self, state: SearchState, now: FloatArray, scene: Scene
    ) -> tuple[FloatArray | None, float, int]:
        """Returns the best motion, its cost, and how many were tried without one that enters."""
        p = self.parameters
        rng = np.random.default_rng([scene.side, state.count])
        best, cost, tried = self._ahead(state.places, now), np.inf, state.tried
        last = Cost()
        if best is not None:
            cost = self._cost(best, now, scene)
            if cost < 0.0 and state.cost < 0.0:
                # a garment that is known to a centimetre is tried a little differently every time
                cost = 0.5 * (cost + state.cost)
        for k in range(p.rollouts):
            if (cost < 0.0 and k >= p.refined) or not scene.spending.allows(last):
                break
            drawn = self._drawn(rng, best, cost, now, scene)
            tried += 1
            if drawn is None:
                continue
            price, last = self._priced(drawn, now, scene, rng)
            # a motion that is being followed is left for a clearly better one only
            if price < cost - (p.gain if cost < 0.0 else 0.0):
                best, cost = drawn, price
        return best, cost, 0 if cost < 0.0 else tried

    def _later(self, scene: Scene, committed: FloatArray) -> Scene:
        """Returns the scene after the committed velocities (C,2,3), m/s."""
        x, v = scene.x, scene.v
        for j, velocity in enumerate(committed):
            x, v, _ = self._moved(x, v, velocity, j, scene)
        left = scene.obstacles[min(len(committed), len(scene.obstacles) - 1) :]
        return replace(scene, x=x, v=v, obstacles=left)

    def _moved(
        self, x: FloatArray, v: FloatArray, velocity: FloatArray, step: int, scene: Scene
    ) -> tuple[FloatArray, FloatArray, float]:
        """Returns nodes, velocities and the larger gripper force, N, after a step of the plan."""
        obstacles = scene.obstacles_at(step)
        p, h = self.parameters, self.cloth.time_step
        motion = np.empty((len(self.grip.nodes), 3))
        for side, held in enumerate(self.grip.of_side):
            motion[held] = h * velocity[side]
        for _ in range(p.substeps):
            x, v, reaction, tape = self.cloth.step(x, v, motion, obstacles)
            scene.spending.charge(tape.system.iterations)
        pulls = [reaction[self.grip.nodes[held]].sum(axis=0) for held in self.grip.of_side]
        return x, v, float(np.linalg.norm(pulls, axis=1).max())

    def _grippers(self, scene: Scene) -> FloatArray:
        """Returns the places (2,3) of both grippers."""
        held = scene.x[self.grip.nodes]
        order = (scene.side, 1 - scene.side)
        places = np.stack([held[self.grip.of_side[k]].mean(axis=0) for k in order])
        return (places - scene.hand) @ scene.axes.T

    @staticmethod
    def _ahead(places: FloatArray | None, now: FloatArray) -> FloatArray | None:
        """Returns the places of a motion that are not passed yet; None without any."""
        if places is None:
            return None
        while len(places) > 1:
            off = float(np.abs(places[0] - now).max())
            left, whole = (float(np.linalg.norm(places[1] - at)) for at in (now, places[0]))
            if off > _REACHED and (off > _PASSED or left > whole):
                break
            places = places[1:]
        return places

    def _drawn(
        self,
        rng: np.random.Generator,
        best: FloatArray | None,
        cost: float,
        now: FloatArray,
        scene: Scene,
    ) -> FloatArray | None:
        """Returns places (m,2,3) around the best ones or anew; None if none obeys the limits."""
        p, hits = self.parameters, cost < 0.0
        spread = p.fine if hits else p.spread
        again = p.again_near if self._is_near(scene) else p.again
        passed = self._passed(scene)
        for _ in range(_MOST_DRAWS):
            if best is not None and (hits or rng.random() < again):
                places = best + spread * rng.standard_normal(best.shape)
            else:
                # a coat that is beside the hand already need not go behind it again
                places = self._anew(rng, scene)
                places = places[int(rng.integers(passed + 1)) :]
            if self._is_allowed(places, now, scene):
                return places
        return None

    def _anew(self, rng: np.random.Generator, scene: Scene) -> FloatArray:
        """Returns places (3,2,3), drawn: behind, beside and over the hand."""
        p = self.parameters
        armhole = p.spread * rng.standard_normal((3, 3))
        armhole[2] += (rng.uniform(*p.beyond) - np.mean(p.beyond)) * scene.forearm
        turn = rng.normal(0.0, p.turn) + rng.normal(0.0, 0.4 * p.turn, 3)
        slopes = (p.tilt_behind, p.tilt_beside, p.tilt_over)
        tilt = np.array([rng.uniform(*of) for of in slopes])
        return self._places(scene, armhole, turn, tilt, rng.uniform(*p.stretch, (3, 1)))

    def _nominal(self, scene: Scene) -> FloatArray:
        """Returns places (3,2,3) in the middle of what is drawn."""
        p = self.parameters
        slopes = (p.tilt_behind, p.tilt_beside, p.tilt_over)
        tilt, stretch = np.array([np.mean(of) for of in slopes]), np.mean(p.stretch)
        return self._places(scene, np.zeros((3, 3)), np.zeros(3), tilt, np.full((3, 1), stretch))

    def _places(
        self,
        scene: Scene,
        off: FloatArray,
        turn: FloatArray,
        tilt: FloatArray,
        stretch: FloatArray,
    ) -> FloatArray:
        """Returns places (3,2,3) of the grippers behind, beside and over the hand.

        Args:
            scene: with the hand.
            off: (3,3) of the armhole from where it usually is, m.
            turn: (3,) of the line between the grippers about the vertical, rad.
            tilt: (3,) slope of that line, rad.
            stretch: (3,1) distance of the grippers over the garment's rest span.
        """
        p = self.parameters
        armhole = np.array([p.behind, p.beside, p.over]) + off
        armhole[2] += np.mean(p.beyond) * scene.forearm
        flat = np.stack([np.sin(turn), np.cos(turn), np.zeros(3)], axis=1)
        lead = np.cos(tilt)[:, None] * flat + np.sin(tilt)[:, None] * _UP
        inward, height = self._from_armhole(scene.side)
        mine = armhole + inward * lead + height * np.cos(tilt)[:, None] * _UP
        return np.stack([mine, mine + self.grip.span * stretch * lead], axis=1)

    def _is_near(self, scene: Scene) -> bool:
        """Returns whether the armhole is so near the hand that a lost motion is worth mending."""
        center = scene.x[self.planner.armholes[scene.side]].mean(axis=0)
        return bool(np.linalg.norm(center - scene.hand) < 0.5 * self.parameters.near)

    def _passed(self, scene: Scene) -> int:
        """Returns how many of the places behind and beside the hand the armhole is past."""
        p, loop = self.parameters, self.planner.armholes[scene.side]
        front, inward, _ = scene.axes @ (scene.x[loop].mean(axis=0) - scene.hand)
        if inward > 0.5 * p.beside[1]:
            return 0
        return 2 if front > p.beside[0] - p.spread else 1

    def _from_armhole(self, side: int) -> tuple[float, float]:
        """Returns how far a gripper is inward of and above its armhole's centre at rest, m."""
        rest = self.planner.mesh.rest_position
        centers = [rest[loop].mean(axis=0) for loop in self.planner.armholes]
        held = rest[self.grip.nodes[self.grip.of_side[side]]].mean(axis=0)
        offset, across = held - centers[side], centers[1 - side] - centers[side]
        inward = float(offset @ across / np.linalg.norm(across))
        return inward, float(np.sqrt(max(0.0, offset @ offset - inward**2)))

    def _is_allowed(self, places: FloatArray, now: FloatArray, scene: Scene) -> bool:
        """Returns whether the grippers stay level, and away from the person on their paths."""
        p = self.parameters
        lead = places[:, 1, 1] - places[:, 0, 1]
        if lead.min() < p.least_level * self.grip.span:
            return False
        corners = np.concatenate([now[None], places])
        share = np.linspace(0.0, 1.0, _LOOKS)[:, None, None]
        path = np.concatenate([a + share * (b - a) for a, b in pairwise(corners)])
        points = path.reshape(-1, 3) @ scene.axes + scene.hand
        gap = find_proximity(points, scene.kept_away, 0.0).gap.reshape(-1, 2)
        # a gripper that is nearer already may stay as near
        return bool(np.all(gap >= np.minimum(p.clearance, gap[0]) - 1e-6))

    def _velocity(self, places: FloatArray, now: FloatArray, scene: Scene) -> FloatArray:
        """Returns the velocities (M,2,3), left gripper first, m/s, that pass the places."""
        h, rows, at = self._plan_step, [], now
        for place in places:
            way = (place - at) @ scene.axes
            far = float(np.linalg.norm(way, axis=1).max())
            steps = max(1, int(np.ceil(far / (self.max_speed * h))))
            rows += [way / (steps * h)] * steps
            at = place
        velocity = np.array(rows)
        return velocity if scene.side == 0 else velocity[:, ::-1]

    def _priced(
        self, places: FloatArray, now: FloatArray, scene: Scene, rng: np.random.Generator
    ) -> tuple[float, Cost]:
        """Returns the cost of a motion, and what it took to find it."""
        spending = scene.spending
        before, since = spending.iterations, spending.clock()
        price = self._price(places, now, scene, rng)
        return price, Cost(spending.iterations - before, spending.clock() - since)

    def _price(
        self, places: FloatArray, now: FloatArray, scene: Scene, rng: np.random.Generator
    ) -> float:
        """Returns the cost of a motion; of one that puts the hand in, the mean with a shifted one.

        Whether a hand gets in may turn on a centimetre, and the garment is not known that well.
        """
        cost = self._cost(places, now, scene)
        if cost >= 0.0:
            return cost
        shift = self.parameters.shift * rng.standard_normal(3)
        return 0.5 * (cost + self._cost(places + shift, now, scene))

    def _cost(self, places: FloatArray, now: FloatArray, scene: Scene) -> float:
        """Returns the cost of a motion: below 0 only if it puts the hand in."""
        p, planner, side = self.parameters, self.planner, scene.side
        velocity = self._velocity(places, now, scene)
        x, v, force, nearest, depth = scene.x, scene.v, 0.0, np.inf, -1.0
        loop, axis = planner.armholes[side], arm_axes(scene.joints)[side]
        hand, elbow = scene.hand, scene.joints[3 * side + 1]
        for j, moves in enumerate(velocity):
            x, v, pull = self._moved(x, v, moves, j, scene)
            force = max(force, pull)
            distance = float(np.linalg.norm(x[loop].mean(axis=0) - hand))
            if distance < p.near:
                unseen = 1.0 - free_sight(x, planner.mesh.faces, loop, hand)
                nearest = min(nearest, distance / p.near + unseen)
                # an arm that goes through cloth, as coarse cloth lets it, is not in the sleeve
                inside = planner.is_linked(x, scene.joints, side) and not is_barred(
                    x, planner.mesh.faces, hand, elbow
                )
                depth = -axis.beyond_hand(planner.sleeves(x)[side].p_c) if inside else -1.0
                if depth >= p.depth:
                    break
        price = p.force * max(0.0, force - p.free_force) + p.time * self._plan_step * (j + 1)
        if depth > 0.0:
            return price - 1.0 - min(depth, p.depth) / p.depth
        if np.isfinite(nearest):
            return nearest + price
        return 2.0 + float(np.linalg.norm(x[loop].mean(axis=0) - hand)) + price
