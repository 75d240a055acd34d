"""The garment as elements of a MuJoCo model.

Three flexes share one set of nodes: the fabric, which is elastic and touches nothing; its edges,
which touch the bodies at `Material.margin`; and its layers, which touch each other at twice that
distance, without friction. The last two leave out elements with held nodes: between a gripper and
a body, both of which move as prescribed, contact has no finite force. `contact/grasp.py` has what
held cloth does to the person.

The bodies meet edges and not triangles, because MuJoCo finds the contact of a capsule and a
triangle at the triangle's corners and the capsule's ends only: a triangle across a limb, with its
corners beside it, touches nothing. An edge is a capsule itself, and the contact of two capsules is
at their nearest points. The distance from a limb's axis is least on an edge of a triangle, except
about the limb's round ends, where the middle of a triangle of 3 cm lies 1 mm below its edges.

Young's modulus and thickness of the Saint Venant-Kirchhoff shell follow from E t = stretch
stiffness and E t³ / 12 = bending stiffness. Poisson's ratio is 0, as in the other schemes.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.approach import contact_parameters
from drake_dress.models.cloth.mujoco.bodies import BODY_BIT, CLOTH_BIT, bodies_xml, meshes_xml
from drake_dress.models.cloth.mujoco.settings import MujocoSettings
from drake_dress.models.cloth.mujoco.text import numbers

# Thickness of a fabric that does not bend, m.
_THIN = 1e-5
# Time constant and damping ratio of contact of layers. The integrator replaces rows that the time
# step cannot resolve by the stiffest without rebound.
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
    shapes: FloatArray,
) -> str:
    """Returns the model of a garment and bodies with the shapes (count,3) of `shapes_of`.

    Nodes have equal masses here; the caller sets the true ones.
    """
    area = float(elements.triangle_area.sum())
    return f"""<mujoco>
<option timestep="{time_step:.12g}" integrator="discrete" solver="CG" cone="elliptic"
  iterations="{settings.iterations}" tolerance="{settings.tolerance:.12g}"
  gravity="{numbers(gravity)}"><flag island="disable" autoreset="disable"/></option>
<size memory="{_MEMORY}"/>
<asset>
{meshes_xml(shapes)}
</asset>
<worldbody>
{bodies_xml(shapes, material.friction)}
{_fabric(elements, material, area)}
</worldbody>
<deformable>
{_edges(elements, held, material, time_step)}
{_layers(elements, held, material) if settings.self_collision else ""}
</deformable>
</mujoco>"""


def touching_edges(elements: Elements, held: IntArray) -> IntArray:
    """Returns (E,2) the edges that touch bodies: those without held nodes."""
    return _without(elements.edge, held)


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


def _edges(elements: Elements, held: IntArray, material: Material, time_step: float) -> str:
    """Returns the flex that touches the bodies."""
    return _flex(
        "edges",
        touching_edges(elements, held),
        elements.node_count,
        material,
        f'contype="{CLOTH_BIT}" conaffinity="{BODY_BIT}" selfcollide="none" condim="3" '
        f'friction="{material.friction:.12g} 0.005 0.0001" {contact_parameters(time_step)}',
    )


def _layers(elements: Elements, held: IntArray, material: Material) -> str:
    """Returns the flex that touches itself, with bits of its own."""
    return _flex(
        "layers",
        _without(elements.triangle, held),
        elements.node_count,
        material,
        f'contype="4" conaffinity="4" selfcollide="auto" condim="1" {_STIFF}',
    )


def _flex(name: str, element: IntArray, count: int, material: Material, contact: str) -> str:
    """Returns a flex of the `count` nodes that has no elasticity, or nothing without elements."""
    if not len(element):
        return ""
    nodes = " ".join(f"node_{i}" for i in range(count))
    return (
        f'<flex name="{name}" dim="{element.shape[1] - 1}" radius="{material.margin:.12g}" '
        f'body="{nodes}" element="{numbers(element)}"><contact {contact}/></flex>'
    )


def _without(element: IntArray, held: IntArray) -> IntArray:
    """Returns the elements (m,k) that have no held node."""
    free: IntArray = element[~np.isin(element, held).any(axis=1)]
    return free
