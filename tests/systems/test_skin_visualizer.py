"""The live page shows the person's skin, and sends it while the arms move."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams

from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.systems.skin_visualizer import SkinVisualizer
from tests.models.human.skin.bodies import MAN, skin_of

PATH = "dressing/skin"


def test_skin_is_at_the_joints_and_is_sent_when_they_move() -> None:
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    skin = PersonSkin(skin_of(MAN), "standing")
    system = SkinVisualizer(meshcat, skin)
    context = system.CreateDefaultContext()
    names = ("shoulder", "elbow", "knuckle_middle")
    joints = np.array([skin.rest.joints[f"{s}_{n}"] for s in ("left", "right") for n in names])

    def publish(at: np.ndarray) -> bytes:
        system.get_input_port().FixValue(context, at.ravel())
        system.ForcedPublish(context)
        packed: bytes = meshcat._GetPackedObject(PATH)
        return packed

    first = publish(joints)
    assert skin.vertices(joints).astype("<f4").tobytes() in first
    lowered = joints - [0.0, 0.0, 0.05] * np.array([[0.0], [0.0], [1.0], [0.0], [0.0], [0.0]])
    second = publish(lowered)
    assert skin.vertices(lowered).astype("<f4").tobytes() in second
    # what is not seen, or not known, is not sent
    assert publish(lowered + 5e-4) == second
    assert publish(np.full((6, 3), np.nan)) == second
