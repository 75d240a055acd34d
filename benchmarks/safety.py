"""Tests the safety governor with failing controllers and sensors.

    python benchmarks/safety.py --commands 10000 --seed 3

Each of two grippers is attached to a tether, which stands for the garment and pulls when it is
stretched. The diagram has the governor between the grippers and a controller. Controller or sensors
fail in every way listed below, each for its share of the commands, with random numbers from the
seed. The outputs are measured: position commands and the tethers' true forces.

For each failure the table gives the worst speed, the worst acceleration, the excess of the speed
against a force above the hard limit over what braking allows, the lead of the command over its
gripper, and the worst force. The force is bounded if sensors report true values or none: a command
leads its gripper by at most max_lead, braking included, and the gripper moves for one period before
its force is measured. Therefore, it exceeds the hard limit by at most
stiffness · (max_lead + gripper speed · period). The exit status is 1 if any limit was exceeded.
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
)
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink

from drake_dress.file_output import output_file, write_text
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.sides import SIDES
from drake_dress.systems.floating_gripper import FloatingGripper
from drake_dress.systems.safety_governor import SafetyGovernor

PERIOD = 0.01  # of commands, s
GRIPPER_PERIOD, GRIPPER_SPEED, GRIPPER_ACCELERATION = 0.002, 0.25, 2.0
START = np.array([[0.0, 0.25, 1.4], [0.0, -0.25, 1.4]])
STIFFNESS, SLACK = 400.0, 0.03  # of a tether: N/m, m
LIMITS = SafetyLimits(least_distance=0.1)

# A controller's request: (generator, command, time) to velocities (2,3) and their time stamp.
Ask = Callable[[np.random.Generator, int, float], tuple[np.ndarray, float]]
# Disturbance added to measured position and force: (generator, command) to (2,6).
Disturb = Callable[[np.random.Generator, int], np.ndarray]


class FailingController(LeafSystem):
    """Requests the velocities that `ask` draws, at the command rate.

    .. pydrake_system::

        name: FailingController
        output_ports:
        - left_velocity_request
        - right_velocity_request
        - request_time
    """

    def __init__(self, ask: Ask, generator: np.random.Generator) -> None:
        super().__init__()
        self._ask, self._generator = ask, generator
        self.DeclareDiscreteState(7)
        for name, rows in zip(
            ("left_velocity_request", "right_velocity_request", "request_time"),
            (slice(0, 3), slice(3, 6), slice(6, 7)),
            strict=True,
        ):
            self.DeclareVectorOutputPort(
                name, rows.stop - rows.start, _state_rows(rows), {self.all_state_ticket()}
            )
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        now = context.get_time() + PERIOD  # when the governor reads it
        velocity, stamp = self._ask(self._generator, round(now / PERIOD), now)
        discrete.set_value(0, np.concatenate([velocity.ravel(), [stamp]]))


class FailingSensors(LeafSystem):
    """Adds the disturbance drawn by `disturb` to positions and forces; NaN hides them.

    .. pydrake_system::

        name: FailingSensors
        input_ports:
        - left_true
        - right_true
        output_ports:
        - left_gripper_position
        - left_gripper_force
        - right_gripper_position
        - right_gripper_force

    True values (6,): position, m, and force, N.
    """

    def __init__(self, disturb: Disturb, generator: np.random.Generator) -> None:
        super().__init__()
        self._disturb, self._generator = disturb, generator
        self.DeclareDiscreteState(12)
        for i, side in enumerate(SIDES):
            self.DeclareVectorInputPort(f"{side}_true", 6)
            for offset, name in ((0, "position"), (3, "force")):
                self.DeclareVectorOutputPort(
                    f"{side}_gripper_{name}", 3, self._calc(i, slice(offset, offset + 3))
                )
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        count = round(context.get_time() / PERIOD) + 1
        discrete.set_value(0, self._disturb(self._generator, count).ravel())

    def _calc(self, i: int, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            added = context.get_discrete_state(0).value()[6 * i : 6 * i + 6]
            output.SetFromVector((self.get_input_port(i).Eval(context) + added)[rows])

        return calc


class Tether(LeafSystem):
    """A garment reduced to one thread: pulls a gripper back to its start once it is stretched.

    .. pydrake_system::

        name: Tether
        input_ports:
        - gripper_position
        output_ports:
        - position_and_force

    Args:
        anchor: (3,) anchor point, m.
    """

    def __init__(self, anchor: np.ndarray) -> None:
        super().__init__()
        self._anchor = anchor
        self.DeclareVectorInputPort("gripper_position", 3)
        self.DeclareVectorOutputPort("position_and_force", 6, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        position = self.get_input_port(0).Eval(context)
        output.SetFromVector(np.concatenate([position, tether_force(position - self._anchor)]))


def tether_force(offset: np.ndarray) -> np.ndarray:
    """Returns the force (3,) on a gripper at `offset` (3,), m, from its anchor, N."""
    length = float(np.linalg.norm(offset))
    if length <= SLACK:
        return np.zeros(3)
    return -STIFFNESS * (length - SLACK) * offset / length


def _state_rows(rows: slice) -> Callable[[Context, BasicVector], None]:
    def calc(context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(0).value()[rows])

    return calc


def _any_velocity(rng: np.random.Generator, scale: float) -> np.ndarray:
    return scale * rng.normal(size=(2, 3))


def _outward(speed: float) -> np.ndarray:
    return np.array([[0.0, speed, 0.0], [0.0, -speed, 0.0]])


def _sprinkled(rng: np.random.Generator, values: np.ndarray, bad: float) -> np.ndarray:
    return np.where(rng.random(values.shape) < 0.1, bad, values)


def _random_request(rng: np.random.Generator, k: int, now: float) -> tuple[np.ndarray, float]:
    ask = list(REQUESTS.values())[rng.integers(len(REQUESTS) - 1)]
    return ask(rng, k, now)


V = LIMITS.max_speed
REQUESTS: dict[str, Ask] = {
    "pulls away forever": lambda rng, k, now: (_outward(V), now),
    "pulls at ten times the speed": lambda rng, k, now: (_outward(9.9 * V), now),
    "NaN": lambda rng, k, now: (_sprinkled(rng, _outward(V), np.nan), now),
    "infinite": lambda rng, k, now: (_sprinkled(rng, _outward(V), np.inf), now),
    "huge": lambda rng, k, now: (_any_velocity(rng, 10.0 ** rng.uniform(0, 300)), now),
    "jumps": lambda rng, k, now: (_any_velocity(rng, V), now),
    "alternates at the command rate": lambda rng, k, now: (_outward(V if k % 2 else -V), now),
    "alternates between the sides": lambda rng, k, now: (
        _outward(V) * np.roll([[1.0], [0.0]], k, axis=0),
        now,
    ),
    "drawn half of the time": lambda rng, k, now: (_outward(V * float(np.sin(0.1 * k) > 0)), now),
    "stale": lambda rng, k, now: (_outward(V), min(now, 0.5)),
    "goes back in time": lambda rng, k, now: (_outward(V), now - 0.02 * (k % 7)),
    "from the future": lambda rng, k, now: (_outward(V), now + rng.choice([0.0, 0.01, 1e9])),
    "stamp is no number": lambda rng, k, now: (
        _outward(V),
        float(rng.choice([now, np.nan, np.inf, -np.inf])),
    ),
    "all of these by chance": _random_request,
}


def _nothing(rng: np.random.Generator, k: int) -> np.ndarray:
    return np.zeros((2, 6))


def _hidden(columns: slice, share: float) -> Disturb:
    def disturb(rng: np.random.Generator, k: int) -> np.ndarray:
        added = np.zeros((2, 6))
        added[rng.random(2) < share, columns] = rng.choice([np.nan, np.inf])
        return added

    return disturb


def _lies(columns: slice, share: float, scale: float) -> Disturb:
    def disturb(rng: np.random.Generator, k: int) -> np.ndarray:
        added = np.zeros((2, 6))
        for i in (0, 1):
            if rng.random() < share:
                added[i, columns] = scale * rng.normal(size=3)
        return added

    return disturb


def _all_lies(rng: np.random.Generator, k: int) -> np.ndarray:
    return sum((d(rng, k) for d in list(SENSORS.values())[:-1]), start=np.zeros((2, 6)))


_POSITION, _FORCE = slice(0, 3), slice(3, 6)
# The first two report no false values, so the force's bound holds with them.
SENSORS: dict[str, Disturb] = {
    "force is NaN now and then": _hidden(_FORCE, 0.1),
    "position is NaN now and then": _hidden(_POSITION, 0.1),
    "force is random": _lies(_FORCE, 0.3, 40.0),
    "force is enormous": _lies(_FORCE, 0.02, 1e300),
    "position jumps by metres": _lies(_POSITION, 0.05, 3.0),
    "all of these by chance": _all_lies,
}
_TRUTHFUL = ("force is NaN now and then", "position is NaN now and then")


@dataclass(frozen=True)
class Worst:
    """Worst values for one failure.

    Attributes:
        failure: Description of the failure.
        commands: Number of commands for each gripper.
        speed: Largest speed of a command, m/s.
        acceleration: Largest acceleration of a command, m/s².
        pull: Largest speed against a measured force above the hard limit, beyond what braking
            allows, m/s.
        lead: Largest distance from the true gripper to its command, m; None with false sensors.
        force: Largest true force, N.
        force_bound: Bound of the force, N; None with false sensors.
    """

    failure: str
    commands: int
    speed: float
    acceleration: float
    pull: float
    lead: float | None
    force: float
    force_bound: float | None

    def broken(self) -> list[str]:
        """Returns the names of the exceeded limits."""
        held = {
            "speed": self.speed <= LIMITS.max_speed * (1.0 + 1e-9),
            # positions in metres are exact to 1e-16, so their second differences to 1e-11
            "acceleration": self.acceleration <= LIMITS.max_braking * (1.0 + 1e-9),
            "pull": self.pull <= 1e-9,
            "lead": self.lead is None or self.lead <= LIMITS.max_lead * (1.0 + 1e-9),
            "force": self.force_bound is None or self.force <= self.force_bound,
        }
        return [name for name, holds in held.items() if not holds]


def measure(failure: str, ask: Ask, disturb: Disturb, commands: int, seed: int) -> Worst:
    """Returns the worst values over `commands` commands with a failing controller or sensors."""
    rng = np.random.default_rng([seed, *failure.encode()])
    builder = DiagramBuilder()
    controller = builder.AddSystem(FailingController(ask, rng))
    sensors = builder.AddSystem(FailingSensors(disturb, rng))
    governor = builder.AddSystem(SafetyGovernor(START, PERIOD, LIMITS))
    builder.Connect(controller.GetOutputPort("request_time"), governor.GetInputPort("request_time"))
    permission = builder.AddSystem(ConstantVectorSource([1.0]))
    builder.Connect(permission.get_output_port(), governor.GetInputPort("permission"))
    sinks = {}
    for i, side in enumerate(SIDES):
        gripper = builder.AddSystem(
            FloatingGripper(START[i], GRIPPER_PERIOD, GRIPPER_SPEED, GRIPPER_ACCELERATION)
        )
        tether = builder.AddSystem(Tether(START[i]))
        ports = {"command": governor.GetOutputPort(f"{side}_position_command")}
        builder.Connect(ports["command"], gripper.get_input_port())
        builder.Connect(gripper.GetOutputPort("position_measured"), tether.get_input_port())
        builder.Connect(tether.get_output_port(), sensors.GetInputPort(f"{side}_true"))
        request = f"{side}_velocity_request"
        builder.Connect(controller.GetOutputPort(request), governor.GetInputPort(request))
        for name in ("position", "force"):
            port = f"{side}_gripper_{name}"
            ports[name] = sensors.GetOutputPort(port)
            builder.Connect(ports[name], governor.GetInputPort(port))
        ports["true"] = tether.get_output_port()
        for name, port in ports.items():
            sink = builder.AddSystem(VectorLogSink(port.size(), PERIOD))
            builder.Connect(port, sink.get_input_port())
            sinks[side, name] = sink
        fine = builder.AddSystem(VectorLogSink(6, GRIPPER_PERIOD))
        builder.Connect(ports["true"], fine.get_input_port())
        sinks[side, "fine"] = fine
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(commands * PERIOD)
    logs = {key: s.FindLog(simulator.get_context()).data().T for key, s in sinks.items()}
    worst = [_worst_of_side({n: logs[side, n] for _, n in logs}) for side in SIDES]
    speed, acceleration, pull, lead, force = np.max(worst, axis=0)
    truthful = disturb is _nothing or failure in _TRUTHFUL
    bound = LIMITS.hard_force + STIFFNESS * (LIMITS.max_lead + GRIPPER_SPEED * PERIOD)
    return Worst(
        failure,
        commands,
        float(speed),
        float(acceleration),
        float(pull),
        float(lead) if truthful else None,
        float(force),
        bound if truthful else None,
    )


def _worst_of_side(log: dict[str, np.ndarray]) -> tuple[float, float, float, float, float]:
    """Returns worst speed, acceleration, pull, lead and force of one gripper's logs.

    A log holds values before the update at its time: the governor's inputs in row k determine the
    command in row k + 1.
    """
    velocity = np.diff(log["command"], axis=0) / PERIOD
    before = np.vstack([np.zeros((1, 3)), velocity[:-1]])
    acceleration = np.linalg.norm(velocity - before, axis=1) / PERIOD
    position, force = log["position"][:-1], np.clip(log["force"][:-1], -1e9, 1e9)
    seen = np.isfinite(np.hstack([position, log["force"][:-1]])).all(axis=1)
    size = np.linalg.norm(np.where(seen[:, None], force, 0.0), axis=1)
    over = size >= LIMITS.hard_force
    against = -force[over] / size[over, None]
    left = np.sum(against * before[over], axis=1) - LIMITS.max_braking * PERIOD
    pull = np.sum(against * velocity[over], axis=1) - np.maximum(0.0, left)
    lead = np.linalg.norm(log["command"][1:] - log["true"][:-1, :3], axis=1)
    return (
        float(np.linalg.norm(velocity, axis=1).max()),
        float(acceleration.max()),
        float(pull.max(initial=-np.inf)),
        float(lead.max()),
        float(np.linalg.norm(log["fine"][:, 3:], axis=1).max()),
    )


def run(commands: int, seed: int, tell: bool = False) -> list[Worst]:
    """Returns the worst values of each failure; `commands` are divided among the failures."""
    failures: list[tuple[str, Ask, Disturb]] = [
        *((f"request: {name}", ask, _nothing) for name, ask in REQUESTS.items()),
        *((name, REQUESTS["pulls away forever"], disturb) for name, disturb in SENSORS.items()),
        ("everything fails by chance", _random_request, _all_lies),
    ]
    each = max(2, -(-commands // len(failures)))
    found = []
    for i, (name, ask, disturb) in enumerate(failures):
        if tell:
            print(f"{i} of {len(failures)} failures", file=sys.stderr, flush=True)
        found.append(measure(name, ask, disturb, each, seed))
    return found


def print_table(found: list[Worst]) -> None:
    """Prints the limits, then a row for each failure."""
    bound = next(w.force_bound for w in found if w.force_bound is not None)
    print("| failure | commands | speed, m/s | acceleration, m/s² ", end="")
    print("| pull beyond braking, m/s | lead, mm | force, N | broken |")
    print("| --- " * 8 + "|")
    print(
        f"| limit | | {LIMITS.max_speed:g} | {LIMITS.max_acceleration:g}, braking "
        f"{LIMITS.max_braking:g} | 0 | {1e3 * LIMITS.max_lead:g} "
        f"| {LIMITS.hard_force:g}, bound {bound:.1f} | |"
    )
    for w in found:
        lead = "false" if w.lead is None else f"{1e3 * w.lead:.2f}"
        pull = "no such force" if np.isinf(w.pull) else f"{w.pull:.1e}"
        force = f"{w.force:.1f}" + ("" if w.force_bound is not None else " (sensor lies)")
        print(
            f"| {w.failure} | {w.commands} | {w.speed:.6f} | {w.acceleration:.6f} | {pull} "
            f"| {lead} | {force} | {', '.join(w.broken()) or 'none'} |"
        )


def main() -> int:
    """Runs all failures; returns 1 if a limit was exceeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--commands", type=int, default=10000, help="in all (default 10000)")
    parser.add_argument("--seed", type=int, help="of all that is random; drawn if not given")
    parser.add_argument("--json", type=output_file, help="write all figures here")
    options = parser.parse_args()
    seed = secrets.randbelow(2**32) if options.seed is None else options.seed
    print(f"seed {seed}")
    found = run(options.commands, seed, tell=True)
    print_table(found)
    if options.json:
        write_text(options.json, json.dumps([asdict(w) for w in found], indent=1) + "\n")
    return int(any(w.broken() for w in found))


if __name__ == "__main__":
    sys.exit(main())
