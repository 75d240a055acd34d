"""The skin of a log's person, if its scenario describes a body by sex, age, height and weight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import yaml

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.human.body import Posture
from drake_dress.models.human.skin.at_joints import vertices_at_joints
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.skin import Skin
from drake_dress.report.log import RunLog

_KEYS = ("sex", "age", "height", "weight", "muscle")


@dataclass(frozen=True)
class LoggedSkin:
    """The skin of the person of a log.

    Attributes:
        log: the log.
        skin: at rest.
        posture: of the scenario.
    """

    log: RunLog
    skin: Skin
    posture: Posture

    @property
    def faces(self) -> IntArray:
        """Triangles (F,3) of the skin."""
        return self.skin.faces.astype("int32")

    def vertices(self, sample: int) -> FloatArray:
        """Returns the skin's vertices (n,3) at a sample, m, world."""
        return vertices_at_joints(self.skin, self.log.joint_position[sample], self.posture)


def logged_skin(log: RunLog) -> LoggedSkin | None:
    """Returns the skin of a log's person; None if the scenario has no parametric body."""
    try:
        content: Any = yaml.safe_load(log.scenario_text)
        person: Any = content["person"]
        given = {key: person["body"][key] for key in _KEYS if person["body"].get(key) is not None}
        skin = phenotype_skin(Phenotype(**given))
    except (yaml.YAMLError, UserError, AttributeError, KeyError, TypeError):
        return None
    return LoggedSkin(log, skin, "sitting" if person.get("posture") == "sitting" else "standing")
