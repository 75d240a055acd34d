"""Random mutations of hardware messages: statuses, persons and garments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from drake import lcmt_panda_status, lcmt_point_cloud

from benchmarks.inputs.trials import Expect, Trial
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.hardware_station import Beliefs
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.sections.hardware import beliefs
from drake_dress.diagrams.setup import station_parameters
from drake_dress.errors import UserError
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import arm_points
from drake_dress.models.sides import SIDES
from drake_dress.systems.estimate_checks import GarmentCheck, PersonCheck
from drake_dress.systems.lcm_inbox import Check, Decoder
from drake_dress.systems.point_messages import encode_points
from drake_dress.systems.status_messages import StatusCheck

Rng = np.random.Generator
_SCENARIO = Path(__file__).parents[2] / "scenarios" / "lab.yaml"
# Period of the messages, s.
_PERIOD = 0.02
# Bound of the number of valid messages before the mutated one.
_BEFORE = 8


def draw_message(rng: Rng) -> Trial:
    """Returns a mutation of a valid message, preceded by valid ones from the same source."""
    return _pick(rng, (_status, _person, _garment))(rng)


def _trial(told: str, expect: Expect, decoder: Decoder, sound: list[bytes], last: bytes) -> Trial:
    def use() -> str | None:
        for k, message in enumerate(sound):
            taken = decoder(message)
            if not taken.usable:
                return f"sound message {k} is refused: {taken.finding}"
        taken = decoder(last)
        if taken.finding is None:
            raise UserError("message", "", "dropped")
        if not taken.usable:
            reason = taken.finding.reason
            raise UserError("message", "", reason or taken.finding.fault.name or "")
        return None

    return Trial(told, expect, use)


def _pick(rng: Rng, items: Sequence[Any]) -> Any:
    return items[int(rng.integers(len(items)))]


@cache
def _believed() -> tuple[GarmentMesh, Beliefs, FloatArray]:
    """Returns the garment, the plausibility bounds, and the person's six points, m."""
    scenario = load_scenario(_SCENARIO)
    mesh = build_garment(scenario.garment, scenario.controller.spacing, _SCENARIO.parent)
    p = station_parameters(scenario, mesh)
    points = [arm_points(p.measures, p.posture, side, p.arms[side]) for side in SIDES]
    return mesh, beliefs(scenario.station.hardware.beliefs, p), np.concatenate(points)


def _damaged(rng: Rng, message: bytes) -> tuple[str, bytes]:
    data, how = bytearray(message), _pick(rng, ("cut", "longer", "noise", "nothing", "twice"))
    if how == "cut":
        del data[int(rng.integers(len(data))) :]
    elif how == "longer":
        data += rng.bytes(int(rng.integers(1, 50)))
    elif how == "noise":
        data = bytearray(rng.bytes(int(rng.integers(1, 2000))))
    elif how == "nothing":
        data.clear()
    else:
        data += bytes(data)
    return f"bytes {how}", bytes(data)


# ---- points


def _person(rng: Rng) -> Trial:
    _, believed, points = _believed()
    mutate = _pick(rng, _PERSONS)
    told, wrong, expect = mutate(rng, points)
    check = PersonCheck(believed.person)
    return _of_points(rng, f"person {told}", expect, check, points, wrong, None)


def _garment(rng: Rng) -> Trial:
    mesh, believed, points = _believed()
    # the garment hangs from grippers behind the shoulders
    nodes = mesh.rest_position + points[[0, 3]].mean(axis=0) + [-0.75, 0.0, 0.0]
    grippers = np.stack([nodes[mesh.grasp[side]].mean(axis=0) for side in SIDES])
    told, wrong, expect = _pick(rng, _GARMENTS)(rng, nodes)
    check = GarmentCheck(len(nodes), believed.garment, lambda: grippers)
    return _of_points(rng, f"garment {told}", expect, check, nodes, wrong, np.zeros_like(nodes))


