"""The skin of a person in a scene: that of a known body, posed by the joints of the arms."""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.human.body import BodyMeasures, Posture
from drake_dress.models.human.skin.at_joints import motions_at_joints
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.posing import moved_vertices
from drake_dress.models.human.skin.skin import Skin, scaled
from drake_dress.models.human.skin.within import within_cones


@dataclass(frozen=True)
class PersonSkin:
    """A person's skin, which follows the arms.

    Attributes:
        rest: the skin at rest, in the torso's frame.
        posture: of the person.
    """

    rest: Skin
    posture: Posture

    @property
    def faces(self) -> IntArray:
        """Triangles (F,3), counter-clockwise from outside."""
        return self.rest.faces.astype("int32")

    def motions(self, joint_position: FloatArray) -> FloatArray:
        """Returns the motions (9,3,4) of `ALL_BONES` at joints (6,3), m, world."""
        return motions_at_joints(self.rest, joint_position, self.posture)

    def vertices(self, joint_position: FloatArray) -> FloatArray:
        """Returns the vertices (n,3) at joints (6,3), m, world."""
        return moved_vertices(self.rest, self.motions(joint_position))


def person_skin(
    person: Phenotype, posture: Posture, body: BodyMeasures | None, drawn_in: bool = True
) -> PersonSkin:
    """Returns the skin of a person, as pictures show it.

    Args:
        person: sex, age, height and weight.
        posture: standing or sitting.
        body: sizes of the person, whose shoulders' height the skin is scaled to, and out of whose
            round cones it does not stand; None: those of the skin itself. They differ where a
            scenario gives or varies single measures.
        drawn_in: whether the skin is drawn in to the cones; False shows it around them.

    Raises:
        UserError: as `phenotype_skin`.
    """
    skin = phenotype_skin(person)
    if body is None:
        body = body_measures(skin_measures(skin))
    own = 0.5 * (skin.joints["left_shoulder"][2] + skin.joints["right_shoulder"][2])
    skin = scaled(skin, body.shoulder_height / float(own))
    return PersonSkin(within_cones(skin, body) if drawn_in else skin, posture)
