"""The force on the grippers while they carry a coat at constant speed through free air.

A coat that has come to rest and starts with the grippers' velocity stays at rest in their frame, so
the force should equal its weight; any deviation is an error of the scheme.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.cloth.comparison import Result, own_recipes
from benchmarks.cloth.engines import ExplicitBiasEngine, StateEngine
from benchmarks.cloth.garments import CONTROLLER_SPACING, QUICK_SPACING, grasp, jacket
from benchmarks.cloth.measure import Session
from benchmarks.cloth.motions import at_rest, carried
from benchmarks.cloth.scene import QUICK_STEPS, SOFT, TIME_STEPS, Scene
from benchmarks.cloth.table import Table
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import lumped_mass

SPEED = 0.15
DURATION = 1.0
_SETTLING = 4.0
# Stiffness-proportional damping, s: speeds up settling without changing the rest state.
_SETTLING_DAMPING = 0.02
_GRAVITY = 9.81


def measure(session: Session) -> Result:
    """Returns gripper forces over their share of the weight, by scheme and time step."""
    mesh = jacket(QUICK_SPACING if session.quick else CONTROLLER_SPACING)
    held, x = grasp(mesh), mesh.rest_position
    session.say(f"carrying: {len(x)} nodes at {SPEED} m/s")
    settling = 1.0 if session.quick else _SETTLING
    hanging, speed = _hanging(
        Scene("hanging", x, mesh.faces, held, SOFT, at_rest(x[held]), settling), session
    )
    velocity = np.array([SPEED, 0.0, 0.0])
    scene = Scene(
        "carrying",
        x,
        mesh.faces,
        held,
        SOFT,
        carried(hanging[held], velocity),
        DURATION,
        velocity=np.tile(velocity, (len(x), 1)),
        start=hanging,
    )
    share = 0.5 * _GRAVITY * float(lumped_mass(scene.elements(), SOFT).sum())
    rows = []
    for h in QUICK_STEPS if session.quick else TIME_STEPS:
        for recipe in own_recipes():
            if session.stop.is_set():
                break
            missing = recipe.missing()
            if missing:
                session.say(f"  {recipe.name}: skipped, {missing}")
                continue
            engine = recipe.make(scene, h)
            assert isinstance(engine, ExplicitBiasEngine | StateEngine)
            force = []
            for k in range(round(DURATION / h)):
                engine.step(scene.motion((k + 1) * h))
                on_nodes = engine.held_force()
                per_gripper = on_nodes.reshape(2, -1, 3).sum(axis=1)
                force.append(np.linalg.norm(per_gripper, axis=1) / share)
            kept = np.array(force)
            rows.append(
                {
                    "engine": recipe.name,
                    "time_step_s": h,
                    "force_mean": float(kept.mean()),
                    "force_last": float(kept[-1].mean()),
                    "force_largest": float(kept.max()),
                }
            )
            session.say(
                f"  {recipe.name:24s} h {1e3 * h:5.4g} ms: force {kept.mean():.3f} of the weight, "
                f"{kept.max():.3f} at most"
            )
    return {
        "nodes": len(x),
        "speed_m_s": SPEED,
        "weight_share_N": share,
        "rest_speed_m_s": speed,
        "runs": rows,
    }


def _hanging(scene: Scene, session: Session) -> tuple[FloatArray, float]:
    """Returns the coat hanging at rest (n,3), m, and its largest remaining speed, m/s."""
    m = scene.material
    damped = Material(
        m.surface_density, m.stretch_stiffness, m.bending_stiffness, _SETTLING_DAMPING
    )
    h = 0.01
    engine = StateEngine(ImplicitCloth(scene.elements(), damped, h, scene.held), scene, h)
    held = scene.motion(0.0)
    for _ in range(round(scene.duration / h)):
        if session.stop.is_set():
            break
        engine.step(held)
    return engine.positions().copy(), float(np.linalg.norm(engine.state.v, axis=1).max())


def tables(result: Result) -> list[Table]:
    """Returns the table over schemes and time steps."""
    rows = [
        [
            run["engine"],
            f"{1e3 * run['time_step_s']:g}",
            run["force_mean"],
            run["force_last"],
            run["force_largest"],
        ]
        for run in sorted(result["runs"], key=lambda r: r["engine"])
    ]
    title = (
        f"carrying: {result['nodes']} nodes at {result['speed_m_s']} m/s, gripper force over its "
        f"share of the weight ({result['weight_share_N']:.2f} N)"
    )
    return [Table(title, ["engine", "h ms", "mean", "last", "largest"], rows)]


def write_figures(result: Result, folder: Path) -> list[Path]:
    """Writes nothing; the table is sufficient."""
    return []