def _of_points(
    rng: Rng,
    told: str,
    expect: Expect,
    check: Check,
    sound: FloatArray,
    wrong: FloatArray,
    velocity: FloatArray | None,
) -> Trial:
    count = int(rng.integers(0, _BEFORE))
    noise = 0.002

    def message(k: int, points: FloatArray) -> bytes:
        columns = (
            [points] if velocity is None or len(points) != len(velocity) else [points, velocity]
        )
        encoded: bytes = encode_points(1.0 + _PERIOD * k, *columns).encode()
        return encoded

    before = [message(k, sound + noise * rng.standard_normal(sound.shape)) for k in range(count)]
    with np.errstate(over="ignore", invalid="ignore"):
        last = message(count, wrong + noise * rng.standard_normal(wrong.shape))
    if rng.random() < 0.1:
        told, last = _damaged(rng, last)
        expect = Expect.REFUSE
    return _trial(told, expect, Decoder(lcmt_point_cloud, check), before, last)


_Wrong = tuple[str, FloatArray, Expect]


def _sound(rng: Rng, x: FloatArray) -> _Wrong:
    return "sound", x, Expect.ACCEPT


def _unit(rng: Rng, x: FloatArray) -> _Wrong:
    factor = float(_pick(rng, (1000.0, 100.0, 39.37, 3.28, 0.001, 0.01, 0.5, 2.0, -1.0)))
    return f"x {factor:g}", factor * x, Expect.REFUSE


def _axes(rng: Rng, x: FloatArray) -> _Wrong:
    order = _pick(rng, ([0, 2, 1], [1, 2, 0], [2, 0, 1], [2, 1, 0]))
    return f"axes {order}", x[:, order], Expect.REFUSE


