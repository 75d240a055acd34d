"""Writes the explanation as one self-contained page, `report.html`."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from drake_dress import __version__
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import DISCRETISATION, Explanation
from drake_dress.discrepancy.prediction_windows import Windows
from drake_dress.discrepancy.residual_map import Spot, worst
from drake_dress.discrepancy.sentences import headline, plain, values
from drake_dress.drawing import plain_settings
from drake_dress.report.page import chart, embedded, html_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_BEFORE, _AFTER, _NOISE = "#b8453b", "#0b7a5e", "#66727f"


@plain_settings()
def report_page(
    explanation: Explanation,
    experiment: Experiment,
    spots: Sequence[Spot],
    alone: Windows,
    suggestion: str | None,
    scenario_text: str,
    notes: Sequence[str] = (),
) -> str:
    """Returns the page as HTML.

    Args:
        explanation: result of the search.
        experiment: its recordings are plotted.
        spots: parts of the data by their residual, worst first.
        alone: results of the free runs.
        suggestion: what to record next.
        scenario_text: resolved YAML of the scenario.
        notes: which data were not used, or were changed.
    """
    x = explanation
    parts = [
        _verdict(x),
        "<h2>Causes</h2>" + _causes(x) if x.causes else "",
        f"<h2>What to record next</h2><p>{html.escape(suggestion)}</p>" if suggestion else "",
        _notes(notes),
        "<h2>Residuals on held-out data</h2>",
        _sizes(x),
        *_residual_charts(x, experiment),
        "<h2>On its own</h2>",
        _alone(alone, experiment),
        _since_restart(alone, experiment),
        "<h2>Where the simulation was off most</h2>",
        _spots(spots),
        "<h2>Every effect tried</h2>",
        _effects_tried(x),
        "<h2>Scenario</h2>",
        f"<p>drake_dress {__version__}</p><details><summary>resolved YAML</summary>"
        f"<pre>{html.escape(scenario_text)}</pre></details>",
    ]
    return html_page("What the simulation gets wrong", [p for p in parts if p])


def _verdict(x: Explanation) -> str:
    good = x.verdict in ("nothing", "named") and x.doubted is None
    return (
        f'<header class="{"good" if good else "bad"}"><h1>{html.escape(headline(x))}</h1>'
        f"<p>{html.escape(_gain(x))}</p></header>"
    )


def _notes(notes: Sequence[str]) -> str:
    if not notes:
        return ""
    lines = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return f"<h2>What the data hold beside measurements</h2><ul>{lines}</ul>"


def _gain(x: Explanation) -> str:
    if not x.causes:
        return f"Mean squared residual in units of the noise: {x.loss['extended']:.2f}."
    return (
        f"The extended model removes {100 * x.gain[0]:.0f} % of the squared residual beyond noise "
        f"on data it was not fitted to (90 % interval {100 * x.gain[1]:.0f} to "
        f"{100 * x.gain[2]:.0f} %)."
    )


def _causes(x: Explanation) -> str:
    body = "".join(
        f"<tr><td>{html.escape(plain(c.name))}</td><td>{html.escape(values(c) or '–')}</td>"
        f"<td>{100 * c.gain:.0f} %</td><td>{100 * c.confidence:.0f} %</td></tr>"
        for c in x.causes
    )
    return (
        "<table><thead><tr><th>cause</th><th>parameters</th><th>share explained</th>"
        f"<th>confidence</th></tr></thead><tbody>{body}</tbody></table>"
    )


def _sizes(x: Explanation) -> str:
    rows = [
        ("markers, mm", [1e3 * v[0] for v in (x.before, x.after, x.noise)], "{:.2f}"),
        ("forces, N", [v[1] for v in (x.before, x.after, x.noise)], "{:.3f}"),
    ]
    body = "".join(
        f"<tr><td>{name}</td>" + "".join(f"<td>{form.format(v)}</td>" for v in three) + "</tr>"
        for name, three, form in rows
    )
    return (
        "<table><thead><tr><th>RMS</th><th>before</th><th>after</th><th>noise</th></tr></thead>"
        f"<tbody>{body}</tbody></table><p class='note'>The simulation's own numerics: refining "
        f"step and mesh moves the markers by {1e3 * x.numerics:.2f} mm (RMS)"
        + (
            ", which is the first cause.</p>"
            if any(c.name == DISCRETISATION for c in x.causes)
            else "; that is counted as noise.</p>"
        )
    )


def _residual_charts(x: Explanation, experiment: Experiment) -> list[str]:
    """Returns charts of the residuals over time, on the garment and by frequency."""
    residuals = _Residuals(x, experiment)
    return [
        _chart("Over time", "RMS over the markers.", len(experiment.recordings), residuals.course),
        _chart(
            "On the garment",
            "Rest shape from behind and in front; RMS of each marker, mm.",
            1,
            residuals.on_garment,
            4,
        ),
        _chart(
            "Spectrum and whiteness",
            "Whitened residuals of the markers: noise alone has a flat spectrum at 1 and no "
            "autocorrelation.",
            1,
            residuals.spectrum,
            2,
        ),
    ]


def _spots(spots: Sequence[Spot]) -> str:
    body = "".join(
        f"<tr><td>{html.escape(s.kind)}</td><td>{html.escape(s.name)}</td>"
        + (
            f"<td>{s.rms:.3f} N</td><td>{s.noise:.3f} N</td>"
            if s.kind == "signal" and s.name.startswith("force")
            else f"<td>{1e3 * s.rms:.2f} mm</td><td>{1e3 * s.noise:.2f} mm</td>"
        )
        + f"<td>{s.whitened:.2f}</td></tr>"
        for s in worst(spots)
    )
    return (
        "<table><thead><tr><th></th><th>part</th><th>RMS</th><th>noise</th>"
        f"<th>squared, in noise</th></tr></thead><tbody>{body}</tbody></table>"
    )


def _alone(alone: Windows, experiment: Experiment) -> str:
    rows = (
        ("within the horizon", alone.strayed),
        ("whole recordings from their start", alone.whole),
    )
    body = "".join(
        f"<tr><td>{name}</td><td>{1e3 * pair[0]:.2f}</td><td>{1e3 * pair[1]:.2f}</td></tr>"
        for name, pair in rows
    )
    horizons = ", ".join(
        f"{r.name} {'over ' if h >= alone.since[-1] else ''}{h:.2f} s"
        for r, h in zip(experiment.recordings, alone.horizon, strict=True)
    )
    return (
        "<table><thead><tr><th>markers, RMS, mm</th><th>before</th><th>after</th></tr></thead>"
        f"<tbody>{body}</tbody></table><p class='note'>Horizon: {html.escape(horizons)}; noise "
        f"{1e3 * alone.noise:.2f} mm.</p>"
    )


def _since_restart(alone: Windows, experiment: Experiment) -> str:
    return _chart(
        "Since a restart",
        "The simulation is started from the state that the replay in step with the markers has "
        "at every second, and runs on its own; RMS over the markers. Past the horizon (dotted) "
        "an error of the markers' size has grown threefold, and a residual says little.",
        len(experiment.recordings),
        lambda axes: _since(alone, experiment, axes),
    )


def _since(alone: Windows, experiment: Experiment, axes: list[Axes]) -> None:
    for i, (ax, r) in enumerate(zip(axes, experiment.recordings, strict=True)):
        for name, color, course in (
            ("before", _BEFORE, alone.before[i]),
            ("after", _AFTER, alone.after[i]),
        ):
            ax.plot(alone.since, 1e3 * course, color=color, label=name)
        ax.axhline(1e3 * alone.noise, color=_NOISE, ls=":", label="noise")
        ax.axvline(alone.horizon[i], color=_NOISE, ls=":")
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel(f"{r.name}, mm")
    axes[0].legend(frameon=False, fontsize=9, ncols=3)
    axes[-1].set_xlabel("time since a restart, s")


class _Residuals:
    """Residuals before and after the extension, arranged for the charts."""

    def __init__(self, x: Explanation, experiment: Experiment) -> None:
        w = x.comparison.whitening
        discrete = any(c.name == DISCRETISATION for c in x.causes)
        first = x.comparison.vector["scenario" if discrete else "refined"]
        self._w, self._experiment = w, experiment
        # name, colour, whitened residual, residual in m and N
        self._pairs = tuple(
            (name, color, w.data - predicted, w.size(w.data - predicted))
            for name, color, predicted in (
                ("before", _BEFORE, first),
                ("after", _AFTER, x.predicted),
            )
        )

    def course(self, axes: list[Axes]) -> None:
        """Plots the RMS over the markers against time, for each recording."""
        w = self._w
        for i, (ax, r) in enumerate(zip(axes, self._experiment.recordings, strict=True)):
            rows = (w.recording == i) & ~w.is_force
            at, index = np.unique(w.time[rows], return_inverse=True)
            for name, color, _, size in self._pairs:
                squared = size[rows] ** 2
                rms = 1e3 * np.sqrt(
                    3.0 * np.bincount(index, squared) / np.maximum(np.bincount(index), 1)
                )
                ax.plot(at, rms, color=color, label=name)
            ax.axhline(1e3 * np.sqrt(3.0) * r.marker_noise, color=_NOISE, ls=":", label="noise")
            ax.set_ylim(bottom=0.0)
            ax.set_ylabel(f"{r.name}, mm")
        axes[0].legend(frameon=False, fontsize=9, ncols=3)
        axes[-1].set_xlabel("time, s")

    def on_garment(self, axes: list[Axes]) -> None:
        """Plots the RMS of each marker on the rest shape, before and after, back and front."""
        w = self._w
        rest = self._experiment.labs["scenario"].garment.rest_position
        sizes = []
        points = []
        for _, _, _, size in self._pairs:
            values, places = [], []
            for i, r in enumerate(self._experiment.recordings):
                rows = (w.recording == i) & ~w.is_force
                squared = size[rows] ** 2
                count = np.bincount(w.marker[rows], minlength=len(r.marker_rest_position))
                total = np.bincount(w.marker[rows], squared, len(r.marker_rest_position))
                seen = count > 0
                values.append(1e3 * np.sqrt(3.0 * total[seen] / count[seen]))
                places.append(r.marker_rest_position[seen])
            sizes.append(np.concatenate(values))
            points.append(np.concatenate(places))
        top = float(np.quantile(sizes[0], 0.98))
        for k, ax in enumerate(axes):
            which, behind = k // 2, k % 2 == 0
            place, size = points[which], sizes[which]
            side = (place[:, 0] < 0.0) == behind
            sign = -1.0 if not behind else 1.0
            ax.plot(sign * rest[:, 1], rest[:, 2], ".", color="#dfe4ea", ms=2, zorder=0)
            drawn = ax.scatter(
                sign * place[side, 1],
                place[side, 2],
                c=size[side],
                s=14,
                cmap="magma_r",
                vmin=0.0,
                vmax=top,
            )
            ax.set_aspect("equal")
            ax.set_xticks([])
            ax.set_yticks([])
            ax.set_title(f"{self._pairs[which][0]}, {'back' if behind else 'front'}", fontsize=10)
        figure = axes[0].get_figure()
        if figure is not None:
            figure.colorbar(drawn, ax=axes, label="RMS, mm", shrink=0.8)

    def spectrum(self, axes: list[Axes]) -> None:
        """Plots power spectrum and autocorrelation of whitened marker residuals."""
        w = self._w
        for name, color, residual, _ in self._pairs:
            powers, correlations, period = [], [], 0.02
            for i, (r, s) in enumerate(
                zip(self._experiment.recordings, self._experiment.samples, strict=True)
            ):
                period = float(np.median(np.diff(r.time[s])))
                rows = (w.recording == i) & ~w.is_force
                at, index = np.unique(w.time[rows], return_inverse=True)
                grid = np.zeros((len(at), 3 * len(r.marker_rest_position)))
                axis = np.arange(len(index)) % 3
                grid[index, 3 * w.marker[rows] + axis] = residual[rows]
                transformed = np.abs(np.fft.rfft(grid, axis=0)) ** 2 / len(at)
                powers.append(transformed.mean(axis=1))
                padded = np.abs(np.fft.rfft(grid, 2 * len(at), axis=0)) ** 2
                lagged = np.fft.irfft(padded, axis=0)[: len(at)].sum(axis=1)
                correlations.append(lagged / lagged[0])
            shortest = min(len(p) for p in powers)
            frequency = np.linspace(0.0, 0.5 / period, shortest)
            mean = np.mean([p[:shortest] for p in powers], axis=0)
            axes[0].semilogy(frequency[1:], mean[1:], color=color, label=name)
            count = min(min(len(c) for c in correlations), round(1.5 / period))
            axes[1].plot(
                period * np.arange(count),
                np.mean([c[:count] for c in correlations], axis=0),
                color=color,
            )
        axes[0].axhline(1.0, color=_NOISE, ls=":")
        axes[0].set_xlabel("frequency, Hz")
        axes[0].set_ylabel("power over noise")
        axes[0].legend(frameon=False, fontsize=9)
        axes[1].axhline(0.0, color=_NOISE, ls=":")
        axes[1].set_xlabel("lag, s")
        axes[1].set_ylabel("autocorrelation")


def _effects_tried(x: Explanation) -> str:
    return _chart(
        "Share of the held-out loss that each takes away",
        "Linear screening, and a fit where it was worth one.",
        1,
        lambda axes: _scores(x, axes),
        height=0.24 * len(x.scores) + 0.8,
    )


def _scores(x: Explanation, axes: list[Axes]) -> None:
    names = [s.name.replace("_", " ") for s in x.scores][::-1]
    screened = [100.0 * max(s.screened, 0.0) for s in x.scores][::-1]
    at = np.arange(len(names))
    axes[0].barh(at, screened, color="#b0bec5", height=0.7, label="screened")
    tried = [(i, s.fitted) for i, s in enumerate(x.scores[::-1]) if s.fitted is not None]
    axes[0].barh(
        [i for i, _ in tried],
        [100.0 * max(f, 0.0) for _, f in tried],
        color=_AFTER,
        height=0.35,
        label="fitted",
    )
    axes[0].set_yticks(at, names, fontsize=8)
    axes[0].set_xlabel("share of the held-out loss, %")
    axes[0].legend(frameon=False, fontsize=9, loc="lower right")


def _chart(
    title: str,
    note: str,
    rows: int,
    draw: Callable[[list[Axes]], None],
    columns: int = 1,
    height: float | None = None,
) -> str:
    height = height or (1.5 * rows + 0.5 if columns == 1 else 3.2)
    figure, axes = chart(9.0, height, rows, columns)
    draw(axes)
    return embedded(figure, title, note)
