"""Explains in Python what a simulation gets wrong about measured data.

    from drake_dress import explain

    sway = explain.Measurement(
        time=time,                          # (T,) s
        gripper_position=gripper,           # (T,2,3) m
        marker_position=markers,            # (T,m,3) m, NaN where not seen
        marker_rest_position=places,        # (m,3) m
        gripper_force=forces,               # (T,2,3) N
    )
    found = explain.explain([sway], "my_scenario.yaml")
    print(found)                            # the verdict in a sentence
    for cause in found.causes:
        print(cause.name, cause.effect, cause.std, cause.confidence)
    found.write("out/found")                # report.html, explanation.json, extended.yaml

`register_effect` adds an effect of your own. It becomes a candidate of `explain`, an effect that
`simulate` can hide, and a key below `effects:` in scenarios. Work runs in spawned processes, so a
script needs `if __name__ == "__main__":` before it calls `explain` or `simulate`; a notebook does
not. The names in `__all__` are public.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TypeAlias

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.discrepancy.explained import Explained, explained
from drake_dress.discrepancy.explanation import Cause, Score
from drake_dress.discrepancy.generate import Dataset, Sensors, Session, make_dataset
from drake_dress.discrepancy.measurement import Measurement
from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.reading.assembling import recording_of
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.effects.contract import check_effect
from drake_dress.models.effects.effect import (
    AdhesionEffect,
    BodyEffect,
    CameraEffect,
    Effect,
    FibreEffect,
    ForceEffect,
    FrictionEffect,
    GravityEffect,
    MassEffect,
    MaterialEffect,
    Parameter,
    ShapeEffect,
    Sheet,
    Sliding,
    StretchEffect,
    parameter,
)
from drake_dress.models.effects.registry import (
    EFFECTS,
    HOW_TO_LOAD,
    register_effect,
    unregister_effect,
)
from drake_dress.plugins import load_plugin
from drake_dress.shipped import scenario_file

__all__ = [
    "EFFECTS",
    "AdhesionEffect",
    "BodyEffect",
    "CameraEffect",
    "Cause",
    "Dataset",
    "Effect",
    "Explained",
    "FibreEffect",
    "ForceEffect",
    "FrictionEffect",
    "GravityEffect",
    "MassEffect",
    "MaterialEffect",
    "Measurement",
    "Parameter",
    "Recording",
    "Score",
    "Sensors",
    "Session",
    "ShapeEffect",
    "Sheet",
    "Sliding",
    "StretchEffect",
    "check_effect",
    "check_recordings",
    "explain",
    "load_plugin",
    "parameter",
    "register_effect",
    "simulate",
    "unregister_effect",
]

# Types in which a recording may be given; a file may hold several.
Given: TypeAlias = Measurement | Recording | str | Path


def explain(
    recordings: Given | Sequence[Given],
    scenario: Scenario | str | Path,
    overrides: Sequence[str] = (),
    effects: Collection[str | type[Effect]] | None = None,
    workers: int | None = None,
    stage: Callable[[str], None] = lambda _: None,
) -> Explained:
    """Returns what a scenario's simulation gets wrong about recordings, and why.

    It takes minutes, on all cores; `docs/explain.md` has measured times.

    Args:
        recordings: one or more recordings; files are read as by `drake-dress explain`.
        scenario: model that is compared with the data: a YAML file, the name of a scenario that
            ships, or a `Scenario`, whose mesh file is then relative to the working directory.
        overrides: KEY=VALUE changes of the scenario, as for `--set`; only with a file or a name.
        effects: names or classes of the effects that may be a cause; by default all known ones.
        workers: number of processes; by default the number of cores.
        stage: called with a description of each stage; for example `print`.

    Raises:
        UserError: an argument cannot be used; the message says which and why. It is a ValueError.
    """
    loaded, base = _loaded(scenario, overrides)
    among = None if effects is None else _names(effects)
    return explained(loaded, base, _checked(recordings, loaded, base), among, workers, stage)


def check_recordings(
    recordings: Given | Sequence[Given],
    scenario: Scenario | str | Path,
    overrides: Sequence[str] = (),
) -> list[Recording]:
    """Returns recordings checked as by `explain`, those of files first.

    It takes seconds. The `notes` of each say which data were not used or were changed, such as lost
    markers.

    Args:
        recordings: as in `explain`.
        scenario: as in `explain`; recordings are checked against its garment.
        overrides: as in `explain`.

    Raises:
        UserError: an argument cannot be used; the message says which and why.
    """
    loaded, base = _loaded(scenario, overrides)
    return _checked(recordings, loaded, base)


def simulate(
    scenario: Scenario | str | Path,
    hide: str | Effect | Sequence[Effect] = "nothing",
    overrides: Sequence[str] = (),
    seed: int = 0,
    size: float = 1.0,
    session: Session | None = None,
    workers: int | None = None,
    stage: Callable[[str], None] = lambda _: None,
) -> Dataset:
    """Returns simulated recordings of a garment on which effects act that the scenario lacks.

    The true data are simulated with another scheme, a finer mesh and a smaller step.

    Args:
        scenario: as in `explain`.
        hide: effects; or names, joined by "+", of effects with random parameters, `random` or
            `nothing`.
        overrides: KEY=VALUE changes of the scenario.
        seed: seed of all random draws, 0 or more.
        size: factor on the strength of effects with random parameters.
        session: motions, their duration, and sensors; the usual ones by default.
        workers: number of processes; by default the number of cores.
        stage: called with a description of each stage.

    Raises:
        UserError: an argument cannot be used; the message says which and why.
    """
    if seed < 0:
        raise UserError("seed", "", f"is {seed}, expected 0 or more")
    session = session or Session()
    session.check("session")
    loaded, base = _loaded(scenario, overrides)
    hidden = [hide] if isinstance(hide, Effect) else hide
    return make_dataset(loaded, base, hidden, seed, size, session, workers, stage)


def _loaded(scenario: Scenario | str | Path, overrides: Sequence[str]) -> tuple[Scenario, Path]:
    """Returns a scenario, and the folder that its mesh files are relative to."""
    if not isinstance(scenario, Scenario):
        file = scenario_file(str(scenario))
        return load_scenario(file, overrides), file.parent
    if overrides:
        raise UserError("overrides", "", "are given with a Scenario, expected a file or a name")
    return scenario, Path()


def _checked(
    recordings: Given | Sequence[Given], scenario: Scenario, base: Path
) -> list[Recording]:
    if isinstance(recordings, Measurement | Recording | str | Path):
        recordings = [recordings]
    files = [r for r in recordings if isinstance(r, str | Path)]
    if not recordings:
        raise UserError("recordings", "", "are none, expected one or more")
    mesh = build_garment(scenario.garment, scenario.plant.spacing, base)
    density = scenario.plant.material.surface_density
    found = read_recordings(files, mesh, density) if files else []
    for given in recordings:
        if isinstance(given, Measurement):
            found.append(recording_of(given.raw(), mesh, density))
        elif isinstance(given, Recording):
            found.append(given)
        elif not isinstance(given, str | Path):
            raise UserError(
                "recordings", type(given).__name__, "expected a Measurement, a Recording or a file"
            )
    return found


def _names(effects: Collection[str | type[Effect]]) -> set[str]:
    """Returns the names of effects; raises UserError if one is unknown, or there are none."""
    if isinstance(effects, str):
        raise UserError("effects", effects, "is one name, expected a list of names")
    names = {e if isinstance(e, str) else e.NAME for e in effects}
    for name in sorted(names - set(EFFECTS)):
        raise UserError("effects", name, f"unknown effect ({HOW_TO_LOAD})")
    if not names:
        raise UserError("effects", "", "are none, expected one or more")
    return names
