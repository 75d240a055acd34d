"""An estimate is believed if it can be the garment that grippers hold, and only then."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.garment.mesh import edge_lengths
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import Fault, Finding
from drake_dress.models.supervision.garment_belief import (
    GarmentBounds,
    GarmentTrack,
    judge_garment,
)
from drake_dress.models.supervision.garment_shape import ShapeBounds, impossible_shape
from drake_dress.models.supervision.wrong_points import WRONG_POINTS, Moment

COAT = make_coat(COATS["jacket"], 0.05)
SHAPE = ShapeBounds(
    edges=unique_edges(COAT.faces),
    rest_length=edge_lengths(COAT.rest_position, COAT.faces),
    grasp=(COAT.grasp["left"], COAT.grasp["right"]),
    extent=float(np.linalg.norm(np.ptp(COAT.rest_position, axis=0))),
)
BOUNDS = GarmentBounds(SHAPE)
HUNG = COAT.rest_position + [-0.75, 0.0, 1.4]
GRIPPERS = np.stack([HUNG[COAT.grasp[side]].mean(axis=0) for side in SIDES])
PERIOD = 0.02
COUNT = len(HUNG)

# a mistake is found in each draw, or in none
few = settings(max_examples=25)
seeds = st.integers(0, 2**32 - 1)


def noise(seed: int) -> np.ndarray:
    return SHAPE.node_noise * np.random.default_rng(seed).normal(size=(COUNT, 3))


def refused(nodes: np.ndarray, grippers: np.ndarray | None = GRIPPERS) -> str:
    told = impossible_shape(nodes, grippers, SHAPE)
    assert told is not None
    return told


def rotation(seed: int) -> np.ndarray:
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    q[:, 0] *= np.linalg.det(q)
    return q


@few
@given(seeds, st.floats(0.0, 0.2), st.integers(0, 2))
def test_a_coat_that_is_stretched_and_seen_with_noise_is_believed(
    seed: int, strain: float, axis: int
) -> None:
    stretched = HUNG.copy()
    stretched[:, axis] = GRIPPERS.mean(axis=0)[axis] + (1.0 + strain) * (
        HUNG[:, axis] - GRIPPERS.mean(axis=0)[axis]
    )
    at = np.stack([stretched[COAT.grasp[side]].mean(axis=0) for side in SIDES])
    assert impossible_shape(stretched + noise(seed), at, SHAPE) is None


@few
@given(seeds, seeds)
def test_a_coat_held_in_any_way_is_believed(seed: int, turn: int) -> None:
    turned = HUNG @ rotation(turn).T
    at = np.stack([turned[COAT.grasp[side]].mean(axis=0) for side in SIDES])
    assert impossible_shape(turned + noise(seed), at, SHAPE) is None


@few
@given(seeds, st.floats(2.0, 1e4), st.booleans(), st.booleans())
def test_other_units_are_refused(seed: int, factor: float, larger: bool, held: bool) -> None:
    scaled = (factor if larger else 1.0 / factor) * (HUNG + noise(seed))
    refused(scaled, GRIPPERS if held else None)


@few
@given(seeds, st.sampled_from([(1e3, "in mm"), (1e2, "in cm"), (1 / 0.0254, "in inches")]))
def test_usual_units_are_named(seed: int, unit: tuple[float, str]) -> None:
    assert refused(unit[0] * (HUNG + noise(seed))).startswith(f"coordinates are {unit[1]}: ")


@few
@given(seeds, seeds)
def test_a_permutation_is_refused_and_named(seed: int, order: int) -> None:
    nodes = (HUNG + noise(seed))[np.random.default_rng(order).permutation(COUNT)]
    told = refused(nodes)
    assert "edge between nodes" in told
    assert told.endswith("nodes in another order")


@few
@given(seeds, st.integers(0, COUNT - 1), st.integers(0, COUNT - 1))
def test_two_nodes_that_are_swapped_are_refused(seed: int, a: int, b: int) -> None:
    """Neighbours may be swapped within the noise."""
    assume(np.linalg.norm(HUNG[a] - HUNG[b]) > 0.4)
    nodes = HUNG + noise(seed)
    nodes[[a, b]] = nodes[[b, a]]
    assert "edge between nodes" in refused(nodes)


@few
@given(seeds, st.sampled_from([np.s_[::-1], np.s_[1:]]))
def test_nodes_that_are_shifted_or_reversed_are_refused(seed: int, order: slice) -> None:
    nodes = HUNG + noise(seed)
    refused(np.vstack([nodes[order], nodes[: COUNT - len(nodes[order])]]))


@few
@given(seeds)
def test_mirrored_coordinates_are_refused_and_named(seed: int) -> None:
    told = refused((HUNG + noise(seed)) * [1.0, -1.0, 1.0])
    assert told.startswith("coordinates are mirrored left and right: ")
    assert "nodes held by the" in told


@few
@given(seeds, st.floats(0.2, 3.0), st.integers(0, 2))
def test_a_coat_that_is_not_where_its_grippers_are_is_told(
    seed: int, far: float, axis: int
) -> None:
    nodes = HUNG + noise(seed)
    nodes[:, axis] += far
    assert "expected 0.12 m at most" in refused(nodes)
    assert impossible_shape(nodes, None, SHAPE) is None


@few
@given(seeds, st.sets(st.integers(0, COUNT - 1), min_size=1, max_size=50))
def test_lost_nodes_are_counted(seed: int, lost: set[int]) -> None:
    nodes = HUNG + noise(seed)
    nodes[sorted(lost)] = 0.0
    told = refused(nodes)
    assert told.startswith(f"{len(lost)} of {COUNT} nodes at (0, 0, 0), as lost points")
    assert told.endswith(f"node {min(lost)}")


@few
@given(seeds, st.floats(10.0, 1e37), st.integers(0, COUNT - 1))
def test_a_huge_value_is_refused(seed: int, size: float, k: int) -> None:
    nodes = HUNG + noise(seed)
    nodes[k] = size
    refused(nodes)


# Nodes (n,3), m, their velocities (n,3), m/s, None where they are not sent, and grippers (2,3), m.
Message = tuple[np.ndarray, np.ndarray | None, np.ndarray]
Carried = tuple[np.ndarray, np.ndarray, np.ndarray]


def judged(messages: Sequence[Message], bounds: GarmentBounds = BOUNDS) -> list[Finding]:
    track: GarmentTrack | None = None
    found = []
    for k, (nodes, velocity, grippers) in enumerate(messages):
        one, track = judge_garment(nodes, velocity, PERIOD * k, grippers, track, bounds)
        found.append(one)
    return found


def carried(count: int, velocity: np.ndarray, seed: int | None = None) -> list[Carried]:
    """Returns a coat that grippers carry at a velocity (3,), m/s, with noise if it has a seed."""
    messages = []
    for k in range(count):
        way = PERIOD * k * velocity
        error = 0.0 if seed is None else noise((seed + k) % 2**32)
        messages.append((HUNG + way + error, np.tile(velocity, (COUNT, 1)), GRIPPERS + way))
    return messages


@settings(max_examples=15)
@given(seeds, seeds, st.floats(0.0, 0.9))
def test_motion_within_the_bounds_is_believed(seed: int, way: int, share: float) -> None:
    velocity = share * BOUNDS.speed * rotation(way)[0]
    assert all(not f.fault for f in judged(carried(30, velocity, seed)))


def test_a_node_that_leaps_is_told() -> None:
    messages = carried(2, np.zeros(3))
    far = int(np.argmin(HUNG[:, 2]))
    # it and its neighbours, so that no edge tears
    near = np.linalg.norm(HUNG - HUNG[far], axis=1)
    messages[1][0][:] += np.outer(np.exp(-((near / 0.25) ** 2)), [0.25, 0.0, 0.0])
    found = judged(messages)[1]
    assert found.fault is Fault.LEAP
    assert found.reason == f"node {far} moved 0.25 m in 0.020 s, expected 0.16 m at most"


@pytest.mark.parametrize("factor", [-1.0, 10.0, 100.0])
def test_velocities_that_contradict_positions_are_told(factor: float) -> None:
    along = np.array([1.0, 0.0, 0.0])
    messages = [(x, factor * v, g) for x, v, g in carried(40, along)]
    found = judged(messages)
    assert found[-1].fault is Fault.IMPOSSIBLE
    assert "velocit" in found[-1].reason
    assert all(not f.fault for f in judged(carried(40, along)))


def test_a_garment_that_is_frozen_while_a_gripper_moves_is_told() -> None:
    slow = np.array([0.12, 0.0, 0.0])
    messages = carried(40, slow)
    frozen = [(messages[0][0], messages[0][1], g) for _, _, g in messages]
    found = judged(frozen)
    begin = int(np.ceil(BOUNDS.frozen_travel / 0.12 / PERIOD)) + 1
    assert all(not f.fault for f in found[: begin - 2])
    assert all(f.fault is Fault.FROZEN for f in found[begin:])
    assert "the same to the last bit in" in found[-1].reason
    # one that rests in grippers that rest
    assert all(not f.fault for f in judged(carried(40, np.zeros(3))))
    assert all(not f.fault for f in judged(frozen, replace(BOUNDS, frozen_travel=0.0)))
    # one that lives again is believed again
    assert not judged(frozen + carried(1, np.zeros(3)) + carried(2, np.zeros(3), 3))[-1].fault


@pytest.mark.parametrize("kind", [k for k in WRONG_POINTS if k.startswith("garment")])
def test_all_that_a_lab_plays_is_refused(kind: str) -> None:
    slow = np.array([0.12, 0.0, 0.0])
    messages = carried(80, slow, 7)
    nodes, velocity, _ = messages[40]
    first = np.hstack([nodes, velocity])
    for k in range(40, 80):
        nodes, velocity, grippers = messages[k]
        values = WRONG_POINTS[kind](Moment(np.hstack([nodes, velocity]), first, k - 40))
        messages[k] = values[:, :3], values[:, 3:], grippers
    found = [f.fault for f in judged(messages)]
    assert set(found[:40]) == {Fault.NONE}
    if kind == "garment_jump":
        assert set(found[40::2]) <= {Fault.IMPOSSIBLE, Fault.LEAP}
    elif kind == "garment_frozen":
        assert set(found[50:]) <= {Fault.FROZEN, Fault.IMPOSSIBLE}
    else:
        assert set(found[40:]) == {Fault.IMPOSSIBLE}
