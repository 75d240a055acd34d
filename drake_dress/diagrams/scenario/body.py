"""The measures of a person whom a scenario describes by sex, age, height and weight, or a scan."""

from collections.abc import Collection
from pathlib import Path

from drake_dress.diagrams.scenario.schema import Body, BodyScan, Person
from drake_dress.errors import UserError
from drake_dress.models.human.skin.measures import MEASURED, body_values, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype, phenotype_skin
from drake_dress.models.human.skin.scan import Scan, scan_measures

_KEY = "person.body"
_NEEDED = ("sex", "age", "height", "weight")
# m and kg: finer digits differ between machines, and no tape has them.
_DIGITS = 5


def fill_in_body(source: str, person: Person, given: Collection[str]) -> None:
    """Sets the measures of a scenario's person that follow from `person.body`.

    Args:
        source: file of the scenario; scans are relative to its folder.
        person: person whose measures are set.
        given: names of the measures that the scenario gives, which stay. A resolved scenario gives
            all of them, and then no scan is read.

    Raises:
        UserError: there is no such body, or the scan cannot be used.
    """
    missing = set(MEASURED) - set(given)
    if person.body is None or not missing:
        return
    values = _values(source, person.body)
    for name in missing:
        setattr(person.measures, name, round(values[name], _DIGITS))


def _values(source: str, body: Body) -> dict[str, float]:
    """Returns measures by name, m and kg."""
    given = {name: getattr(body, name) for name in _NEEDED}
    named = [name for name, value in given.items() if value is not None]
    if body.scan is not None:
        if named:
            message = "is given beside scan, expected one of the two"
            raise UserError(source, f"{_KEY}.{named[0]}", message)
        return _of_scan(source, body.scan)
    missing = [name for name in _NEEDED if name not in named]
    if missing:
        message = f"is missing, expected {', '.join(_NEEDED)}, or scan"
        raise UserError(source, f"{_KEY}.{missing[0]}", message)
    try:
        return body_values(skin_measures(phenotype_skin(Phenotype(**given, muscle=body.muscle))))
    except UserError as error:
        raise UserError(source, f"{_KEY}.{error.key}", error.message) from error


def _of_scan(source: str, scan: BodyScan) -> dict[str, float]:
    if not scan.file:
        raise UserError(source, f"{_KEY}.scan.file", "is missing, expected a mesh file")
    file = Path(source).parent / scan.file
    return body_values(scan_measures(Scan(file, scan.unit, scan.up, scan.joints)))
