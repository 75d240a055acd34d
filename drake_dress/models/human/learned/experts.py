"""Weighs several predictions by how each did on this person so far.

A network knows the persons that it was trained on; the one who is there may move otherwise. What
was predicted some steps ago can be compared with what came: the weights of the experts follow from
their losses, discounted over time, as exponential weights (Cesa-Bianchi and Lugosi, "Prediction,
Learning, and Games", 2006). The same comparison keeps the regions honest: their size is adapted so
that they hold as many joints as they should (adaptive conformal inference, Gibbs and Candès 2021).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.network import COVERED
from drake_dress.models.immutable import Immutable

# Horizons that have weights of their own: rows up to these.
GROUPS = (5, 10, 20)


@dataclass(frozen=True)
class ExpertSettings:
    """How quickly the weights follow.

    Attributes:
        discount: factor on past losses per forecast.
        sharpness: weight of a loss's excess over the best expert's, in units of the mean loss.
        trust: weight of experts before anything was compared.
        adapting: rate of the regions' size per compared forecast.
        smallest, largest: limits of the factor on the regions' size.
    """

    discount: float = 0.99
    sharpness: float = 0.25
    trust: tuple[float, ...] = (0.02, 0.03, 0.05, 0.9)
    adapting: float = 0.03
    smallest: float = 0.4
    largest: float = 6.0


@dataclass(frozen=True)
class _Past:
    """One forecast: its time, s, positions (E,F+1,6,3) of E experts, the mean and its radii, m."""

    time: float
    positions: FloatArray
    mean: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class ExpertMemory(Immutable):
    """Forecasts that have not been compared in full, and the losses so far.

    Attributes:
        past: newest last.
        loss: (E,2,G) discounted loss of each expert, arm and group of horizons, m.
        count: (2,G) discounted number of comparisons.
        size: (2,) factor on the radii of each arm.
    """

    past: tuple[_Past, ...] = ()
    loss: FloatArray = field(default_factory=lambda: np.zeros((4, 2, len(GROUPS))))
    count: FloatArray = field(default_factory=lambda: np.zeros((2, len(GROUPS))))
    size: FloatArray = field(default_factory=lambda: np.ones(2))

    def remembering(
        self,
        time: float,
        positions: FloatArray,
        mean: FloatArray,
        radius: FloatArray,
        lasting: float,
    ) -> ExpertMemory:
        """Returns the memory with another forecast, without those older than `lasting`, s.

        Args:
            time: of its row 0, s.
            positions: (E,F+1,6,3) of the experts, m.
            mean: (F+1,6,3) of all together, m.
            radius: (F+1,6) of its regions, m.
            lasting: s.
        """
        kept = tuple(p for p in self.past if p.time > time - lasting - 1e-6)
        new = _Past(time, positions, mean, radius)
        return ExpertMemory((*kept, new), self.loss, self.count, self.size)

    def compared(
        self, time: float, joints: FloatArray, step: float, settings: ExpertSettings
    ) -> ExpertMemory:
        """Returns the memory after what was predicted for `time` is compared with what came.

        Args:
            time: s.
            joints: (6,3) observed, m, NaN where not.
            step: time between rows of forecasts, s.
            settings: rates.
        """
        seen = np.all(np.isfinite(joints), axis=1)
        rows, distances, inside = [], [], []
        for past in self.past:
            row = round((time - past.time) / step)
            if not 1 <= row < past.positions.shape[1] or abs(past.time + row * step - time) > 1e-3:
                continue
            off = np.linalg.norm(past.positions[:, row] - joints, axis=2)
            rows.append(row)
            distances.append(off)
            away = np.linalg.norm(past.mean[row] - joints, axis=1)
            inside.append(away <= past.radius[row])
        if not rows or not seen.any():
            return self
        loss, count = settings.discount * self.loss, settings.discount * self.count
        size = self.size.copy()
        group = np.searchsorted(GROUPS, rows)
        for arm in (0, 1):
            mine = np.flatnonzero(seen[3 * arm : 3 * arm + 3]) + 3 * arm
            if not len(mine):
                continue
            for g in range(len(GROUPS)):
                which = np.flatnonzero(group == g)
                if len(which):
                    off = np.stack([distances[k][:, mine] for k in which])
                    loss[:, arm, g] += off.mean(axis=(0, 2))
                    count[arm, g] += 1.0
            held = float(np.mean([inside[k][mine] for k in range(len(rows))]))
            size[arm] *= np.exp(settings.adapting * (COVERED - held))
        size = np.clip(size, settings.smallest, settings.largest)
        return ExpertMemory(self.past, loss, count, size)

    def weights(self, settings: ExpertSettings, allowed: FloatArray, rows: int) -> FloatArray:
        """Returns the weights (E,rows,6) of the experts, which sum to 1.

        Args:
            settings: how sharply they follow the losses.
            allowed: (E,) 1 for experts that may be used, else 0.
            rows: number of rows of a forecast, F + 1.
        """
        prior = np.array(settings.trust)[:, None, None] * allowed[:, None, None]
        mean = self.loss / np.maximum(self.count, 1e-9)
        scale = np.maximum(mean[allowed > 0].min(axis=0), 1e-4)
        excess = (mean - scale) / scale
        weight = prior * np.exp(-settings.sharpness * self.count * np.clip(excess, 0.0, 20.0))
        weight = weight / weight.sum(axis=0)
        group = np.minimum(np.searchsorted(GROUPS, np.arange(rows)), len(GROUPS) - 1)
        by_arm = weight[:, :, group]
        return np.repeat(np.swapaxes(by_arm, 1, 2), 3, axis=2)
