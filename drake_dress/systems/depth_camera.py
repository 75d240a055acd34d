"""What a real depth camera and a segmentation tell of a rendered scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.immutable import Immutable
from drake_dress.models.perception.camera_errors import CameraErrors
from drake_dress.models.perception.segmentation_errors import segmented
from drake_dress.models.perception.stereo_errors import measured_depth

_NEVER = -1.0  # s; time of the exposure before the first one has arrived


@dataclass(frozen=True)
class _Exposure(Immutable):
    """Images of one exposure."""

    time: float
    depth: FloatArray
    labels: IntArray


@dataclass(frozen=True)
class _Taken(Immutable):
    """Exposures of which the newest may not have arrived yet, and their number so far."""

    exposures: tuple[_Exposure, ...] = ()
    count: int = 0


class DepthCamera(LeafSystem):
    """Takes images at a fixed rate, with errors, and delivers them late.

    .. pydrake_system::

        name: DepthCamera
        input_ports:
        - true_depth
        - true_labels
        output_ports:
        - depth_image
        - label_image
        - image_time

    true_depth: ImageDepth32F, m. true_labels: ImageLabel16I. depth_image: ImageDepth32F, 0 where
    nothing was measured. label_image: ImageLabel16I, 0 where nothing was found. image_time: (1,)
    time of their exposure, s; below 0 before the first one has arrived.

    Args:
        size: width and height of the images, pixels.
        focal: focal length, pixels.
        period: time between exposures, s.
        errors: errors of the camera and of the segmentation.
        seed: of the errors.
    """

    def __init__(
        self,
        size: tuple[int, int],
        focal: float,
        period: float,
        errors: CameraErrors,
        seed: tuple[int, ...],
    ) -> None:
        super().__init__()
        self._size, self._focal, self._errors, self._seed = size, focal, errors, seed
        self._taken = self.DeclareAbstractState(Value(_Taken()))
        self.DeclareAbstractInputPort("true_depth", Value(ImageDepth32F(*size)))
        self.DeclareAbstractInputPort("true_labels", Value(ImageLabel16I(*size)))
        for name, image, calc in (
            ("depth_image", ImageDepth32F, self._calc_depth),
            ("label_image", ImageLabel16I, self._calc_labels),
        ):
            self.DeclareAbstractOutputPort(
                name, lambda image=image: Value(image(*size)), calc, self._depends()
            )
        self.DeclareVectorOutputPort("image_time", 1, self._calc_time, self._depends())
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._expose)

    def _depends(self) -> set[Any]:
        return {self.abstract_state_ticket(self._taken), self.time_ticket()}

    def _taken_in(self, context: Context) -> _Taken:
        taken: _Taken = context.get_abstract_state(self._taken).get_value()
        return taken

    def _expose(self, context: Context, state: State) -> None:
        taken, now = self._taken_in(context), context.get_time()
        depth = self.GetInputPort("true_depth").Eval(context).data[..., 0].astype(float)
        labels = self.GetInputPort("true_labels").Eval(context).data[..., 0].astype(np.int32)
        rng = np.random.default_rng([*self._seed, taken.count])
        new = _Exposure(
            now,
            measured_depth(depth, self._focal, self._errors.stereo, rng),
            segmented(labels, self._errors.segmentation, rng),
        )
        waiting = [e for e in taken.exposures if not self._has_arrived(e, now)]
        arrived = [e for e in taken.exposures if self._has_arrived(e, now)][-1:]
        made = _Taken((*arrived, *waiting, new), taken.count + 1)
        state.get_mutable_abstract_state(self._taken).set_value(made)

    def _has_arrived(self, exposure: _Exposure, now: float) -> bool:
        return exposure.time + self._errors.latency <= now + 1e-9

    def _newest(self, context: Context) -> _Exposure | None:
        now, found = context.get_time(), None
        for exposure in self._taken_in(context).exposures:
            if self._has_arrived(exposure, now):
                found = exposure
        return found

    def _calc_depth(self, context: Context, output: Any) -> None:
        newest, image = self._newest(context), output.get_mutable_value()
        image.mutable_data[..., 0] = 0.0 if newest is None else newest.depth

    def _calc_labels(self, context: Context, output: Any) -> None:
        newest, image = self._newest(context), output.get_mutable_value()
        image.mutable_data[..., 0] = 0 if newest is None else newest.labels

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        newest = self._newest(context)
        output.SetFromVector([_NEVER if newest is None else newest.time])
