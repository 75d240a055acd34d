"""MuJoCo's flex: Saint Venant-Kirchhoff triangles and hinges with a flat rest shape.

Young's modulus and thickness follow from E·t = stretch stiffness and E t³ / 12 = bending stiffness;
Poisson's ratio is 0, as here. The integrator is `discrete`, implicit in position and velocity;
islands are off. Fastest stable settings:

- without obstacles: CG, tolerance 1e-2 (1e-8 takes twice as long and moves nodes by a hundredth of
  a millimetre; the Newton solver is not faster);
- with obstacles: CG with 100 iterations, tolerance 1e-5, solref 1 ms, which the integrator replaces
  by the stiffest row without rebound. At a tolerance of 1e-2 garments fall through a table; with
  the default solref they sink in by centimetres; the Newton solver takes twice as long;
- the same with passive contact: a penalty instead of the contact solver, faster and without
  friction, tolerance 1e-2.

Held nodes are gravity-compensated bodies of 1,000 kg, whose position and velocity are set before
each step: pinned vertices could not move, and vertices on a driven body cost more. With pins a step
takes equally long within the noise. Self-collision is off, as here.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np

from benchmarks.cloth.engines import Engine, Recipe
from benchmarks.cloth.scene import Scene
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.matrices import lumped_mass

_GRIPPER_MASS = 1000.0  # kg; 1 N moves it by 1e-7 m in 0.01 s
_GRAVITY = 9.81
# Displayed size of a plane, m; for contact it is infinite.
_PLANE_SIZE = 5.0


class MujocoFlex:
    """A garment as a MuJoCo flex.

    Args:
        scene: Scene to simulate.
        time_step: h, s.
        passive: Whether contact is MuJoCo's frictionless penalty.
    """

    def __init__(self, scene: Scene, time_step: float, passive: bool = False) -> None:
        import mujoco

        # Warnings would go to a log file in the current folder; MjData counts them.
        mujoco.set_mju_user_warning(lambda message: None)
        self._mujoco = mujoco
        self._h = time_step
        self.model = mujoco.MjModel.from_xml_string(_xml(scene, time_step, passive))
        self.data = mujoco.MjData(self.model)
        mass = lumped_mass(scene.elements(), scene.material)
        body = self.model.flex_vertbodyid
        typical = float(np.median(mass))
        mass[scene.held] = _GRIPPER_MASS
        self.model.body_mass[body] = mass
        mujoco.mj_setConst(self.model, self.data)
        # The solver's tolerance is relative to the mean inertia, which the grippers would distort.
        self.model.stat.meaninertia = typical
        self._axis = np.arange(3)
        self._dof = self.model.body_dofadr[body]
        self._held_dof = self._dof[scene.held][:, None] + self._axis
        every = self._dof[:, None] + self._axis
        self._rest = scene.position
        self._held_rest = scene.position[scene.held]
        self.data.qpos[every] = scene.first_position() - scene.position
        self.data.qvel[every] = scene.first_velocity()
        self._held_now = scene.first_position()[scene.held].copy()
        mujoco.mj_forward(self.model, self.data)

    def step(self, held: FloatArray) -> None:
        """Advances by one time step."""
        data = self.data
        data.qpos[self._held_dof] = self._held_now - self._held_rest
        data.qvel[self._held_dof] = (held - self._held_now) / self._h
        data.qfrc_applied[self._held_dof[:, 2]] = _GRIPPER_MASS * _GRAVITY
        self._mujoco.mj_step(self.model, data)
        self._held_now = held

    def positions(self) -> FloatArray:
        """Returns the positions (n,3), m."""
        dof = self._dof[:, None] + self._axis
        return np.asarray(self._rest + self.data.qpos[dof])

    @property
    def unconverged(self) -> int:
        """Number of steps for which MuJoCo warned about the solve of the elastic system."""
        return int(self.data.warning[self._mujoco.mjtWarning.mjWARN_INERTIA].number)


def _xml(scene: Scene, time_step: float, passive: bool) -> str:
    m = scene.material
    thickness = np.sqrt(12.0 * m.bending_stiffness / m.stretch_stiffness)
    area = float(scene.elements().triangle_area.sum())
    contact = "enable" if scene.obstacles.count else "disable"
    tolerance = 1e-5 if scene.obstacles.count and not passive else 1e-2
    return f"""<mujoco>
  <option timestep="{time_step:.12g}" integrator="discrete" solver="CG" iterations="100"
      tolerance="{tolerance}" gravity="0 0 {-_GRAVITY}">
    <flag contact="{contact}" island="disable"/>
  </option>
  <size memory="2G"/>
  <worldbody>
    {_geoms(scene)}
    <flexcomp name="cloth" type="direct" dim="2" radius="{m.margin:.12g}"
        mass="{m.surface_density * area:.12g}"
        point="{_numbers(scene.position)}" element="{_numbers(scene.faces)}">
      <elasticity young="{m.stretch_stiffness / thickness:.12g}" poisson="0"
          thickness="{thickness:.12g}" elastic2d="both"/>
      <contact selfcollide="none" condim="3" friction="{m.friction} 0.005 0.0001"
          solref="0.001 1" passive="{str(passive).lower()}"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def _geoms(scene: Scene) -> str:
    o = scene.obstacles
    friction = f'friction="{scene.material.friction} 0.005 0.0001"'
    lines = [
        f'<geom type="capsule" fromto="{_numbers(np.concatenate([a, b]))}" size="{r}" {friction}/>'
        for a, b, r in zip(o.a, o.b, o.radius, strict=True)
    ]
    lines += [
        f'<geom type="plane" pos="{_numbers(p)}" zaxis="{_numbers(n)}" '
        f'size="{_PLANE_SIZE} {_PLANE_SIZE} 0.1" {friction}/>'
        for p, n in zip(o.half_spaces.point, o.half_spaces.normal, strict=True)
    ]
    if o.solids:
        raise ValueError("closed meshes as obstacles are not carried over to this simulator")
    return "\n    ".join(lines)


def _numbers(array: np.ndarray) -> str:
    return " ".join(f"{v:.12g}" for v in np.asarray(array).ravel())


def _missing() -> str | None:
    found: Any = importlib.util.find_spec("mujoco")
    return None if found else "mujoco is not installed (pip install -e '.[bench]')"


def recipe(passive: bool = False) -> Recipe:
    """Returns MuJoCo's flex; with `passive`, contact is frictionless."""

    def make(scene: Scene, time_step: float) -> Engine:
        return MujocoFlex(scene, time_step, passive)

    return Recipe("MuJoCo flex, no friction" if passive else "MuJoCo flex", make, _missing)
