"""Contacts that stop cloth at a body's surface instead of behind it.

MuJoCo lets a contact act once two surfaces overlap, and then pushes them apart within a few steps.
Cloth that approaches at 0.5 m/s is 5 mm inside by then. Contacts are therefore found `REACH` ahead,
and the normal velocity at the end of the step is to be v⁺ = −d / h for the remaining distance d, so
that nothing acts on cloth that will not arrive. Of a depth, d < 0, a step takes back the share
`OUTWARD`. MuJoCo's flag `speculative` foresees contacts of rigid bodies in this way, and leaves out
flexes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

# Distance at which contacts are found, m: that of cloth that approaches at 1 m/s in 10 ms.
REACH = 0.01
# Share of the depth that a step takes back.
OUTWARD = 0.3
# Impedance of contacts, the same at all depths. With 0.95, a tight sleeve sinks in by 1 mm.
_IMPEDANCE = 0.98
# Time constant of contacts in steps. MuJoCo replaces springs of less than one step by its own.
_STEPS = 2.0


def contact_parameters(h: float) -> str:
    """Returns the attributes of a flex whose contacts are those of `stop_at_the_surface`.

    The flex has priority over the geoms that it touches, so that the parameters are not averaged.

    Args:
        h: time step, s.
    """
    return (
        f'priority="1" margin="{REACH}" solref="{_STEPS * h:.12g} 1" '
        f'solimp="{_IMPEDANCE} {_IMPEDANCE} 0.001"'
    )


def stop_at_the_surface(data: Any, h: float) -> None:
    """Sets the position residuals of contacts with bodies, from which the solver's aim follows.

    With residual r, stiffness k (times the impedance) and damping b of a row, the discrete
    integrator aims at the acceleration a, a (1 + h b + h² k) = −b v − k (r + h v). That is solved
    for r.

    Args:
        data: MjData between `mj_step1` and `mj_step2`.
        h: time step, s.
    """
    contact = data.contact
    if not data.ncon:
        return
    of_body = (contact.geom[:, 0] >= 0) & (contact.efc_address >= 0)
    row, distance = contact.efc_address[of_body], contact.dist[of_body]
    v = data.efc_vel[row]
    hk, b = h / (_IMPEDANCE * (_STEPS * h) ** 2), 2.0 / (_IMPEDANCE * _STEPS * h)
    outward = np.where(distance < 0.0, OUTWARD, 1.0)
    aim = (-outward * distance / h - v) / h
    residual = -h * ((aim * (1.0 + h * b + h * hk) + b * v) / hk + v)
    data.efc_pos[row] = data.efc_margin[row] + residual
