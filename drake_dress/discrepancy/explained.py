"""All of `drake-dress explain`: from recordings and a scenario to an explanation and its files.

Both the command line and `drake_dress.explain` use it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_dress.diagrams.scenario import Scenario, resolved_yaml
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import Cause, Explanation, Score, explain
from drake_dress.discrepancy.prediction_windows import Windows, windows
from drake_dress.discrepancy.reading import all_notes
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.residual_map import Spot, spots
from drake_dress.discrepancy.results import as_json, extended_yaml, write_json
from drake_dress.discrepancy.sentences import headline
from drake_dress.discrepancy.suggestion import suggest
from drake_dress.file_output import EXPLAIN_FILES, claimed, remove_results, write_text
from drake_dress.models.effects.effect import Effect


@dataclass(frozen=True)
class Explained:
    """What the simulation gets wrong about recordings.

    `print(explained)` prints the verdict as a sentence.

    Attributes:
        found: verdict, causes and candidates, with all numbers of the search.
        suggestion: what to record next; None if no question is open.
        notes: which data were not used, or were changed.
        extended_yaml: the scenario extended by the causes found, as YAML for `drake-dress run`.
        content: content of `explanation.json`.
    """

    found: Explanation
    suggestion: str | None
    notes: tuple[str, ...]
    extended_yaml: str
    content: dict[str, Any]
    _scenario_text: str
    _experiment: Experiment
    _spots: list[Spot]
    _alone: Windows

    @property
    def verdict(self) -> str:
        """The verdict: nothing, named, ambiguous or unexplained."""
        return self.found.verdict

    @property
    def causes(self) -> list[Cause]:
        """The causes in the order found: effect, standard deviations, gain and confidence."""
        return self.found.causes

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The physical effects among the causes."""
        return self.found.effects

    @property
    def candidates(self) -> list[Score]:
        """Every effect that was tried, best first."""
        return self.found.scores

    @property
    def residual(self) -> dict[str, dict[str, float]]:
        """RMS residual on held-out data: before, after and noise, each `marker_m` and `force_N`."""
        residual: dict[str, dict[str, float]] = self.content["residual"]
        return residual

    def __str__(self) -> str:
        return headline(self.found)

    def report_page(self) -> str:
        """Returns `report.html`, a page that needs no other file."""
        from drake_dress.discrepancy.report import report_page

        return report_page(
            self.found,
            self._experiment,
            self._spots,
            self._alone,
            self.suggestion,
            self._scenario_text,
            self.notes,
        )

    def write(self, out: str | Path, option: str = "out") -> None:
        """Writes `explanation.json`, `extended.yaml` and `report.html`.

        If the report cannot be made, a message goes to stderr and the other files are written.

        Args:
            out: folder; it is created if needed.
            option: name of the option or argument that gives the folder, for messages.

        Raises:
            UserError: the folder cannot be written to.
        """
        folder = Path(out)
        page = self._page(folder)
        extended, report, explanation = (folder / name for name in EXPLAIN_FILES)
        with claimed(option, folder, wait=True):
            remove_results(folder, EXPLAIN_FILES)
            write_text(extended, self.extended_yaml)
            write_json(explanation, self.content)
            if page is not None:
                write_text(report, page)

    def _page(self, out: Path) -> str | None:
        try:
            return self.report_page()
        except Exception as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            print(f"drake-dress: {out / EXPLAIN_FILES[1]}: {reason}", file=sys.stderr)
            return None


def explained(
    scenario: Scenario,
    base: Path,
    recordings: Sequence[Recording],
    among: Collection[str] | None = None,
    workers: int | None = None,
    stage: Callable[[str], None] = lambda _: None,
    progress: Callable[[], None] | None = None,
) -> Explained:
    """Returns what a scenario's simulation gets wrong about recordings.

    Args:
        scenario: its plant is the simulation that is compared with data.
        base: directory that a mesh file's name is relative to.
        recordings: recordings, at least one.
        among: names of the effects that may be a cause; by default all known ones.
        workers: number of processes; by default the number of cores.
        stage: called with a description of each stage.
        progress: called after each replay.
    """
    notes = tuple(all_notes(recordings))
    stage("settling")
    with Experiment(scenario, base, recordings, workers=workers, among=among) as experiment:
        found = explain(experiment, scenario.seed, stage, progress)
        comparison = found.comparison
        off = spots(
            comparison.whitening,
            comparison.vector["refined"],
            experiment.recordings,
            experiment.labs["scenario"].garment,
            [t.contact for t in comparison.told["refined"]],
            experiment.samples,
            experiment.labs["scenario"].person(()),
        )
        stage("running on its own")
        alone = windows(experiment, found, progress)
    suggestion = suggest(found, scenario, base, stage)
    return Explained(
        found,
        suggestion,
        notes,
        extended_yaml(scenario, experiment, found),
        as_json(found, off, alone, suggestion, notes),
        resolved_yaml(scenario),
        experiment,
        off,
        alone,
    )
