"""One round of the active set of contact with friction, as kernels over the nodes.

`bind` changes positions, before the forces are known; `classify` changes modes, by these forces.
The state of the nodes belongs to `iterated_contact.IteratedContact`; its module has the method.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray

# Share of the tolerance at which gaps and displacements are distinguished from zero.
_SHARP = 0.01
# A slipping node whose displacement falls below the tolerance, or to this share in an iteration, is
# tried as sticking: as slipping it would come to rest only in the limit.
_STOPPING = 0.7
# After this many trials of sticking in a step a node keeps slipping, with finite c; after this many
# landings it lands slipping.
_MOST_FLIPS = 4
# Factor by which each landing in a step widens the bounds between contact and none, up to the
# tolerance. Otherwise a node that hardly touches would come and go for ever.
_WIDENING = 2.0


@nb.njit(cache=True, nogil=True)
def leaps(mode: IntArray, gap: FloatArray, motion: FloatArray, least: float) -> BoolArray:
    """Returns (n,) which free nodes might cross a surface by `motion` (n,3)."""
    out = np.zeros(mode.shape[0], dtype=np.bool_)
    for i in range(mode.shape[0]):
        if mode[i] != 0:
            continue
        size2 = motion[i, 0] ** 2 + motion[i, 1] ** 2 + motion[i, 2] ** 2
        bound = max(least, 0.5 * gap[i])
        out[i] = size2 > bound * bound
    return out


@nb.njit(cache=True, nogil=True)
def due(x: FloatArray, checked: FloatArray, gap: FloatArray, mode: IntArray) -> BoolArray:
    """Returns (n,) which gaps, found at `checked` (n,3), inf for never, may mislead at `x` (n,3).

    A free node needs no check before it may have used up half of its gap.
    """
    out = np.zeros(x.shape[0], dtype=np.bool_)
    for i in range(x.shape[0]):
        if mode[i] == 3 and checked[i, 0] < np.inf:
            continue
        moved2 = 0.0
        for c in range(3):
            moved2 += (x[i, c] - checked[i, c]) ** 2
        far = 0.0
        if mode[i] == 0 and checked[i, 0] < np.inf:
            far = max(0.0, 0.5 * gap[i])
        out[i] = not moved2 <= far * far
    return out


@nb.njit(cache=True, nogil=True)
def _share(landings):  # type: ignore[no-untyped-def]
    return min(1.0, _SHARP * _WIDENING**landings)


@nb.njit(cache=True, nogil=True)
def bind(  # type: ignore[no-untyped-def]
    x,
    carried,
    height,
    gap,
    target,
    slope,
    normal,
    tolerance,
    landing_slip,
    mode,
    stopped,
    fresh,
    base,
    slid,
    landings,
    friction,
):
    """Closes gaps along normals, removes tangential motion of sticking nodes, records w_T.

    Args:
        x: (n,3) positions, changed in place, m.
        carried: (n,3) start of the step, carried with the surfaces, m.
        height: (n,) gap there, m.
        gap: (n,) gap of the iterate, m.
        target: (n,) gap to reach, m.
        slope: (n,) and
        normal: (n,3): the gradient of the gap is slope · normal.
        tolerance: accuracy of positions, m.
        landing_slip: tangential displacement above which a node lands sliding, m.
        mode: (n,) changed in place, as all that follow.
        stopped: (n,) whether the node was stopped at a surface on its path.
        fresh: (n,) whether it has just landed.
        base: (n,3) point from which w is measured, m.
        slid: (n,3) w_T, m.
        landings: (n,) number of landings in this step.
        friction: (n,3) friction, h² N.

    Returns:
        Number of nodes that landed.
    """
    landed = 0
    for i in range(x.shape[0]):
        fresh[i] = False
        m = mode[i]
        leapt = stopped[i]
        stopped[i] = False
        lands = leapt or gap[i] < target[i] - tolerance * _share(landings[i])
        if m == 3 or (m == 0 and not lands):
            continue
        if m == 0:
            # the node touches where its straight path enters the surface
            share = 1.0
            if gap[i] < height[i]:
                share = min(1.0, height[i] / (height[i] - gap[i]))
            for c in range(3):
                base[i, c] = carried[i, c] + share * (x[i, c] - carried[i, c])
            if leapt:
                gap[i] = 0.0
                for c in range(3):
                    x[i, c] = base[i, c]
        along = 0.0
        for c in range(3):
            along += normal[i, c] * (x[i, c] - base[i, c])
        if m == 0:
            size2 = 0.0
            for c in range(3):
                size2 += (x[i, c] - base[i, c] - along * normal[i, c]) ** 2
                friction[i, c] = 0.0
            sliding = size2 > landing_slip * landing_slip or landings[i] >= _MOST_FLIPS
            mode[i] = 2 if sliding else 1
            fresh[i] = True
            landings[i] += 1
            landed += 1
        close = (target[i] - gap[i]) / slope[i]
        for c in range(3):
            w = x[i, c] - base[i, c] - along * normal[i, c]
            if mode[i] == 1:
                x[i, c] -= w
                w = 0.0
            x[i, c] += close * normal[i, c]
            slid[i, c] = w
    return landed


@nb.njit(cache=True, nogil=True)
def classify(  # type: ignore[no-untyped-def]
    residual,
    normal,
    mu,
    adhesion,
    tolerance,
    weight,
    mode,
    fresh,
    slid,
    last_slid,
    flips,
    landings,
    resistance,
    friction,
):
    """Updates modes and friction from the residual (n,3), h² N; see `bind`.

    Args:
        residual: (n,3) residual of the equations of motion without contact, h² N.
        normal: (n,3) normals of the surfaces.
        mu: (n,) Coulomb coefficient.
        adhesion: (n,) tension that a contact bears, h² N.
        tolerance: accuracy of positions, m.
        weight: (n,) tolerance times mass, kg m: a force h² N that moves a node by the tolerance.
        mode: (n,) changed in place, as all that follow.
        fresh: (n,) whether the node has just landed.
        slid: (n,3) w_T, m.
        last_slid: (n,) its size in the last iteration, m.
        flips: (n,) how often sticking was tried in this step.
        landings: (n,) number of landings in this step.
        resistance: (n,) c, h² N/m.
        friction: (n,3) friction, h² N.

    Returns:
        Number of nodes that changed.
    """
    changed = 0
    for i in range(mode.shape[0]):
        m = mode[i]
        resistance[i] = 0.0
        if m == 0 or m == 3:
            continue
        pressure = 0.0
        for c in range(3):
            pressure += residual[i, c] * normal[i, c]
        if fresh[i]:
            # its neighbours have not felt the surface yet
            pressure = max(pressure, 0.0)
            last_slid[i] = 0.0
        if pressure < -adhesion[i] - weight[i] * _share(landings[i]):
            mode[i] = 0
            friction[i] = 0.0
            changed += 1
            continue
        bound = mu[i] * max(pressure + adhesion[i], 0.0)
        if m == 1:
            if fresh[i]:
                continue
            size2 = 0.0
            for c in range(3):
                size2 += (residual[i, c] - pressure * normal[i, c]) ** 2
            size = np.sqrt(size2)
            if size > bound + _SHARP * weight[i]:
                mode[i] = 2
                last_slid[i] = 0.0
                changed += 1
                for c in range(3):
                    friction[i, c] = bound * (residual[i, c] - pressure * normal[i, c]) / size
            continue
        w2 = 0.0
        work = 0.0
        old2 = 0.0
        for c in range(3):
            w2 += slid[i, c] ** 2
            work += slid[i, c] * friction[i, c]
            old2 += friction[i, c] ** 2
        w = np.sqrt(w2)
        if w == 0.0 and old2 > 0.0:
            # it is about to slip: friction has a direction, displacement not yet
            for c in range(3):
                friction[i, c] *= bound / np.sqrt(old2)
            continue
        stopping = work > 0.0 or w < tolerance or w < _STOPPING * last_slid[i]
        last_slid[i] = w
        if stopping and not fresh[i] and flips[i] < _MOST_FLIPS:
            mode[i] = 1
            flips[i] += 1
            friction[i] = 0.0
            changed += 1
            continue
        resistance[i] = bound / max(w, _SHARP * tolerance)
        for c in range(3):
            friction[i, c] = -resistance[i] * slid[i, c]
    return changed