def _zeros(rng: Rng, x: FloatArray) -> _Wrong:
    wrong = x.copy()
    few = len(x) <= 6
    rows = rng.choice(len(x), int(rng.integers(1, len(x) + 1 if few else len(x) // 2)), False)
    wrong[rows] = _pick(rng, (0.0, -1.0, 9999.0))
    return f"{len(rows)} lost as {wrong[rows[0], 0]:g}", wrong, Expect.REFUSE


def _not_finite(rng: Rng, x: FloatArray) -> _Wrong:
    wrong = x.copy()
    wrong[rng.integers(len(x)), rng.integers(3)] = value = _pick(
        rng, (np.nan, np.inf, -np.inf, 1e39)
    )
    return f"{value:g}", wrong, Expect.REFUSE


def _far(rng: Rng, x: FloatArray) -> _Wrong:
    away = rng.standard_normal(3)
    away *= float(rng.uniform(0.6, 5.0)) / np.linalg.norm(away)
    return f"{np.linalg.norm(away):.2f} m away", x + away, Expect.REFUSE


def _huge(rng: Rng, x: FloatArray) -> _Wrong:
    factor = float(10.0 ** rng.uniform(4, 37))
    return f"x {factor:.0e}", factor * x, Expect.REFUSE


def _size(rng: Rng, x: FloatArray) -> _Wrong:
    count = int(_pick(rng, (0, 1, len(x) - 1, len(x) + 1, 2 * len(x))))
    return f"{count} points", np.resize(x, (count, 3)), Expect.REFUSE


def _shuffled(rng: Rng, x: FloatArray) -> _Wrong:
    order = rng.permutation(len(x))
    while (order == np.arange(len(x))).all():
        order = rng.permutation(len(x))
    return f"order {order[:6].tolist()}", x[order], Expect.REFUSE


def _point_off(rng: Rng, x: FloatArray) -> _Wrong:
    wrong, away = x.copy(), rng.standard_normal(3)
    wrong[rng.integers(len(x))] += float(rng.uniform(0.4, 3.0)) * away / np.linalg.norm(away)
    return "one point off", wrong, Expect.REFUSE


def _upside_down(rng: Rng, x: FloatArray) -> _Wrong:
    middle = x.mean(axis=0)
    turned = middle + (x - middle) * [1.0, -1.0, -1.0]
    return "upside down", turned, Expect.REFUSE


def _mirrored(rng: Rng, x: FloatArray) -> _Wrong:
    return "left and right mirrored", x * [1.0, -1.0, 1.0], Expect.REFUSE


def _swapped_sides(rng: Rng, x: FloatArray) -> _Wrong:
    return "sides swapped", x[[3, 4, 5, 0, 1, 2]], Expect.REFUSE


_POINTS = (_sound, _unit, _axes, _zeros, _not_finite, _far, _huge, _size, _shuffled, _point_off)
_PERSONS: tuple[Callable[[Rng, FloatArray], _Wrong], ...] = (*_POINTS, _swapped_sides)
_GARMENTS: tuple[Callable[[Rng, FloatArray], _Wrong], ...] = (*_POINTS, _upside_down, _mirrored)


# ---- statuses


def _status(rng: Rng) -> Trial:
    _, believed, _ = _believed()
    q = 0.5 * (LIMITS.lower + LIMITS.upper)
    count = int(rng.integers(0, _BEFORE))
    sound = [_status_of(q, k) for k in range(count)]
    message = _status_of(q, count)
    told, expect = _pick(rng, _STATUSES)(rng, message)
    last: bytes = message.encode() if isinstance(told, str) else b""
    if rng.random() < 0.1:
        told, last = _damaged(rng, last)
        expect = Expect.REFUSE
    decoder = Decoder(lcmt_panda_status, StatusCheck(believed.joints))
    return _trial(f"status {told}", expect, decoder, [m.encode() for m in sound], last)


def _status_of(q: FloatArray, k: int) -> Any:
    message = lcmt_panda_status()
    message.utime = round(1e6 * (1.0 + _PERIOD * k))
    message.num_joints = len(q)
    for name in vars(type(message))["__slots__"]:
        if name.startswith("joint_"):
            setattr(message, name, [0.0] * len(q))
    message.joint_position = message.joint_position_desired = q.tolist()
    message.robot_mode = lcmt_panda_status.kMove
    return message


_StatusTold = tuple[str, Expect]


def _unchanged(rng: Rng, m: Any) -> _StatusTold:
    return "sound", Expect.ACCEPT


def _mode(rng: Rng, m: Any) -> _StatusTold:
    good = (lcmt_panda_status.kMove, lcmt_panda_status.kIdle)
    m.robot_mode = int(_pick(rng, [x for x in range(-128, 128) if x not in good]))
    # the position is valid, but the arm reports that it does not follow, so arms hold
    return f"mode {m.robot_mode}", Expect.EITHER


def _joint(rng: Rng, m: Any) -> _StatusTold:
    k = int(rng.integers(7))
    value = _pick(
        rng, (LIMITS.upper[k] + 0.02, LIMITS.lower[k] - 0.02, 1e3, np.nan, np.inf, -np.inf)
    )
    m.joint_position[k] = float(value)
    return f"joint {k} at {value:.3g}", Expect.REFUSE


def _speed(rng: Rng, m: Any) -> _StatusTold:
    k = int(rng.integers(7))
    value = _pick(rng, (1.2 * LIMITS.speed[k], -1.2 * LIMITS.speed[k], 1e3, np.nan, np.inf))
    m.joint_velocity[k] = float(value)
    return f"speed {value:.3g}", Expect.REFUSE


def _torque(rng: Rng, m: Any) -> _StatusTold:
    m.joint_torque_external[int(rng.integers(7))] = value = float(_pick(rng, (1e4, np.nan, np.inf)))
    return f"torque {value:.3g}", Expect.REFUSE


def _degrees(rng: Rng, m: Any) -> _StatusTold:
    m.joint_position = np.rad2deg(m.joint_position).tolist()
    return "degrees", Expect.REFUSE


def _joint_count(rng: Rng, m: Any) -> _StatusTold:
    count = int(_pick(rng, (0, 6, 8, 14)))
    m.num_joints = count
    for name in vars(type(m))["__slots__"]:
        if name.startswith("joint_"):
            setattr(m, name, [0.0] * count)
    return f"{count} joints", Expect.REFUSE


def _stamp_back(rng: Rng, m: Any) -> _StatusTold:
    m.utime = _pick(rng, (-(10**9), -(2**62)))
    return f"utime {m.utime}", Expect.EITHER


_STATUSES: tuple[Callable[[Rng, Any], _StatusTold], ...] = (
    _unchanged,
    _mode,
    _joint,
    _speed,
    _torque,
    _degrees,
    _joint_count,
    _stamp_back,
)
