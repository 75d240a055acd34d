"""A tracker of the garment that sees it with depth cameras."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I

from drake_dress.models.arrays import FloatArray
from drake_dress.models.immutable import Immutable
from drake_dress.models.perception.delayed_tracking import (
    DelayedTracker,
    Exposure,
    Motion,
    Tracking,
)
from drake_dress.models.perception.garment_filter import View
from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.sides import SIDES
from drake_dress.systems.worker_process import WorkerProcess, on_a_thread

# Polling period for a finished estimate if time does not wait for it, s.
_LOOKING_PERIOD = 0.01


@dataclass(frozen=True)
class TrackerTiming:
    """When a tracker works.

    Attributes:
        period: time between estimates, s; a multiple of the tracker's time step.
        delay: modelled time from the start of the work until the estimate is used, s.
        waits: whether simulated time waits for an estimate that takes longer than its delay. If
            not, estimates are made in a worker process, and used once they are ready.
    """

    period: float = 0.1
    delay: float = 0.08
    waits: bool = True


@dataclass(frozen=True)
class _Known(Immutable):
    """Motion since the last estimate was begun, times of the last exposures, and work going on."""

    motions: tuple[Motion, ...] = ()
    used: Mapping[str, float] = field(default_factory=dict)
    ticks: int = 0
    pending: Future[Tracking] | None = None


@dataclass(frozen=True)
class _Estimate(Immutable):
    """A finished estimate, and the work that it is the result of."""

    tracking: Tracking
    of: Future[Tracking] | None = None


@dataclass(frozen=True)
class _Work:
    """The work for one estimate, in a thread or a worker process."""

    tracker: DelayedTracker

    def __call__(
        self, tracking: Tracking, motions: tuple[Motion, ...], exposures: list[Exposure]
    ) -> Tracking:
        return self.tracker.seen(self.tracker.advanced(tracking, motions), exposures)


class GarmentTracker(LeafSystem):
    """Estimates a garment from images, the grippers and the person.

    .. pydrake_system::

        name: GarmentTracker
        input_ports:
        - left_gripper_position
        - right_gripper_position
        - joint_position
        - grippers_open
        - NAME.depth_image
        - NAME.label_image
        - NAME.image_time
        output_ports:
        - garment_position
        - garment_velocity
        - age

    *_gripper_position: (3,) m. joint_position: (18,) row-major (6,3) shoulder, elbow, hand of left,
    then right arm, m. grippers_open: (1,) 1 once both have let go. Of each camera: ImageDepth32F,
    ImageLabel16I, and (1,) the time of their exposure, s, below 0 before the first. garment_*:
    (3m,) of the controller's garment, m, m/s; positions go on at their velocity until the next
    estimate. age: (1,) time since the exposure of the newest images that were used, s; inf before.

    Args:
        tracker: tracks the garment.
        start: its state at time 0.
        transfer: (m,n) from the tracker's nodes to the controller's.
        cameras: as they are believed to stand, by name.
        label: of the garment in label images.
        timing: when it works.
    """

    def __init__(
        self,
        tracker: DelayedTracker,
        start: Tracking,
        transfer: sp.csr_array,
        cameras: Mapping[str, Pinhole],
        label: int,
        timing: TrackerTiming = TrackerTiming(),
    ) -> None:
        super().__init__()
        self._transfer, self._cameras, self._label = transfer, dict(cameras), label
        self._step = tracker.time_step
        self._ticks = round(timing.period / self._step)
        if self._ticks < 1 or abs(self._ticks * self._step - timing.period) > 1e-9:
            raise ValueError(f"period is {timing.period} s, expected a multiple of {self._step} s")
        work = _Work(tracker)
        if timing.waits:
            self._submit: Callable[..., Future[Tracking]] = on_a_thread(work, "garment-tracker")
        else:
            self._submit = WorkerProcess(work).submit
        self._known = self.DeclareAbstractState(Value(_Known()))
        self._estimate = self.DeclareAbstractState(Value(_Estimate(start)))
        self._declare_ports()
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._step, 0.0, self._tick)
        if timing.waits:
            self.DeclarePeriodicUnrestrictedUpdateEvent(timing.period, timing.delay, self._finish)
        else:
            self.DeclarePeriodicUnrestrictedUpdateEvent(_LOOKING_PERIOD, 0.0, self._look)

    def _declare_ports(self) -> None:
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_gripper_position", 3)
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclareVectorInputPort("grippers_open", 1)
        for name, camera in self._cameras.items():
            size = camera.width, camera.height
            self.DeclareAbstractInputPort(f"{name}.depth_image", Value(ImageDepth32F(*size)))
            self.DeclareAbstractInputPort(f"{name}.label_image", Value(ImageLabel16I(*size)))
            self.DeclareVectorInputPort(f"{name}.image_time", 1)
        count = 3 * self._transfer.shape[0]
        held = self.abstract_state_ticket(self._estimate)
        for name, calc in (
            ("garment_position", self._calc_position),
            ("garment_velocity", self._calc_velocity),
        ):
            self.DeclareVectorOutputPort(name, count, calc, {held, self.time_ticket()})
        self.DeclareVectorOutputPort("age", 1, self._calc_age, {held, self.time_ticket()})

    def _known_in(self, context: Context) -> _Known:
        known: _Known = context.get_abstract_state(self._known).get_value()
        return known

    def _estimate_in(self, context: Context) -> _Estimate:
        estimate: _Estimate = context.get_abstract_state(self._estimate).get_value()
        return estimate

    def _tick(self, context: Context, state: State) -> None:
        known, estimate = self._known_in(context), self._estimate_in(context)
        motions = known.motions
        if known.ticks > 0:  # the start is known
            motions = (*motions, self._motion(context))
        is_free = known.pending is None or estimate.of is known.pending
        if known.ticks == 0 or known.ticks % self._ticks or not is_free:
            known = _Known(motions, known.used, known.ticks + 1, known.pending)
        else:
            exposures, used = self._new_exposures(context, known.used)
            pending = self._submit(estimate.tracking, motions, exposures)
            known = _Known((), used, known.ticks + 1, pending)
        state.get_mutable_abstract_state(self._known).set_value(known)

    def _motion(self, context: Context) -> Motion:
        def value(port: str) -> FloatArray:
            return np.array(self.GetInputPort(port).Eval(context))

        grippers = np.stack([value(f"{side}_gripper_position") for side in SIDES])
        joints = value("joint_position").reshape(6, 3)
        return Motion(context.get_time(), grippers, joints, bool(value("grippers_open")[0] > 0.5))

    def _new_exposures(
        self, context: Context, used: Mapping[str, float]
    ) -> tuple[list[Exposure], dict[str, float]]:
        """Returns exposures that have arrived since the last ones, those of one time together."""
        by_time: dict[float, list[View]] = {}
        last = dict(used)
        for name, camera in self._cameras.items():
            time = float(self.GetInputPort(f"{name}.image_time").Eval(context)[0])
            if time < 0.0 or time <= last.get(name, -np.inf):
                continue
            depth = self.GetInputPort(f"{name}.depth_image").Eval(context).data[..., 0]
            labels = self.GetInputPort(f"{name}.label_image").Eval(context).data[..., 0]
            view = View(camera, depth.astype(float), labels.astype(np.int32), self._label)
            by_time.setdefault(time, []).append(view)
            last[name] = time
        return [Exposure(time, tuple(views)) for time, views in by_time.items()], last

    def _finish(self, context: Context, state: State) -> None:
        pending, estimate = self._known_in(context).pending, self._estimate_in(context)
        if pending is None or estimate.of is pending:
            return
        done = _Estimate(pending.result(), pending)
        state.get_mutable_abstract_state(self._estimate).set_value(done)

    def _look(self, context: Context, state: State) -> None:
        pending = self._known_in(context).pending
        if pending is not None and pending.done():
            self._finish(context, state)

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        moment = self._estimate_in(context).tracking.now
        cloth, since = moment.garment.cloth, context.get_time() - moment.motion.time
        output.SetFromVector((self._transfer @ (cloth.x + since * cloth.v)).ravel())

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        cloth = self._estimate_in(context).tracking.now.garment.cloth
        output.SetFromVector((self._transfer @ cloth.v).ravel())

    def _calc_age(self, context: Context, output: BasicVector) -> None:
        corrected = self._estimate_in(context).tracking.corrected
        output.SetFromVector([context.get_time() - corrected])
