"""What a lab sends while a fault is on, and what a run makes of it."""

import numpy as np
import pytest
from drake import lcmt_point_cloud

from drake_dress.models.supervision.fault import Fault
from drake_dress.models.supervision.injection import KINDS, sources_of
from drake_dress.models.supervision.wrong_points import WRONG_POINTS
from drake_dress.systems.lcm_inbox import Decoder, Taken
from drake_dress.systems.point_messages import decode_points, encode_points
from drake_dress.systems.spoiler import Spoiler, spoil_points

PERIOD, LATE = 0.02, 0.2
POINTS = np.arange(18.0).reshape(6, 3) + 0.5


def heard(*kinds: str, count: int = 12) -> list[Taken]:
    """Returns what a decoder takes from a lab whose fault begins after three messages."""
    spoiler = Spoiler(lcmt_point_cloud)
    decoder = Decoder(lcmt_point_cloud, late=LATE)
    taken = []
    for k in range(count):
        encoded = encode_points(1.0 + PERIOD * k, POINTS + 1e-3 * k).encode()
        taken += [decoder(raw) for raw in spoiler(encoded, set(kinds) if k >= 3 else set())]
    return taken


def faults(taken: list[Taken]) -> set[Fault]:
    return {t.finding.fault for t in taken if t.finding is not None}


def test_a_packet_that_is_overtaken_is_dropped_alone() -> None:
    taken = heard("reordered")
    assert faults(taken) == {Fault.NONE}
    assert [t.finding is None for t in taken] == [False] * 3 + [False, True] * 3
    stamps = [t.message.utime for t in taken if t.finding is not None]
    assert stamps == sorted(set(stamps))


def test_a_packet_that_comes_twice_is_no_fault() -> None:
    taken = heard("duplicated")
    assert faults(taken) == {Fault.NONE}
    assert len({t.message.utime for t in taken}) == 3 + 5


def test_a_clock_that_is_set_back_by_less_than_a_period_is_no_fault() -> None:
    assert faults(heard("set_back")) == {Fault.NONE}


@pytest.mark.parametrize(
    ("kind", "fault"),
    [
        ("second_sender", Fault.TIME_BACK),
        ("time_back", Fault.TIME_BACK),
        ("utime_zero", Fault.UNSTAMPED),
    ],
)
def test_a_clock_of_another_time_is_a_fault(kind: str, fault: Fault) -> None:
    taken = heard(kind)
    assert faults(taken) == {Fault.NONE, fault}
    refused = [t for t in taken if t.finding is not None and t.finding.fault]
    assert all(not t.usable and t.finding is not None and t.finding.reason for t in refused)


def test_points_are_made_wrong_message_by_message() -> None:
    kinds = {k: spoil_points(w) for k, w in WRONG_POINTS.items()}
    spoiler = Spoiler(lcmt_point_cloud, kinds)
    sent = []
    for k in range(4):
        encoded = encode_points(PERIOD * k, POINTS + k).encode()
        (raw,) = spoiler(encoded, {"person_frozen"} if k else set())
        sent.append(lcmt_point_cloud.decode(raw))
    points = [decode_points(m) for m in sent]
    np.testing.assert_array_equal(points[3], POINTS + 1)
    assert [m.utime for m in sent] == [0, 20_000, 40_000, 60_000]


@pytest.mark.parametrize("kind", WRONG_POINTS)
def test_each_kind_has_one_source(kind: str) -> None:
    assert kind in KINDS
    assert sources_of(kind) in (("person",), ("garment",))
