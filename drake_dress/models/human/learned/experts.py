"""Combines several predictions by how each did on this person so far.

A network knows the persons that it was trained on; the one who is there may move otherwise. What
was predicted some steps ago can be compared with what came. The combination whose error would have
been least follows from the products of the experts' errors (Bates and Granger, "The combination of
forecasts", Operational Research Quarterly 20, 1969), here with weights that are shares. It is
fitted to little data, so the weights go only part of the way to it, the further the more it would
have gained (as the estimator of James and Stein shrinks). The same comparison keeps the regions
honest: their size is adapted so that they hold as many joints as they should (adaptive conformal
inference, Gibbs and Candès 2021).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.network import COVERED
from drake_dress.models.immutable import Immutable

# Horizons that have weights of their own: rows up to these.
GROUPS = (5, 10, 20)
# Mean squared error below which nobody needs a better expert, m².
_EXACT = 1e-10
# Weight of the shares' sum, and least square of an error, beside the mean of all experts'.
_HEAVY, _SMALL = 1e3, 1e-3


@dataclass(frozen=True)
class ExpertSettings:
    """How quickly the weights follow.

    Attributes:
        discount: factor on past errors per forecast.
        caution: comparisons before the weights move towards the best combination, if that would
            have halved the squared error; if it would have gained less, the more.
        pull: weight of `trust` beside the squared error of the best expert, where experts are
            alike.
        trust: weight of experts before anything was compared; those of weight 0 are never used.
        adapting: rate of the regions' size per compared forecast.
        smallest, largest: limits of the factor on the regions' size.
    """

    discount: float = 0.99
    caution: float = 4.0
    pull: float = 0.02
    trust: tuple[float, ...] = (0.02, 0.03, 0.02, 0.02, 0.05, 0.86)
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
    """Forecasts that have not been compared in full, and the errors so far.

    Attributes:
        past: newest last.
        products: (2,G,E,E) discounted sums of products of two experts' errors, by arm and group of
            horizons, m²; all 0 before anything was compared.
        count: (2,G) discounted number of comparisons.
        size: (2,) factor on the radii of each arm.
    """

    past: tuple[_Past, ...] = ()
    products: FloatArray = field(default_factory=lambda: np.zeros((2, len(GROUPS), 1, 1)))
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
        return ExpertMemory((*kept, new), self.products, self.count, self.size)

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
        rows, errors, inside = [], [], []
        for past in self.past:
            row = round((time - past.time) / step)
            if not 1 <= row < past.positions.shape[1] or abs(past.time + row * step - time) > 1e-3:
                continue
            rows.append(row)
            errors.append(past.positions[:, row] - joints)
            away = np.linalg.norm(past.mean[row] - joints, axis=1)
            inside.append(away <= past.radius[row])
        if not rows or not seen.any():
            return self
        experts = len(errors[0])
        products = np.zeros((2, len(GROUPS), experts, experts)) + settings.discount * self.products
        count, size = settings.discount * self.count, self.size.copy()
        group = np.searchsorted(GROUPS, rows)
        for arm in (0, 1):
            mine = np.flatnonzero(seen[3 * arm : 3 * arm + 3]) + 3 * arm
            if not len(mine):
                continue
            for g in range(len(GROUPS)):
                which = np.flatnonzero(group == g)
                if len(which):
                    off = np.stack([errors[k][:, mine] for k in which], axis=1)
                    flat = off.reshape(experts, -1)
                    products[arm, g] += flat @ flat.T / (len(which) * len(mine))
                    count[arm, g] += 1.0
            held = float(np.mean([inside[k][mine] for k in range(len(rows))]))
            size[arm] *= np.exp(settings.adapting * (COVERED - held))
        size = np.clip(size, settings.smallest, settings.largest)
        return ExpertMemory(self.past, products, count, size)

    def weights(self, settings: ExpertSettings, allowed: FloatArray, rows: int) -> FloatArray:
        """Returns the weights (E,rows,6) of the experts, which sum to 1.

        Args:
            settings: how they follow the errors.
            allowed: (E,) 1 for experts that may be used, else 0.
            rows: number of rows of a forecast, F + 1.
        """
        trust = np.array(settings.trust) * allowed
        trust = trust / trust.sum()
        used = np.flatnonzero(trust)
        group = np.minimum(np.searchsorted(GROUPS, np.arange(rows)), len(GROUPS) - 1)
        found = np.zeros((len(trust), rows, 6))
        for arm in (0, 1):
            by_group = np.tile(trust, (len(GROUPS), 1))
            for g, count in enumerate(self.count[arm]):
                if count > 0.0:
                    products = self.products[arm, g][np.ix_(used, used)]
                    by_group[g, used] = _combined(products, count, trust[used], settings)
            found[:, :, 3 * arm : 3 * arm + 3] = by_group[group].T[:, :, None]
        return found


def _combined(
    products: FloatArray, count: float, trust: FloatArray, settings: ExpertSettings
) -> FloatArray:
    """Returns shares (E,) between `trust` and the combination whose error would have been least.

    Args:
        products: (E,E) sums of products of errors, m².
        count: of comparisons.
        trust: (E,) shares before anything was compared.
        settings: how far to go.
    """
    size = float(np.trace(products)) / len(trust)
    if size < _EXACT * count:
        return trust
    # least w'(P + pull)w - 2 pull trust'w over shares, as a least-squares problem
    pull = settings.pull * max(float(np.diag(products).min()), _SMALL * size)
    lower = np.linalg.cholesky(products + pull * np.eye(len(trust)))
    wanted = np.linalg.solve(lower, pull * trust)
    heavy = _HEAVY * np.sqrt(size)
    rows = np.concatenate([lower.T, np.full((1, len(trust)), heavy)])
    best, _ = nnls(rows, np.append(wanted, heavy))
    best = best / best.sum()
    least = max(float(best @ products @ best), _EXACT * count)
    gain = float(trust @ products @ trust) / least - 1.0
    way = max(0.0, 1.0 - (settings.caution / max(count * gain, 1e-9)) ** 2)
    combined: FloatArray = trust + way * (best - trust)
    return combined
