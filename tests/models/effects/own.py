"""An effect as a user writes one, in a module that other processes can import."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import Effect, MassEffect, Sheet, parameter
from drake_dress.models.effects.registry import EFFECTS, register_effect, unregister_effect


@dataclass(frozen=True)
class HemChain(MassEffect):
    """A chain in the hem: its mass is spread by the weight exp(−d / height) over nodes d higher up.

    Args:
        mass: kg.
        height: m.
    """

    NAME = "hem_chain"
    IN_WORDS = "a chain in the hem"
    mass: float = parameter("kg", 0.0, 1.0, 0.05)
    height: float = parameter("m", 0.01, 0.5, 0.05, shape=0.05)

    def apply(self, sheet: Sheet) -> FloatArray:
        """Returns (n,) kg."""
        return self.mass * self._share(sheet)

    def derivative(self, name: str, sheet: Sheet) -> FloatArray:
        """Returns (n,)."""
        share = self._share(sheet)
        if name == "mass":
            return share
        slope = (sheet.rest_position[:, 2] - sheet.rest_position[:, 2].min()) / self.height**2
        changed: FloatArray = self.mass * share * (slope - share @ slope)
        return changed

    def _share(self, sheet: Sheet) -> FloatArray:
        z = sheet.rest_position[:, 2]
        weight = sheet.elements.node_area * np.exp(-(z - z.min()) / self.height)
        share: FloatArray = weight / weight.sum()
        return share


@contextmanager
def registered(kind: type[Effect] = HemChain) -> Iterator[None]:
    """Has an effect registered meanwhile."""
    register_effect(kind)
    try:
        yield
    finally:
        if kind.NAME in EFFECTS:
            unregister_effect(kind.NAME)
