"""Dressing as a Gymnasium environment: an agent moves two grippers instead of the controllers."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import error, spaces

from drake_dress.diagrams.assemble import Parts
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.errors import UserError
from drake_dress.gym.observations import GROUPS, Observation, Observer
from drake_dress.gym.reward import RewardWeights, reward_terms
from drake_dress.gym.views import view_of
from drake_dress.gym.world import Advance, World, draw
from drake_dress.models.dressing.progress import SleeveGauge, SleeveProgress
from drake_dress.report.summary import SuccessRules
from drake_dress.shipped import scenario_file

Action = npt.NDArray[np.float32]

# Range of the seeds that are drawn by a reset without one; results are reported on smaller seeds.
_DRAWN_SEEDS = (2**32, 2**62)
# Names of the cameras that an environment adds for observations and for `render`.
_VIEW, _RENDER_VIEW = "view", "render_view"
_VIEW_SIZE = (128, 128)  # pixels
# Progress s from which a sleeve counts as on, as in `summary.json`.
_LEAST_S = SuccessRules().min_s


class DressingEnv(gymnasium.Env[Observation, Action]):
    """Two grippers put a coat on a person; the agent commands the velocities of both.

    The world is that of `drake-dress run`: the simulated station with person, garment, and arms or
    floating grippers, behind the safety governor. The agent replaces the controllers.

    Action, Box (2,3) float32: velocity of left and right gripper in the world frame, m/s, held for
    a control period. Each component is bounded by `safety.max_speed`. The governor limits the speed
    of each gripper to the same value, and limits acceleration, force and distances, too; see
    docs/safety.md.

    Observation, Dict: see docs/gym.md.

    An episode terminates when both sleeves have stayed on for `stay`, when the governor stops the
    grippers, or when the simulation breaks down; it is truncated at the scenario's duration.
    `info` holds `ended_by` (empty during the episode), `is_success`, `seed`, `time` (s), `s` (2,)
    and `linking` (2,) of the true garment, `governor` (2,) the flags of
    `models.control.safety.Verdict`, and, after a step, `reward`: its terms by name.

    `reset(seed=n)` draws the same variation as `drake-dress run --seed n`. The same seed and
    actions give the same observations bit for bit. A reset without a seed draws one, 2³² or more,
    from the environment's generator, so that training never uses a seed on which results are
    reported. A reset that draws the same variation as the last one keeps the diagram. Any other
    builds a new one, which takes a second or two and leaks about 1 MB that Drake does not free.

    Args:
        scenario: name of a scenario that ships, or a YAML file.
        overrides: KEY=VALUE, as for `--set`.
        observe: some of `state`, `force`, `color` and `depth`. Images come from the scenario's
            cameras, or from one camera `view` if it has none.
        control_rate: rate of actions, Hz; None: the rate of the scenario's local controller. Its
            period has to be a multiple of `plant.time_step`.
        reward: weights of the reward, or a mapping of those that differ from the defaults.
        stay: time for which both sleeves must stay on, s.
        render_mode: `rgb_array`, or None.
        render_size: width and height of the image from `render`, pixels.

    Raises:
        UserError: an argument or the scenario cannot be used. `reset` raises it, too, if the drawn
            scenario cannot be used.
    """

    # Gymnasium declares it as an instance variable; instances set their own below
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        scenario: str | os.PathLike[str] = "dummy_standing",
        overrides: Sequence[str] = (),
        observe: Sequence[str] = ("state", "force"),
        control_rate: float | None = None,
        reward: RewardWeights | Mapping[str, float] | None = None,
        stay: float = 1.0,
        render_mode: str | None = None,
        render_size: tuple[int, int] = (640, 480),
    ) -> None:
        self._source = scenario_file(os.fspath(scenario))
        self._scenario = _simulated(load_scenario(self._source, overrides), self._source)
        self._weights = RewardWeights.of(reward)
        self._check(observe, stay, render_mode, render_size)
        self._stay = float(stay)
        self.render_mode = render_mode
        self._plant_steps = _plant_steps(self._scenario, control_rate)
        self._period = self._plant_steps * self._scenario.plant.time_step
        self._step_count = max(1, round(self._scenario.duration / self._period))
        # `RecordVideo` reads the frame rate of this environment here
        self.metadata = {**type(self).metadata, "render_fps": 1.0 / self._period}
        self._world: World | None = None
        self._ended = True
        self._add_cameras(observe, render_size)
        belief = build_garment(
            self._scenario.garment, self._scenario.controller.spacing, self._source.parent
        )
        images = {"color", "depth"} & set(observe)
        cameras = [c for c in self._scenario.station.cameras if c.name != _RENDER_VIEW]
        self._observer = Observer(
            observe,
            len(belief.rest_position),
            cameras if images else (),
            self._scenario.duration,
        )
        self.observation_space: gymnasium.spaces.Dict = self._observer.space
        fastest = self._scenario.safety.max_speed
        self.action_space = spaces.Box(-fastest, fastest, (2, 3), np.float32)

    @property
    def control_period(self) -> float:
        """Duration for which an action is held, s."""
        return self._period

    @property
    def parts(self) -> Parts:
        """Parts of this episode's diagram: the drawn scenario, garments, policy and limits.

        Garments and policy may be kept. The next reset frees the station.

        Raises:
            ResetNeeded: no episode has begun.
        """
        return self._begun().parts

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode and returns the observation and `info`.

        Args:
            seed: seed of the scenario's variation; None draws one.
            options: must be empty or None.
        """
        super().reset(seed=seed)
        if options:
            raise UserError("reset", "options", f"has {', '.join(options)}, expected none")
        self._seed = int(self.np_random.integers(*_DRAWN_SEEDS)) if seed is None else int(seed)
        drawn = draw(self._scenario, self._seed)
        if self._world is not None and self._world.is_of(drawn):
            self._world.restart()
        else:
            self.close()
            self._world = World(drawn, self._scenario, self._source)
        self._gauge = SleeveGauge(self._world.truth)
        self._observer.begin(self._world)
        self._steps, self._steps_on, self._ended = 0, 0, False
        self._progress = self._measured(self._world)
        self._seen = self._observer.read(0.0)
        return copy.deepcopy(self._seen), self._info(np.zeros(2, dtype=np.int32), "")

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Simulates a control period.

        Args:
            action: (2,3) velocity of left and right gripper, m/s; clipped to the action space.

        Returns:
            Observation, reward, terminated, truncated, `info`.
        """
        world = self._begun()
        if self._ended:
            raise error.ResetNeeded("the episode has ended, expected reset()")
        velocity = self._checked(action)
        advance = world.advance(velocity, self._plant_steps)
        self._steps += 1
        before = self._progress
        if advance.fault is None:
            self._progress = self._measured(world)
            on = self._progress.are_on(_LEAST_S)
            self._steps_on = self._steps_on + 1 if on else 0
            self._seen = self._observer.read(self._steps_on * self._period)
        dressed = self._steps_on > 0 and self._steps_on * self._period >= self._stay - 1e-9
        ended_by = self._ended_by(advance, dressed)
        terminated = bool(ended_by) and ended_by != "time"
        failed = terminated and ended_by != "dressed"
        terms = reward_terms(
            self._weights, before, self._progress, advance.loads, ended_by == "dressed", failed
        )
        self._ended = bool(ended_by)
        info = self._info(advance.verdict, ended_by) | {"reward": terms}
        seen = copy.deepcopy(self._seen)
        return seen, float(sum(terms.values())), terminated, ended_by == "time", info

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Returns an RGB image (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        image = self._begun().image(f"{_RENDER_VIEW}.color_image")
        return np.ascontiguousarray(image[:, :, :3], dtype=np.uint8)

    def close(self) -> None:
        """Frees the memory of the simulation."""
        if self._world is not None:
            self._world.close()
        self._world = None
        self._ended = True

    def _begun(self) -> World:
        if self._world is None:
            raise error.ResetNeeded("no episode has begun, expected reset() first")
        return self._world

    def _measured(self, world: World) -> SleeveProgress:
        """Returns the progress of the true garment on the true person."""
        x, joints = world.value("cheat_garment_position"), world.value("cheat_joint_position")
        return self._gauge.measure(x, joints)

    def _checked(self, action: npt.ArrayLike) -> npt.NDArray[np.float64]:
        velocity = np.asarray(action, dtype=np.float64)
        if velocity.shape != (2, 3) or not np.isfinite(velocity).all():
            raise UserError("step", "action", f"is {action!r}, expected (2,3) finite numbers, m/s")
        fastest = self._scenario.safety.max_speed
        return np.clip(velocity, -fastest, fastest)

    def _ended_by(self, advance: Advance, dressed: bool) -> str:
        """Returns why the episode has ended; empty if it has not."""
        if advance.fault is not None:
            return advance.fault
        if dressed:
            return "dressed"
        if advance.stopped:
            return "governor stopped the grippers"
        return "time" if self._steps >= self._step_count else ""

    def _info(self, verdict: npt.NDArray[np.int32], ended_by: str) -> dict[str, Any]:
        return {
            "seed": self._seed,
            "time": self._steps * self._period,
            "s": self._progress.s.copy(),
            "linking": self._progress.linking.copy(),
            "governor": verdict.copy(),
            "is_success": ended_by == "dressed",
            "ended_by": ended_by,
        }

    def _add_cameras(self, observe: Sequence[str], render_size: tuple[int, int]) -> None:
        """Adds a camera for observations if the scenario has none, and one for rendering."""
        cameras = self._scenario.station.cameras
        if {"color", "depth"} & set(observe) and not cameras:
            cameras.append(view_of(self._scenario, _VIEW, *_VIEW_SIZE))
        if self.render_mode is not None:
            cameras.append(view_of(self._scenario, _RENDER_VIEW, *render_size))

    def _check(
        self,
        observe: Sequence[str],
        stay: float,
        render_mode: str | None,
        render_size: tuple[int, int],
    ) -> None:
        name = type(self).__name__
        unknown = [group for group in observe if group not in GROUPS]
        if isinstance(observe, str) or unknown or not len(observe):
            raise UserError(
                name, "observe", f"is {observe!r}, expected a list of some of {', '.join(GROUPS)}"
            )
        if not 0.0 <= stay < np.inf:
            raise UserError(name, "stay", f"is {stay} s, expected a finite time, 0 or more")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise UserError(name, "render_mode", f"is {render_mode!r}, expected rgb_array or None")
        if len(render_size) != 2 or not all(16 <= int(n) <= 4096 for n in render_size):
            raise UserError(
                name, "render_size", f"is {render_size}, expected width, height of 16 to 4096"
            )
        if any(c.name == _RENDER_VIEW for c in self._scenario.station.cameras):
            raise UserError(
                str(self._source),
                "station.cameras",
                f"has a camera {_RENDER_VIEW}, expected another name: it is that of `render`",
            )


def _simulated(scenario: Scenario, source: Path) -> Scenario:
    if scenario.station.kind != "simulated":
        raise UserError(
            str(source), "station.kind", f"is {scenario.station.kind}, expected simulated"
        )
    return scenario


def _plant_steps(scenario: Scenario, control_rate: float | None) -> int:
    """Returns the number of plant steps for which an action is held."""
    step = scenario.plant.time_step
    if control_rate is None:
        # in all shipped scenarios, the local controller's period is a multiple of the step
        return max(1, round(scenario.controller.local.period / step))
    steps = 1.0 / (control_rate * step) if control_rate > 0.0 else 0.0
    if not (steps < np.inf and round(steps) >= 1 and abs(steps - round(steps)) < 1e-6):
        raise UserError(
            DressingEnv.__name__,
            "control_rate",
            f"is {control_rate} Hz, expected a period that is a multiple of plant.time_step, "
            f"{step} s, such as {1.0 / (2.0 * step):g} Hz",
        )
    return round(steps)
