"""Batches of sheets for tests."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from drake_dress.models.cloth.batch.cloth import BatchCloth
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.elements import Elements, FloatArray
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import sheet_elements

HELD = np.array([0, 1, 17, 16], dtype=np.int32)

FABRICS = (
    Material(friction=0.6),
    Material(0.2, 60.0, 1e-4, friction=0.8, margin=2e-3),
    Material(0.45, 150.0, 8e-4, friction=0.5, margin=4e-3),
)


@dataclass(frozen=True)
class Batch:
    """States (B,n,3), motions (B,k,3) and one set of obstacles for each garment."""

    elements: Elements
    h: float
    x: FloatArray
    v: FloatArray
    motion: FloatArray
    obstacles: tuple[Obstacles, ...]

    def cloth(
        self,
        device: str = "cpu",
        material: Material | tuple[Material, ...] = FABRICS[0],
        tolerance: float = 1e-12,
    ) -> BatchCloth:
        return BatchCloth(
            self.elements, material, self.h, HELD, len(self.x), device, tolerance=tolerance
        )

    def alone(self, material: Material = FABRICS[0]) -> ExplicitBiasCloth:
        return ExplicitBiasCloth(self.elements, material, self.h, HELD, tolerance=1e-12)

    def part(self, garments: list[int]) -> Batch:
        return Batch(
            self.elements,
            self.h,
            self.x[garments],
            self.v[garments],
            self.motion[garments],
            tuple(self.obstacles[g] for g in garments),
        )


def in_the_air(h: float, batch: int = 3, seed: int = 1) -> Batch:
    """Crumpled, moving sheets held at one edge, with nothing near."""
    rng = np.random.default_rng(seed)
    rest, e = sheet_elements(16, 18, 0.03)
    x = rest + 2e-3 * rng.normal(size=(batch, *rest.shape))
    v = 0.2 * rng.normal(size=x.shape)
    motion = 0.05 * h * rng.normal(size=(batch, len(HELD), 3))
    return Batch(e, h, x, v, motion, (Obstacles.none(),) * batch)


def on_limbs(h: float, batch: int = 3) -> Batch:
    """Sheets that have fallen on moving limbs and a tilted floor, no two alike.

    The last one hangs too far above to touch anything.
    """
    e, x, v, velocity, obstacles = _settled(batch)
    return Batch(e, h, x.copy(), v.copy(), h * velocity, obstacles)


def landing(h: float, batch: int = 3, seed: int = 1) -> Batch:
    """The same, thrown down and sideways: nodes land, slide, take off and come to rest."""
    scene = on_limbs(h, batch)
    thrown = np.random.default_rng(seed).uniform(-1.0, 1.0, size=(batch, 1, 3))
    return replace(scene, v=scene.v + thrown * [1.0, 1.0, 0.5] - [0.0, 0.0, 0.5])


@lru_cache(maxsize=2)
def _settled(
    batch: int,
) -> tuple[Elements, FloatArray, FloatArray, FloatArray, tuple[Obstacles, ...]]:
    """Returns sheets on limbs: positions, velocities, those of the held nodes and the limbs."""
    h, rng = 0.01, np.random.default_rng(2)
    rest, e = sheet_elements(16, 18, 0.03)
    x = np.tile(rest, (batch, 1, 1))
    x[-1, :, 2] += 1.0
    v = 0.02 * rng.normal(size=x.shape)
    velocity = np.tile([0.05, 0.02, -0.1], (batch, len(HELD), 1))
    velocity *= rng.uniform(0.5, 1.0, size=(batch, 1, 1))
    obstacles = tuple(_limbs(0.01 * k) for k in range(batch))
    settling = BatchCloth(e, FABRICS[0], h, HELD, batch)
    bodies = settling.bodies(obstacles)
    for _ in range(50):
        x, v, _, _ = settling.step(x, v, h * velocity, bodies)
    return e, x, v, velocity, obstacles


def _limbs(shift: float) -> Obstacles:
    floor = HalfSpaces(
        np.array([[0.1, 0.0, -0.13 - shift]]),
        np.array([[0.0, 0.1, 1.0]]) / np.hypot(0.1, 1.0),
        np.array([[0.01, 0.0, 0.02]]),
        np.array([[0.1, 0.0, 0.0]]),
    )
    return Obstacles(
        np.array([[0.1 + shift, 0.2, -0.06], [0.3, 0.1, -0.07]]),
        np.array([[0.4, 0.3, -0.06], [0.3, 0.1, -0.07]]),
        np.array([0.05, 0.05 - shift]),
        np.array([[0.0, 0.0, 0.05], [0.02, shift, 0.0]]),
        np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]]),
        floor,
    )


def relative(a: FloatArray, b: FloatArray) -> float:
    """Returns ‖a − b‖ / ‖b‖."""
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))
