"""Gauss-Seidel passes of inelastic impulses that keep a plane between the two parts of each pair.

If a fixed plane separates two convex parts at the start and at the end of a linear motion, it
separates them all along. So a pair is safe once a direction n is known along which its separation
is positive at both ends; no cubic equation is solved. Three directions are tried: those between the
closest points at the start, at the end and half-way. The first stops head-on motion, the others let
a node slide past a border beside it. If all fail, the direction with the least correction is kept,
and an impulse along it reduces the relative displacement of the closest points (Bridson, Fedkiw and
Anderson 2002, without repulsion) until the layers keep their thickness.

Impulses are accumulated, so that one which others have made needless is taken back: the passes are
projected Gauss-Seidel iterations for the least mass-weighted correction. Its solution adds no
energy, because zero relative motion satisfies every constraint. The first passes take impulses
back, the last only add, which converges soon. A plain impulse moves corners that are still too
close to the plane.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.cloth.layers.closest import closest, offset, separation

# State of a pair.
SAFE = 0
THIN = 1
CROSSING = 2
IMMOVABLE = 3
# Share of the thickness that corners keep from the plane; a pair is safe with half of it.
_CORNER = 0.2
# Tolerance of the passes, as a share of the thickness.
_TOLERANCE = 0.02
# Excess that makes an impulse needless, so that it is taken back, as a share of the thickness.
_NEEDLESS = 0.1
_MOST_CORNERS = 4
# Largest displacement of a node, relative to what a pair lacks. If prescribed nodes leave only one
# with a small weight, or one barred from nearly that direction, it would be thrown (34 m/s for a
# coat on the floor); other pairs hold it better.
MOST_LEVER = 4.0


@nb.njit(cache=True, nogil=True)
def run_passes(  # type: ignore[no-untyped-def]
    x,
    pair,
    kind,
    start_weights,
    start_direction,
    distance,
    inverse_mass,
    barred,
    thickness,
    most_passes,
    take_back,
    clock,
    evaluated,
    changed,
    active,
    total,
    wanted,
    plane_weights,
    plane_direction,
    dx,
    state,
    applied_node,
    applied_weights,
    applied_direction,
    applied_scale,
    applied_slot,
    applied_release,
):
    """Corrects `dx` (n,3), m, in place; with `most_passes` 0 it only classifies the pairs.

    `pair` to `distance` are the fields of `Pairs`. `inverse_mass` (n,) is in 1/kg, 0 for nodes that
    may not be moved. `barred` (n,3) holds unit directions along which a node may not be moved, or
    zeros. `take_back` says whether needless impulses are taken back.

    Kept between calls: `clock` counts impulses, `evaluated` (P,) and `changed` (n,) hold its value
    when a pair was last evaluated and a node last moved. `active` (P,) says whether a pair has a
    plane, `total` (P,) is its accumulated impulse, kg m, `wanted` (P,) the separation that it
    keeps, m, `plane_weights` (P,4) and `plane_direction` (P,3) the plane.

    Results are `state` (P,) and the impulses in order, `applied_…` (K,…); a slot is the index of a
    pair, -1 for a corner.

    Returns:
        number of impulses written, clock, and whether another pass is due.
    """
    a = np.empty((4, 3))
    b = np.empty((4, 3))
    local = np.arange(4)
    best = np.empty(4)
    spare = np.empty(4)
    middle = np.empty((4, 3))
    written = 0
    room = applied_scale.shape[0]
    passes = 0
    judge_only = most_passes == 0
    due = True
    while due and (passes < most_passes or judge_only):
        due = False
        passes += 1
        for p in range(pair.shape[0]):
            latest = -1
            for m in range(4):
                latest = max(latest, changed[pair[p, m]])
            if latest <= evaluated[p]:
                continue
            if written + 2 + _MOST_CORNERS > room and not judge_only:
                return written, clock, True
            evaluated[p] = clock
            for m in range(4):
                node = pair[p, m]
                for k in range(3):
                    a[m, k] = x[node, k]
                    b[m, k] = x[node, k] + dx[node, k]
            # the plane in use, or the one with the least correction
            if active[p]:
                n0, n1, n2 = (
                    plane_direction[p, 0],
                    plane_direction[p, 1],
                    plane_direction[p, 2],
                )
                for m in range(4):
                    best[m] = plane_weights[p, m]
                keep = wanted[p]
            else:
                after, _, _ = separation(
                    b,
                    kind[p],
                    local,
                    start_direction[p, 0],
                    start_direction[p, 1],
                    start_direction[p, 2],
                )
                if after >= min(thickness, distance[p]):
                    state[p] = SAFE
                    continue
                n0, n1, n2 = _least_plane(
                    a,
                    b,
                    middle,
                    kind[p],
                    local,
                    thickness,
                    start_weights[p],
                    start_direction[p],
                    distance[p],
                    spare,
                    best,
                )
                f0, f1, f2 = offset(a, local, best)
                keep = min(thickness, n0 * f0 + n1 * f1 + n2 * f2)
            g0, g1, g2 = offset(b, local, best)
            lack = keep - (n0 * g0 + n1 * g1 + n2 * g2)
            before, _, _ = separation(a, kind[p], local, n0, n1, n2)
            after, upper, under = separation(b, kind[p], local, n0, n1, n2)
            plane = _CORNER * min(thickness, before)
            if judge_only:
                state[p] = SAFE
                if lack > _TOLERANCE * keep:
                    state[p] = THIN
                if after < 0.5 * plane:
                    state[p] = IMMOVABLE if _fixed(pair[p], inverse_mass) else CROSSING
                continue
            state[p] = SAFE
            if lack > _TOLERANCE * keep or (take_back and active[p] and lack < -_NEEDLESS * keep):
                mobility = _mobility(pair[p], best, inverse_mass, barred, n0, n1, n2)
                if mobility == 0.0:
                    state[p] = THIN
                else:
                    impulse = lack / mobility
                    release = total[p] + impulse <= 0.0
                    if release:
                        impulse = -total[p]
                    if not active[p]:
                        active[p] = True
                        wanted[p] = keep
                        for m in range(4):
                            plane_weights[p, m] = best[m]
                        plane_direction[p, 0] = n0
                        plane_direction[p, 1] = n1
                        plane_direction[p, 2] = n2
                    total[p] += impulse
                    if release:
                        total[p] = 0.0
                        active[p] = False
                    clock += 1
                    due = True
                    state[p] = THIN
                    _push(
                        pair[p], best, inverse_mass, barred, n0, n1, n2, impulse, clock, changed, dx
                    )
                    for m in range(4):
                        applied_node[written, m] = pair[p, m]
                        applied_weights[written, m] = best[m]
                    applied_direction[written, 0] = n0
                    applied_direction[written, 1] = n1
                    applied_direction[written, 2] = n2
                    applied_scale[written] = 1.0 / mobility
                    applied_slot[written] = p
                    applied_release[written] = release
                    written += 1
            for _ in range(_MOST_CORNERS):
                for m in range(4):
                    for k in range(3):
                        b[m, k] = x[pair[p, m], k] + dx[pair[p, m], k]
                after, upper, under = separation(b, kind[p], local, n0, n1, n2)
                if after >= 0.5 * plane:
                    break
                state[p] = CROSSING
                spare[:] = 0.0
                spare[upper] = 1.0
                spare[under] = -1.0
                mobility = _mobility(pair[p], spare, inverse_mass, barred, n0, n1, n2)
                if mobility == 0.0:
                    if _fixed(pair[p], inverse_mass):
                        state[p] = IMMOVABLE
                    break
                clock += 1
                due = True
                _push(
                    pair[p],
                    spare,
                    inverse_mass,
                    barred,
                    n0,
                    n1,
                    n2,
                    (plane - after) / mobility,
                    clock,
                    changed,
                    dx,
                )
                for m in range(4):
                    applied_node[written, m] = pair[p, m]
                    applied_weights[written, m] = spare[m]
                applied_direction[written, 0] = n0
                applied_direction[written, 1] = n1
                applied_direction[written, 2] = n2
                applied_scale[written] = 1.0 / mobility
                applied_slot[written] = -1
                applied_release[written] = False
                written += 1
        if judge_only:
            break
    return written, clock, due


@nb.njit(cache=True, nogil=True)
def transpose_impulses(  # type: ignore[no-untyped-def]
    node, weights, direction, scale, slot, release, inverse_mass, barred, total_bar, bar
):
    """Runs the transposed impulses on `bar` (n,3) in place, last first.

    `total_bar` (slots,) is the derivative by the accumulated impulses, initially zero.
    """
    for k in range(scale.shape[0] - 1, -1, -1):
        n0, n1, n2 = direction[k, 0], direction[k, 1], direction[k, 2]
        along = 0.0
        for m in range(4):
            i = node[k, m]
            across = barred[i, 0] * n0 + barred[i, 1] * n1 + barred[i, 2] * n2
            along += (
                weights[k, m]
                * inverse_mass[i]
                * (
                    (n0 - across * barred[i, 0]) * bar[i, 0]
                    + (n1 - across * barred[i, 1]) * bar[i, 1]
                    + (n2 - across * barred[i, 2]) * bar[i, 2]
                )
            )
        if release[k]:
            total_bar[slot[k]] = -along
            continue
        if slot[k] >= 0:
            along += total_bar[slot[k]]
        along *= scale[k]
        for m in range(4):
            i = node[k, m]
            bar[i, 0] -= along * weights[k, m] * n0
            bar[i, 1] -= along * weights[k, m] * n1
            bar[i, 2] -= along * weights[k, m] * n2


@nb.njit(cache=True, nogil=True)
def _least_plane(  # type: ignore[no-untyped-def]
    a, b, middle, kind, local, thickness, weights, direction, distance, c, best
):
    """Returns the direction with the least correction; writes its weights to `best`."""
    n0, n1, n2 = direction[0], direction[1], direction[2]
    for m in range(4):
        best[m] = weights[m]
    after, _, _ = separation(b, kind, local, n0, n1, n2)
    g0, g1, g2 = offset(b, local, best)
    lack = min(thickness, distance) - (n0 * g0 + n1 * g1 + n2 * g2)
    lack = max(lack, _CORNER * min(thickness, distance) - after)
    for other in range(2):
        for m in range(4):
            for k in range(3):
                middle[m, k] = b[m, k] if other == 0 else 0.5 * (a[m, k] + b[m, k])
        closest(middle, kind, local, c)
        g0, g1, g2 = offset(middle, local, c)
        size = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
        if size == 0.0:
            continue
        g0, g1, g2 = g0 / size, g1 / size, g2 / size
        gap, _, _ = separation(a, kind, local, g0, g1, g2)
        if gap <= 0.0:
            continue
        end, _, _ = separation(b, kind, local, g0, g1, g2)
        f0, f1, f2 = offset(a, local, c)
        e0, e1, e2 = offset(b, local, c)
        keep = min(thickness, g0 * f0 + g1 * f1 + g2 * f2)
        asked = keep - (g0 * e0 + g1 * e1 + g2 * e2)
        asked = max(asked, _CORNER * min(thickness, gap) - end)
        if asked < lack:
            lack = asked
            n0, n1, n2 = g0, g1, g2
            for m in range(4):
                best[m] = c[m]
    return n0, n1, n2


@nb.njit(cache=True, nogil=True)
def _push(  # type: ignore[no-untyped-def]
    nodes, weights, inverse_mass, barred, n0, n1, n2, impulse, clock, changed, dx
):
    """Moves the nodes of a pair by an impulse, kg m."""
    for m in range(4):
        node = nodes[m]
        push = inverse_mass[node] * weights[m] * impulse
        if push == 0.0:
            continue
        across = barred[node, 0] * n0 + barred[node, 1] * n1 + barred[node, 2] * n2
        dx[node, 0] += push * (n0 - across * barred[node, 0])
        dx[node, 1] += push * (n1 - across * barred[node, 1])
        dx[node, 2] += push * (n2 - across * barred[node, 2])
        changed[node] = clock


@nb.njit(cache=True, nogil=True)
def _mobility(nodes, weights, inverse_mass, barred, n0, n1, n2):  # type: ignore[no-untyped-def]
    """Returns Σ c² n·W n, 1/kg, W the inverse mass normal to `barred`; 0 if it is too little."""
    total = 0.0
    furthest = 0.0
    for m in range(4):
        node = nodes[m]
        across = barred[node, 0] * n0 + barred[node, 1] * n1 + barred[node, 2] * n2
        reach = abs(weights[m]) * inverse_mass[node]
        total += reach * abs(weights[m]) * max(0.0, 1.0 - across * across)
        furthest = max(furthest, reach)
    return total if furthest <= MOST_LEVER * total else 0.0


@nb.njit(cache=True, nogil=True)
def _fixed(nodes, inverse_mass):  # type: ignore[no-untyped-def]
    for m in range(4):
        if inverse_mass[nodes[m]] > 0.0:
            return False
    return True
