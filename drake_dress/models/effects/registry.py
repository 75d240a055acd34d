"""All effects by name."""

from __future__ import annotations

from collections.abc import Mapping

from drake_dress.models.effects.air import AirDrag, Wind
from drake_dress.models.effects.contact import (
    Adhesion,
    AnisotropicFriction,
    Friction,
    VelocityDependentFriction,
)
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import (
    AnisotropicStiffness,
    BendingStiffness,
    InternalDamping,
    RestSize,
    StrainStiffening,
    StretchStiffness,
)
from drake_dress.models.effects.grip import GripperCompliance, GripperLatency, GripperSlip
from drake_dress.models.effects.mass import GravityTilt, LocalMass, SurfaceDensity
from drake_dress.models.effects.person import LimbCompliance, LimbRadius
from drake_dress.models.effects.sensing import CameraRotation, CameraTranslation, TimeOffset

EFFECTS: Mapping[str, type[Effect]] = {
    effect.NAME: effect
    for effect in (
        AirDrag,
        Wind,
        SurfaceDensity,
        LocalMass,
        StretchStiffness,
        AnisotropicStiffness,
        StrainStiffening,
        BendingStiffness,
        InternalDamping,
        RestSize,
        Friction,
        VelocityDependentFriction,
        AnisotropicFriction,
        Adhesion,
        LimbRadius,
        LimbCompliance,
        GripperLatency,
        GripperSlip,
        GripperCompliance,
        TimeOffset,
        CameraRotation,
        CameraTranslation,
        GravityTilt,
    )
}
