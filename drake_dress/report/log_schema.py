"""Names and shapes of the datasets in a run's log."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.sides import SIDES

SCHEMA = "drake_dress.log/1"
# Attribute: whether the writer closed the file; if missing, this is not known.
COMPLETE = "complete"
LOOPS = ("left_armhole", "left_cuff", "right_armhole", "right_cuff")
JOINT_NAMES = (
    "left_shoulder",
    "left_elbow",
    "left_hand",
    "right_shoulder",
    "right_elbow",
    "right_hand",
)
CLEARANCES = ("between arms", "left arm to person", "right arm to person")
ARM_SERIES = (
    ("q", "rad"),
    ("v", "rad/s"),
    ("q_commanded", "rad"),
    ("torque", "N m"),
    ("q_least", "rad"),
    ("q_most", "rad"),
    ("v_peak", "rad/s"),
    ("torque_peak", "N m"),
)
STAGE_NAMES = ("prepare", "dress", "done", "lay", "released")
# How far ahead of a sample the logged forecast of the person is, s.
FORECAST_AHEAD = 1.0
INTENT_NAMES = (
    "passive: the arm rests, is held, or follows the garment",
    "active: it moves by the person's own will: it reaches, withdraws, returns, waves, "
    "or the body turns",
)

# Name to shape (None: any length); a first axis "T" has one row per sample.
_REQUIRED: dict[str, tuple[Any, ...]] = {
    "/time": ("T",),
    "/garment/faces": (None, 3),
    "/garment/rest_position": ("n", 3),
    "/garment/position": ("T", "n", 3),
    **{f"/garment/loops/{name}": (None,) for name in LOOPS},
    "/human/joint_position": ("T", 6, 3),
    "/human/radius": (6,),
    **{f"/gripper/{side}/{name}": ("T", 3) for side in SIDES for name in ("position", "force")},
    **{f"/dressing/{side}/{name}": ("T",) for side in SIDES for name in ("s", "l", "theta")},
    "/control/stage": ("T", 2),
}
_OPTIONAL: dict[str, tuple[Any, ...]] = {
    "/garment/contact": ("T", "n"),
    "/garment/contact_force": ("T", "n", 3),
    "/human/capsule_a": ("T", "c", 3),
    "/human/capsule_b": ("T", "c", 3),
    "/human/capsule_radius": ("c",),
    "/human/capsule_end_radius": ("c",),
    "/human/capsule_of_chair": ("c",),
    "/human/intent": ("T", 2),
    "/forecast/human/joint_position": ("T", 6, 3),
    "/forecast/human/radius": ("T", 6),
    "/forecast/human/intent": ("T", 2),
    "/forecast/human/is_linear": ("T",),
    "/control/safety": ("T", 2),
    "/control/global/solve_time": ("T",),
    "/control/local/solve_time": ("T",),
    "/control/global/solves": ("T",),
    "/control/local/solves": ("T",),
}


def check_log(source: str, file: h5py.File) -> None:
    """Checks an open log against the schema.

    Raises:
        UserError: The schema is another one, or a dataset is missing or has the wrong shape.
    """
    schema = file.attrs.get("schema")
    if schema != SCHEMA:
        raise UserError(source, "schema", f"is {schema!r}; expected {SCHEMA!r}")
    sizes: dict[str, int] = {}
    for name, expected in (_REQUIRED | _OPTIONAL).items():
        if not isinstance(file.get(name), h5py.Dataset):
            if name in _REQUIRED:
                raise UserError(source, name, "dataset is missing")
            continue
        shape = file[name].shape
        wanted = tuple(
            sizes.setdefault(e, shape[i]) if isinstance(e, str) and i < len(shape) else e
            for i, e in enumerate(expected)
        )
        fits = len(shape) == len(wanted) and all(
            w is None or w == s for w, s in zip(wanted, shape, strict=True)
        )
        if not fits:
            text = ", ".join("any" if w is None else str(w) for w in wanted)
            raise UserError(source, name, f"has shape {shape}; expected ({text})")
    n = sizes["n"]
    for name in ("/garment/faces", *(f"/garment/loops/{loop}" for loop in LOOPS)):
        index = np.asarray(file[name])
        if index.dtype.kind not in "iu" or (index.size and not 0 <= index.min() <= index.max() < n):
            raise UserError(source, name, f"must hold node indices from 0 to {n - 1}")
    time = np.asarray(file["/time"])
    if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise UserError(source, "/time", "must be finite and strictly increasing")
