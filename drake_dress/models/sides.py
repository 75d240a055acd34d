"""The person's two sides, which name sleeves, arms and grippers; index 0 is the left."""

from __future__ import annotations

from typing import Literal

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
