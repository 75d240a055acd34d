"""Tracks a garment: a simulation predicts it, and what cameras see of it corrects it.

The simulation is led by the grippers and touches the person as estimated. It is coarser than the
garment and has another fabric, so it drifts. Each correction moves it (`correction.py`), changes
its velocity, and adds to a force on each node that stands for what the simulation lacks: with that
force it stays where the garment is between corrections, also where no camera sees it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import GRAVITY, ClothState
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.immutable import Immutable
from drake_dress.models.perception.correction import Correction, CorrectionSettings
from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.perception.pulls import (
    Outline,
    Pulls,
    PullSettings,
    joined,
    out_of_free_space,
    to_points,
)
from drake_dress.models.perception.surface_points import PointSettings, surface_points


@dataclass(frozen=True)
class FilterSettings:
    """Settings of prediction and correction.

    Attributes:
        time_step: of the simulation, s.
        implicitness: of its scheme; see `ImplicitSettings`.
        buckling_wavelength: shortest wrinkle that the mesh can represent, in spacings.
        rounds: how often points look for the surface in one correction, each time within a shorter
            reach.
        shrinking: factor on that reach from round to round.
        least_reach: shortest reach, m.
        velocity_time: τ, s; a correction that is asked for a time Δt adds its displacement times
            Δt/τ² to the velocity.
        bias_time: τ, s; it adds the mass times its displacement times Δt/τ³ to the force.
        bias_fading: time in which the force fades to a share of 1/e, s.
        points: points that are used.
        pulls: what observations ask of the garment.
        correction: how far they move it.
    """

    time_step: float = 1.0 / 30.0
    implicitness: float = 0.7
    buckling_wavelength: float = 3.0
    rounds: int = 2
    shrinking: float = 0.5
    least_reach: float = 0.03
    velocity_time: float = 0.2
    bias_time: float = 0.2
    bias_fading: float = 2.0
    points: PointSettings = field(default_factory=PointSettings)
    pulls: PullSettings = field(default_factory=PullSettings)
    correction: CorrectionSettings = field(default_factory=CorrectionSettings)


@dataclass(frozen=True)
class View:
    """What a camera saw.

    Attributes:
        camera: as it is believed to stand.
        depth: (h,w) m, 0 where there is none.
        labels: (h,w) from a segmentation.
        label: of the garment.
    """

    camera: Pinhole
    depth: FloatArray
    labels: IntArray
    label: int


@dataclass(frozen=True)
class TrackedGarment(Immutable):
    """Estimate of a garment.

    Attributes:
        cloth: of the simulation.
        bias: (n,3) force that stands for what the simulation lacks, N.
    """

    cloth: ClothState
    bias: FloatArray

    @staticmethod
    def at_rest(x: FloatArray) -> TrackedGarment:
        """Returns a garment at rest at nodes `x` (n,3), m."""
        return TrackedGarment(ClothState.at_rest(x), np.zeros_like(np.asarray(x, dtype=float)))


class GarmentFilter:
    """Predicts and corrects the estimate of a garment.

    Args:
        mesh: of the estimate.
        material: believed fabric.
        settings: of prediction and correction.
        holds: whether the grippers hold the garment.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        material: Material,
        settings: FilterSettings = FilterSettings(),
        holds: bool = True,
    ) -> None:
        self.settings = settings
        self.held: npt.NDArray[np.integer] = mesh.held if holds else mesh.held[:0]
        self._faces = mesh.faces
        elements = make_elements(mesh.rest_position, mesh.faces)
        scheme = ImplicitSettings(
            implicitness=settings.implicitness, buckling_wavelength=settings.buckling_wavelength
        )
        self._cloth = ImplicitCloth(
            elements, material, settings.time_step, self.held, GRAVITY, settings=scheme
        )
        count = len(mesh.rest_position)
        self._correction = Correction(mesh.faces, count, self.held, settings.correction)

    def predicted(
        self, state: TrackedGarment, held: FloatArray, bodies: Sequence[Obstacles]
    ) -> TrackedGarment:
        """Returns the estimate some steps later.

        Args:
            state: now.
            held: (k,3) places of the held nodes then, m; they move there evenly.
            bodies: the person at the start of each step.
        """
        cloth, h = state.cloth, self.settings.time_step
        force = Influences(force=state.bias)
        for k, body in enumerate(bodies):
            velocity = (held - cloth.x[self.held]) / (h * (len(bodies) - k))
            cloth, _ = self._cloth.step(cloth, body, velocity, force)
        return replace(state, cloth=cloth)

    def corrected(
        self, state: TrackedGarment, views: Sequence[View], since: float, body: Obstacles
    ) -> TrackedGarment:
        """Returns the estimate with what cameras saw of the garment.

        Args:
            state: at the time of the views.
            views: of the cameras.
            since: time since the last correction, s.
            body: the person at that time, taken to rest.
        """
        s, predicted = self.settings, state.cloth.x
        seen = [
            (
                v,
                surface_points(v.camera, v.depth, v.labels, v.label, s.points),
                Outline.of(v.labels == v.label),
            )
            for v in views
        ]
        x, reach = predicted, s.pulls.reach
        for _ in range(s.rounds if views else 0):
            pulls = self._pulls(seen, x, reach)
            d = self._correction.displacement(pulls, predicted - x, since)
            x = self._cloth.displaced(replace(state.cloth, x=x), d, body)
            reach = max(s.shrinking * reach, s.least_reach)
        moved = x - predicted
        velocity = state.cloth.v + moved * since / s.velocity_time**2
        force = self._cloth.mass[:, None] * moved * since / s.bias_time**3
        force[self.held] = 0.0
        cloth = replace(state.cloth, x=x, v=velocity)
        return TrackedGarment(cloth, np.exp(-since / s.bias_fading) * state.bias + force)

    def _pulls(
        self, seen: Sequence[tuple[View, FloatArray, Outline]], x: FloatArray, reach: float
    ) -> Pulls:
        settings, pulls = self.settings.pulls, []
        for view, points, outline in seen:
            pulls.append(to_points(view.camera, points, x, self._faces, reach, settings))
            pulls.append(out_of_free_space(view.camera, view.depth, outline, x, settings))
        return joined(pulls, len(x))
