"""The skin of a log's person, if its scenario describes a body by sex, age, height and weight."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.human.body import BodyMeasures, Posture
from drake_dress.models.human.skin.measures import MEASURED
from drake_dress.models.human.skin.person_skin import PersonSkin, person_skin
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.skin.skin import Skin
from drake_dress.report.log import RunLog

_KEYS = ("sex", "age", "height", "weight", "muscle")


@dataclass(frozen=True)
class LoggedSkin:
    """The skin of the person of a log.

    Attributes:
        log: the log.
        person: the skin and the posture of the scenario.
    """

    log: RunLog
    person: PersonSkin

    @property
    def skin(self) -> Skin:
        """The skin at rest."""
        return self.person.rest

    @property
    def faces(self) -> IntArray:
        """Triangles (F,3) of the skin."""
        return self.person.faces

    def is_known(self, sample: int) -> bool:
        """Returns whether all joints are known at a sample."""
        return bool(np.isfinite(self.log.joint_position[sample]).all())

    def vertices(self, sample: int) -> FloatArray:
        """Returns the skin's vertices (n,3) at a sample whose joints are known, m, world."""
        return self.person.vertices(self.log.joint_position[sample])


def logged_skin(log: RunLog, drawn_in: bool = True) -> LoggedSkin | None:
    """Returns the skin of a log's person; None if the scenario has no parametric body.

    Args:
        log: the log.
        drawn_in: see `person_skin`.
    """
    try:
        person: Any = log.scenario["person"]
        given = {key: person["body"][key] for key in _KEYS if person["body"].get(key) is not None}
        posture: Posture = "sitting" if person.get("posture") == "sitting" else "standing"
        skin = person_skin(Phenotype(**given), posture, _sizes(person), drawn_in)
        return LoggedSkin(log, skin)
    except (UserError, AttributeError, KeyError, TypeError):
        return None


def _sizes(person: dict[str, Any]) -> BodyMeasures | None:
    """Returns the sizes of a scenario's person, both arms alike; None if they are not all given."""
    given = person.get("measures") or {}
    if not given.keys() >= set(MEASURED):
        return None
    return BodyMeasures(**{e.name: given[e.name] for e in fields(BodyMeasures) if e.name in given})
