"""Tracks a garment with views that arrive late.

What grippers and person did is kept for a while, with the estimate at each time. A view corrects
the estimate at the time of its exposure, and from there the garment is predicted anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.person_model import (
    PersonModel,
    person_capsules,
    person_obstacles,
)
from drake_dress.models.immutable import Immutable
from drake_dress.models.perception.garment_filter import GarmentFilter, TrackedGarment, View

# Time for which the garment hangs from still grippers before it is tracked, in periods that each
# end with the garment at rest, s.
_SETTLING_TIME, _SETTLING_PERIOD = 3.0, 0.3


@dataclass(frozen=True)
class Motion(Immutable):
    """What leads the garment at a time.

    Attributes:
        time: s.
        grippers: (2,3) positions of left and right, m.
        joints: (6,3) shoulder, elbow, hand of the person's left, then right arm, m.
        are_open: whether the grippers have let go.
    """

    time: float
    grippers: FloatArray
    joints: FloatArray
    are_open: bool


@dataclass(frozen=True)
class Moment(Immutable):
    """The estimate at the time of a motion's sample."""

    motion: Motion
    garment: TrackedGarment


@dataclass(frozen=True)
class Tracking(Immutable):
    """State of a tracker.

    Attributes:
        moments: those that views may still correct, the newest last.
        corrected: time of the newest views that were used, s; -inf before any.
    """

    moments: tuple[Moment, ...]
    corrected: float = -np.inf

    @property
    def now(self) -> Moment:
        """The newest moment."""
        return self.moments[-1]


@dataclass(frozen=True)
class Exposure(Immutable):
    """Views that cameras took at one time, s."""

    time: float
    views: tuple[View, ...]


class DelayedTracker:
    """Tracks a garment while grippers hold it, and once they have let go.

    Args:
        holding: filter of the held garment.
        free: filter of the garment that is let go.
        offsets: (k,3) nodes that the left and the right gripper hold, relative to it, m.
        person: the person's shape.
        memory: time for which moments are kept, s.
    """

    def __init__(
        self,
        holding: GarmentFilter,
        free: GarmentFilter,
        offsets: tuple[FloatArray, FloatArray],
        person: PersonModel,
        memory: float = 0.5,
    ) -> None:
        self._holding, self._free, self._offsets = holding, free, offsets
        self._person, self._memory = person, memory
        self.time_step = holding.settings.time_step

    def begun(self, x: FloatArray, motion: Motion) -> Tracking:
        """Returns the state at the start, with the garment settled where the grippers hold it.

        Args:
            x: (n,3) nodes as they hang without weight, m.
            motion: at the start; the person is taken to be out of reach.
        """
        held, h = self._held_at(motion), self.time_step
        away = [Obstacles.none()] * max(1, round(_SETTLING_PERIOD / h))
        for _ in range(round(_SETTLING_TIME / _SETTLING_PERIOD)):
            x = self._holding.predicted(TrackedGarment.at_rest(x), held, away).cloth.x
        return Tracking((Moment(motion, TrackedGarment.at_rest(x)),))

    def advanced(self, tracking: Tracking, motions: Sequence[Motion]) -> Tracking:
        """Returns the state after motions, which follow in steps of `time_step`."""
        moments = list(tracking.moments)
        for motion in motions:
            moments.append(self._after(moments[-1], motion))
        first = moments[-1].motion.time - self._memory
        return replace(tracking, moments=tuple(m for m in moments if m.motion.time >= first - 1e-9))

    def seen(self, tracking: Tracking, exposures: Sequence[Exposure]) -> Tracking:
        """Returns the state with what cameras saw.

        Exposures that are older than what is kept, or than one that was used, are left out.
        """
        for exposure in sorted(exposures, key=lambda e: e.time):
            moments = tracking.moments
            if exposure.time <= tracking.corrected:
                continue
            times = np.array([m.motion.time for m in moments])
            k = int(np.abs(times - exposure.time).argmin())
            if abs(times[k] - exposure.time) > self.time_step:
                continue
            since = min(exposure.time - tracking.corrected, self._memory)
            at = moments[k]
            used = self._filter_of(at.motion)
            body = Obstacles.resting(*person_capsules(self._person, at.motion.joints))
            at = replace(at, garment=used.corrected(at.garment, exposure.views, since, body))
            redone = [*moments[:k], at]
            for later in moments[k + 1 :]:
                redone.append(self._after(redone[-1], later.motion))
            tracking = Tracking(tuple(redone), exposure.time)
        return tracking

    def _after(self, moment: Moment, motion: Motion) -> Moment:
        joints = np.stack([moment.motion.joints, motion.joints])
        person = person_obstacles(self._person, joints, self.time_step)
        used = self._filter_of(motion)
        held = self._held_at(motion) if used is self._holding else np.zeros((0, 3))
        return Moment(motion, used.predicted(moment.garment, held, person))

    def _filter_of(self, motion: Motion) -> GarmentFilter:
        return self._free if motion.are_open else self._holding

    def _held_at(self, motion: Motion) -> FloatArray:
        return np.concatenate(
            [at + off for at, off in zip(motion.grippers, self._offsets, strict=True)]
        )
