"""Common part of both Newton solvers: model, obstacles, held nodes, stepping on the CPU."""

from __future__ import annotations

import contextlib
import importlib.util
import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.cloth.scene import Scene
from drake_dress.models.arrays import FloatArray

# Contact penalty, N/m: at 1e3 Style3D sinks into a table by centimetres, at 1e4 not at all.
_CONTACT_STIFFNESS = 1.0e5
_CONTACT_DAMPING = 1.0e-5
# Distance to an obstacle below which a node gets a contact, m; more than its motion in a step.
_CONTACT_MARGIN = 0.05


def missing() -> str | None:
    """Returns why Newton is not available; None if it is."""
    for package in ("newton", "warp"):
        found: Any = importlib.util.find_spec(package)
        if not found:
            return f"{package} is not installed (pip install -e '.[bench]')"
    return None


def load() -> Any:
    """Imports and returns the module without its start-up messages."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    with silence():
        import newton

        warp.init()
    return newton


@contextlib.contextmanager
def silence() -> Iterator[None]:
    """Suppresses start-up messages and the timings that constructors print."""
    sink = io.StringIO()
    with contextlib.redirect_stdout(sink), contextlib.redirect_stderr(sink):
        yield


class NewtonCloth:
    """Steps a Newton model with one of its solvers; subclasses make both.

    Args:
        scene: Scene to simulate.
        time_step: h, s.
        substeps: Number of solver steps per time step.
    """

    def __init__(self, scene: Scene, time_step: float, substeps: int) -> None:
        import warp

        self._newton = load()
        self._warp = warp
        self._scene = scene
        self._h = time_step
        self._substeps = substeps
        with silence(), warp.ScopedDevice("cpu"):
            builder = self._newton.ModelBuilder(up_axis=self._newton.Axis.Z)
            self._add_cloth(builder)
            self._add_obstacles(builder)
            self.model = builder.finalize(device="cpu")
            self._prepare_model()
            self.solver = self._make_solver()
            self._now, self._next = self.model.state(), self.model.state()
            self._control = self.model.control()
            self._pipeline = None
            self._contacts = None
            if scene.obstacles.count:
                self._pipeline = self._newton.CollisionPipeline(
                    self.model, soft_contact_margin=_CONTACT_MARGIN
                )
                self._contacts = self._pipeline.contacts()
        self._now.particle_q.assign(scene.first_position().astype(np.float32))
        self._now.particle_qd.assign(scene.first_velocity().astype(np.float32))
        self._held_now = scene.first_position()[scene.held].copy()

    def _add_cloth(self, builder: Any) -> None:
        raise NotImplementedError

    def _make_solver(self) -> Any:
        raise NotImplementedError

    def _prepare_model(self) -> None:
        """Marks the held nodes and sets contact."""
        flags = self.model.particle_flags.numpy()
        flags[self._scene.held] &= ~int(self._newton.ParticleFlags.ACTIVE)
        self.model.particle_flags.assign(flags)
        self.model.soft_contact_ke = _CONTACT_STIFFNESS
        self.model.soft_contact_kd = _CONTACT_DAMPING
        self.model.soft_contact_mu = self._scene.material.friction
        self.model.set_gravity((0.0, 0.0, -9.81))

    def _add_obstacles(self, builder: Any) -> None:
        warp, o = self._warp, self._scene.obstacles
        config = builder.default_shape_cfg.copy()
        config.mu = self._scene.material.friction
        for a, b, radius in zip(o.a, o.b, o.radius, strict=True):
            axis = b - a
            length = float(np.linalg.norm(axis))
            turn = warp.quat_between_vectors(
                warp.vec3(0.0, 0.0, 1.0), warp.vec3(*(axis / length if length else [0, 0, 1]))
            )
            builder.add_shape_capsule(
                body=-1,
                xform=warp.transform(warp.vec3(*(0.5 * (a + b))), turn),
                radius=float(radius),
                half_height=0.5 * length,
                cfg=config,
            )
        for point, normal in zip(o.half_spaces.point, o.half_spaces.normal, strict=True):
            builder.add_shape_plane(
                plane=(*(float(c) for c in normal), -float(normal @ point)), cfg=config
            )
        if o.solids:
            raise ValueError("closed meshes as obstacles are not carried over to this simulator")

    def step(self, held: FloatArray) -> None:
        """Advances by one time step."""
        if self._pipeline is not None:
            self._pipeline.collide(self._now, self._contacts)
        for k in range(self._substeps):
            share = (k + 1) / self._substeps
            self._place_held(self._held_now + share * (held - self._held_now))
            self._now.clear_forces()
            self.solver.step(
                self._now, self._next, self._control, self._contacts, self._h / self._substeps
            )
            self._now, self._next = self._next, self._now
        self._held_now = held

    def _place_held(self, held: FloatArray) -> None:
        # On the CPU, `numpy()` is a view of the array's memory.
        self._now.particle_q.numpy()[self._scene.held] = held

    def positions(self) -> FloatArray:
        """Returns the positions (n,3), m."""
        return np.asarray(self._now.particle_q.numpy().astype(np.float64))
