"""Reference runs with a time step small enough to represent the limit h → 0, kept in a file."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from benchmarks.cloth.engines import Recipe, implicit, projective_dynamics
from benchmarks.cloth.measure import SAMPLE_INTERVAL, Run, Session
from benchmarks.cloth.scene import Scene
from drake_dress.models.arrays import FloatArray

# The paper uses 0.1 ms for Projective Dynamics: hours on one core for all scenes, at 6,121 nodes.
_PD_STEP = 5e-4
_IMPLICIT_STEP = 2.5e-4
# Above this stiffness, N/m, Projective Dynamics needs hundreds of iterations per step even at
# 0.5 ms. Both schemes have the same energy and therefore the same limit.
STIFF_FROM = 1000.0


class Reference:
    """Positions of the fine run at multiples of SAMPLE_INTERVAL.

    Attributes:
        engine: Name of the engine; time_step: Time step, s.
        sample: Multiple of SAMPLE_INTERVAL → (n,3) positions, m.
    """

    def __init__(self, engine: str, time_step: float, sample: dict[int, FloatArray]) -> None:
        self.engine = engine
        self.time_step = time_step
        self.sample = sample

    def distance(self, run: Run) -> list[tuple[float, float]]:
        """Returns (time, s; mean distance of the nodes to the reference, m) for each sample."""
        common = sorted(set(run.sample) & set(self.sample))
        return [
            (
                k * SAMPLE_INTERVAL,
                float(np.linalg.norm(run.sample[k] - self.sample[k], axis=1).mean()),
            )
            for k in common
        ]


def fine_reference(session: Session, scene: Scene) -> Reference | None:
    """Returns the fine run of a scene, from its file if there is one; None if not requested.

    It uses Projective Dynamics for a soft fabric, and the implicit scheme for a stiff one. It is
    also None if the run is interrupted.
    """
    if session.cache is None:
        return None
    recipe, step = _choice(scene)
    if session.quick:
        step *= 4.0
    file = session.cache / f"reference-{scene.name}-{_key(scene, recipe.name, step)}.npz"
    count = round(scene.duration / SAMPLE_INTERVAL)
    if file.exists():
        with np.load(file) as stored:
            sample = {k: stored["x"][k] for k in range(len(stored["x"]))}
        return Reference(recipe.name, step, sample)
    session.say(f"  fine reference of {scene.name}: {recipe.name}, h {1e3 * step:g} ms")
    engine = recipe.make(scene, step)
    kept = [engine.positions().copy()]
    each = round(SAMPLE_INTERVAL / step)
    for block in range(count):
        for inner in range(each):
            if session.stop.is_set():
                return None
            engine.step(scene.motion((block * each + inner + 1) * step))
        kept.append(engine.positions().copy())
        if (block + 1) % 10 == 0:
            session.say(f"    {(block + 1) * SAMPLE_INTERVAL:.0f} s of {scene.duration:g} s")
    unconverged = int(getattr(engine, "unconverged", 0))
    if unconverged:
        session.say(f"    {unconverged} of {count * each} steps did not converge")
    _store(file, np.array(kept))
    return Reference(recipe.name, step, dict(enumerate(kept)))


def _choice(scene: Scene) -> tuple[Recipe, float]:
    if scene.material.stretch_stiffness <= STIFF_FROM:
        return projective_dynamics(), _PD_STEP
    return implicit(), _IMPLICIT_STEP


def _key(scene: Scene, engine: str, step: float) -> str:
    """Returns a hash of everything that the reference depends on except the engine's code."""
    digest = hashlib.sha256()
    for array in (scene.first_position(), scene.first_velocity(), scene.position):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(np.ascontiguousarray(scene.faces).tobytes())
    digest.update(np.ascontiguousarray(scene.held).tobytes())
    for now in np.linspace(0.0, scene.duration, 7):
        digest.update(np.ascontiguousarray(scene.motion(float(now))).tobytes())
    for array in (scene.obstacles.a, scene.obstacles.b, scene.obstacles.radius):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(np.ascontiguousarray(scene.obstacles.half_spaces.point).tobytes())
    digest.update(np.ascontiguousarray(scene.obstacles.half_spaces.normal).tobytes())
    digest.update(repr((scene.material, scene.duration, engine, step)).encode())
    return digest.hexdigest()[:12]


def _store(file: Path, positions: FloatArray) -> None:
    """Writes the file atomically, so that an interrupted run leaves none behind."""
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(".part.npz")
    np.savez_compressed(partial, x=positions.astype(np.float32))
    partial.replace(file)
