"""NumPy, torch and Warp arrays in and out, without a copy where memory can be shared.

Vectors are (B,n) arrays of `wp.vec3d` inside the package: the same memory as (B,n,3) float64.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import warp as wp

Kind = Literal["numpy", "torch", "warp"]
# A Warp array where its rank and element are told in words: Warp's own types for the fields of
# structs, `array2d[vec3d]`, and for arrays made at run time do not agree.
DeviceArray = Any


def kind_of(value: Any) -> Kind:
    """Returns which library `value` belongs to; what is no array counts as NumPy's."""
    if isinstance(value, wp.array):
        return "warp"
    # A tensor can only be met where torch is imported already: do not import it for NumPy users.
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(value, torch.Tensor):
        return "torch"
    return "numpy"


def vectors_in(value: Any, name: str, batch: int, count: int, device: wp.Device) -> wp.array:
    """Returns (batch,count) `wp.vec3d` on `device` of a (batch,count,3) float64 array.

    A Warp array or torch tensor on the device is shared, NumPy arrays are copied.

    Args:
        value: NumPy (batch,count,3), torch float64 (batch,count,3) or Warp, vec3d (batch,count).
        name: of the argument, for errors.
        batch: B.
        count: nodes of each garment.
        device: where the array has to be; torch tensors and Warp arrays must be there already.

    Raises:
        ValueError: wrong shape, type or device.
    """
    kind = kind_of(value)
    if kind == "warp":
        _check_shape(name, tuple(value.shape), (batch, count))
        if value.dtype is not wp.vec3d:
            raise ValueError(f"{name} holds {value.dtype.__name__}, expected vec3d")
        _check_device(name, value.device, device)
        if not value.is_contiguous:
            value = value.contiguous()
        return value
    _check_shape(name, tuple(np.shape(value)), (batch, count, 3))
    if kind == "torch":
        return _from_torch(value, name, device, wp.vec3d)
    host = np.array(value, dtype=np.float64, order="C")
    return wp.array(host, dtype=wp.vec3d, shape=(batch, count), device=device)


def scalars_in(value: Any, name: str, batch: int, device: wp.Device) -> wp.array:
    """Returns (batch,) float64 on `device` of a NumPy, torch or Warp array or one number.

    Raises:
        ValueError: wrong shape, type or device.
    """
    kind = kind_of(value)
    if kind == "numpy":
        host = np.array(np.broadcast_to(np.asarray(value, dtype=np.float64), (batch,)))
        return wp.array(host, dtype=wp.float64, device=device)
    _check_shape(name, tuple(value.shape), (batch,))
    if kind == "torch":
        return _from_torch(value, name, device, wp.float64)
    if value.dtype is not wp.float64:
        raise ValueError(f"{name} holds {value.dtype.__name__}, expected float64")
    _check_device(name, value.device, device)
    return value


@dataclass(frozen=True)
class SharedTensors:
    """Torch tensors whose memory a tape shares, with the versions that they had then.

    Attributes:
        tensors: names and tensors. versions: of each, which torch counts up at every write in
            place. Writes through other views of the memory, as NumPy's, are not counted.
    """

    tensors: tuple[tuple[str, Any], ...]
    versions: tuple[int, ...]

    @classmethod
    def of(cls, **arrays: Any) -> SharedTensors:
        """Returns those of `arrays` that are tensors with a version."""
        tensors = tuple(
            (name, value)
            for name, value in arrays.items()
            if kind_of(value) == "torch" and not value.is_inference()
        )
        return cls(tensors, tuple(tensor._version for _, tensor in tensors))

    def check(self) -> None:
        """Raises RuntimeError if one of them was written to since."""
        for (name, tensor), version in zip(self.tensors, self.versions, strict=True):
            if tensor._version != version:
                raise RuntimeError(
                    f"{name} was modified by an inplace operation between the step and its "
                    "derivative, which shares its memory: give the step a clone"
                )


def array_out(array: wp.array, kind: Kind) -> Any:
    """Returns `array` as `kind`: NumPy copies from a CUDA device, torch shares the memory."""
    if kind == "numpy":
        return array.numpy()
    if kind == "torch":
        return wp.to_torch(array, requires_grad=False)
    return array


def _from_torch(tensor: Any, name: str, device: wp.Device, dtype: Any) -> DeviceArray:
    import torch

    if tensor.dtype is not torch.float64:
        raise ValueError(f"{name} is {tensor.dtype}, expected torch.float64")
    _check_device(name, wp.device_from_torch(tensor.device), device)
    return wp.from_torch(tensor.detach().contiguous(), dtype=dtype, requires_grad=False)


def _check_shape(name: str, shape: tuple[int, ...], expected: tuple[int, ...]) -> None:
    if shape != expected:
        raise ValueError(f"{name} has shape {shape}, expected {expected}")


def _check_device(name: str, device: wp.Device, expected: wp.Device) -> None:
    if device != expected:
        raise ValueError(f"{name} is on {device}, expected {expected}")
