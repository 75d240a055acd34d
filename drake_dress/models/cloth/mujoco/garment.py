"""The garment as elements of a MuJoCo model.

Three flexes share one set of nodes: the fabric, which is elastic and touches nothing; its surface,
which touches the bodies at `Material.margin`; and its layers, which touch each other at twice that
distance, without friction. The last two leave out triangles with held nodes: between a gripper and
a body, both of which move as prescribed, contact has no finite force. `contact/grasp.py` has what
held cloth does to the person.

Young's modulus and thickness of the Saint Venant-Kirchhoff shell follow from E t = stretch
stiffness and E t³ / 12 = bending stiffness. Poisson's ratio is 0, as in the other schemes.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.bodies import BODY_BIT, CLOTH_BIT, bodies_xml
from drake_dress.models.cloth.mujoco.settings import MujocoSettings
from drake_dress.models.cloth.mujoco.text import numbers

# Thickness of a fabric that does not bend, m.
_THIN = 1e-5
# Time constant and damping ratio of contact. The integrator replaces rows that the time step cannot
# resolve by the stiffest without rebound; with MuJoCo's default garments sink in by centimetres.
_STIFF = 'solref="0.001 1"'
# Upper limit of the memory for contacts, which is used as needed.
_MEMORY = "256M"


def model_xml(
    elements: Elements,
    material: Material,
    held: IntArray,
    time_step: float,
    gravity: FloatArray,
    settings: MujocoSettings,
    body_count: int,
) -> str:
    """Returns the model of a garment and `body_count` capsules.

    Nodes have equal masses here; the caller sets the true ones.
    """
    area = float(elements.triangle_area.sum())
    free = touching_triangles(elements, held)
    return f"""<mujoco>
<option timestep="{time_step:.12g}" integrator="discrete" solver="CG" cone="elliptic"
  iterations="{settings.iterations}" tolerance="{settings.tolerance:.12g}"
  gravity="{numbers(gravity)}"><flag island="disable" autoreset="disable"/></option>
<size memory="{_MEMORY}"/>
<worldbody>
{bodies_xml(body_count, material.friction)}
{_fabric(elements, material, area)}
</worldbody>
<deformable>
{_surfaces(elements.node_count, free, material, settings.self_collision)}
</deformable>
</mujoco>"""


def touching_triangles(elements: Elements, held: IntArray) -> IntArray:
    """Returns (F,3) the triangles that touch bodies: those without held nodes."""
    free: IntArray = elements.triangle[~np.isin(elements.triangle, held).any(axis=1)]
    return free


def _fabric(elements: Elements, material: Material, area: float) -> str:
    """Returns the elastic flex with its nodes."""
    k, bending = material.stretch_stiffness, material.bending_stiffness
    thickness = float(np.sqrt(12.0 * bending / k)) if bending > 0.0 else _THIN
    forces = "both" if bending > 0.0 else "stretch"
    return (
        f'<flexcomp name="node" type="direct" dim="2" radius="{material.margin:.12g}" '
        f'mass="{material.surface_density * area:.12g}" '
        f'point="{numbers(elements.rest_position)}" element="{numbers(elements.triangle)}">'
        f'<elasticity young="{k / thickness:.12g}" poisson="0" thickness="{thickness:.12g}" '
        f'damping="{material.damping:.12g}" elastic2d="{forces}"/>'
        '<contact contype="0" conaffinity="0" selfcollide="none"/></flexcomp>'
    )


def _surfaces(count: int, free: IntArray, material: Material, self_collision: bool) -> str:
    """Returns the flexes that touch, of the triangles `free` (F,3) of `count` nodes."""
    if not len(free):
        return ""
    mesh = 'dim="2" body="' + " ".join(f"node_{i}" for i in range(count)) + '" '
    mesh += f'element="{numbers(free)}"'
    surface = (
        f'<flex name="surface" radius="{material.margin:.12g}" {mesh}>'
        f'<contact contype="{CLOTH_BIT}" conaffinity="{BODY_BIT}" selfcollide="none" condim="3" '
        f'friction="{material.friction:.12g} 0.005 0.0001" {_STIFF}/></flex>'
    )
    if not self_collision:
        return surface
    # bits of its own, so that it meets neither bodies nor the surface
    return surface + (
        f'<flex name="layers" radius="{material.margin:.12g}" {mesh}>'
        f'<contact contype="4" conaffinity="4" selfcollide="auto" condim="1" {_STIFF}/>'
        "</flex>"
    )
