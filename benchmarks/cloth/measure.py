"""Steps engines alternately and records their times, positions and contact.

The compared engines advance in turns of equal simulated time, so that other load on the machine
affects all of them alike. Tables show medians of step times; ratios are medians over turns of the
ratio within a turn.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.engines import Engine, Recipe
from benchmarks.cloth.scene import Scene
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements

# Interval of recorded positions, and duration of a turn, s.
SAMPLE_INTERVAL = 0.1
# Distance from the origin above which a garment counts as exploded, m.
_FAR = 20.0


@dataclass
class Session:
    """Settings of a benchmark run, common to all scenes.

    Attributes:
        quick: Whether to use small meshes and short times.
        limit: Wall time after which an engine's run is cut short, s.
        cache: Folder of references; None to omit distances to them.
        say: Prints a line of progress.
        stop: Set by Ctrl-C; measurements up to then count.
        engines: Substrings of the names of the engines to compare; empty for all.
    """

    quick: bool = False
    limit: float = 10.0
    cache: Path | None = Path("out/cloth_bench")
    say: Callable[[str], None] = print
    stop: threading.Event = field(default_factory=threading.Event)
    engines: tuple[str, ...] = ()

    def wants(self, name: str) -> bool:
        """Returns whether to measure an engine."""
        return not self.engines or any(part in name for part in self.engines)


@dataclass
class Run:
    """One engine on one scene at one time step.

    Attributes:
        name: Name of the engine.
        time_step: h, s.
        setup: Wall time of its creation, s; first_step: Wall time of its first step, which
            compiles, s.
        step_time: (steps,) wall times of the other steps, s.
        contact: (steps,) number of nodes in contact after each step.
        turn_mean: Mean step time of each turn, s; nan if it did not take part.
        final: (n,3) positions at the time reached, m.
        sample: Multiple of SAMPLE_INTERVAL → (n,3) positions, m.
        exploded: Simulated time at which it was not finite or metres away, s; None if never.
        reached: Simulated time reached, s.
        unconverged: Number of steps whose solver did not converge, if the engine reports it.
    """

    name: str
    time_step: float
    setup: float = 0.0
    first_step: float = 0.0
    step_time: list[float] = field(default_factory=list)
    contact: list[int] = field(default_factory=list)
    turn_mean: list[float] = field(default_factory=list)
    final: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    sample: dict[int, FloatArray] = field(default_factory=dict)
    exploded: float | None = None
    reached: float = 0.0
    unconverged: int = 0

    def median(self) -> float:
        """Returns the median wall time of a step, s; nan without steps."""
        times = self.step_time or ([self.first_step] if self.first_step else [])
        return float(np.median(times)) if times else float("nan")

    def worst(self) -> float:
        """Returns the largest wall time of a step except the first, s."""
        return max(self.step_time, default=float("nan"))

    def spread(self) -> float:
        """Returns the interquartile range of the step times divided by their median."""
        if len(self.step_time) < 4:
            return float("nan")
        low, high = np.percentile(self.step_time, (25, 75))
        return float((high - low) / self.median())

    def summary(self) -> dict[str, Any]:
        """Returns the figures of the run for JSON."""
        return {
            "engine": self.name,
            "time_step_s": self.time_step,
            "setup_s": self.setup,
            "first_step_s": self.first_step,
            "step_median_s": self.median(),
            "step_worst_s": self.worst(),
            "step_spread": self.spread(),
            "steps": len(self.step_time) + (self.first_step > 0.0),
            "wall_per_simulated_s": self.median() / self.time_step,
            "reached_s": self.reached,
            "exploded_s": self.exploded,
            "unconverged_steps": self.unconverged,
        }


def race(session: Session, scene: Scene, recipes: Sequence[Recipe], time_step: float) -> list[Run]:
    """Returns the runs of the engines over the scene's duration, in the order of `recipes`.

    An engine that is not available is reported and gives no run. One that was interrupted before
    its first step gives no run, either.
    """
    runs: list[Run] = []
    engines: list[Engine] = []
    for recipe in recipes:
        if session.stop.is_set():
            break
        missing = recipe.missing()
        if missing:
            session.say(f"  {recipe.name}: skipped, {missing}")
            continue
        begin = time.perf_counter()
        engine = recipe.make(scene, time_step)
        runs.append(Run(recipe.name, time_step, setup=time.perf_counter() - begin))
        runs[-1].sample[0] = engine.positions().copy()
        engines.append(engine)
    steps = round(scene.duration / time_step)
    stretch = max(1, round(SAMPLE_INTERVAL / time_step))
    for first in range(0, steps, stretch):
        for run, engine in zip(runs, engines, strict=True):
            _turn(session, scene, run, engine, range(first, min(first + stretch, steps)))
        if session.stop.is_set():
            break
    begun = [run for run in runs if run.first_step > 0.0]
    for run in begun:
        session.say(_line(run, scene))
    return begun


def _turn(session: Session, scene: Scene, run: Run, engine: Engine, steps: range) -> None:
    """Advances one engine by one turn and records it in its run."""
    h = run.time_step
    taken: list[float] = []
    for step in steps:
        if run.exploded is not None or sum(run.step_time) > session.limit or session.stop.is_set():
            break
        held = scene.motion((step + 1) * h)
        begin = time.perf_counter()
        engine.step(held)
        elapsed = time.perf_counter() - begin
        if run.first_step == 0.0:
            run.first_step = elapsed
        else:
            run.step_time.append(elapsed)
            taken.append(elapsed)
        x = engine.positions()
        run.reached = (step + 1) * h
        run.final = x.copy()
        if not np.isfinite(x).all() or np.abs(x).max() > _FAR:
            run.exploded = run.reached
            break
        if scene.obstacles.count:
            run.contact.append(int(np.count_nonzero(scene.touching(x))))
        multiple = round(run.reached / SAMPLE_INTERVAL)
        if abs(run.reached - multiple * SAMPLE_INTERVAL) < 0.25 * h:
            run.sample[multiple] = x.copy()
    run.turn_mean.append(float(np.mean(taken)) if taken else float("nan"))
    run.unconverged = int(getattr(engine, "unconverged", 0))


def _line(run: Run, scene: Scene) -> str:
    end = f"exploded at {run.exploded:.2f} s" if run.exploded is not None else ""
    if run.exploded is None and run.reached < scene.duration - 1e-9:
        end = f"cut at {run.reached:.2f} s"
    return (
        f"  {run.name:24s} h {1e3 * run.time_step:5.4g} ms: {1e3 * run.median():8.3f} ms a step"
        f"  {end}"
    ).rstrip()


def ratio(run: Run, to: Run, last: int = 0) -> float:
    """Returns the step time of `run` divided by that of `to`, median over turns.

    If `last` is not 0, only the last `last` turns count.
    """
    count = min(len(run.turn_mean), len(to.turn_mean))
    both = np.array(run.turn_mean[:count]) / np.array(to.turn_mean[:count])
    both = both[-last:]
    both = both[np.isfinite(both)]
    return float(np.median(both)) if len(both) else float("nan")


def edge_strain(x: FloatArray, elements: Elements) -> float:
    """Returns the 99th percentile of |strain| over the edges of `x` (n,3)."""
    length = np.linalg.norm(x[elements.edge[:, 1]] - x[elements.edge[:, 0]], axis=1)
    strain = np.abs(length / elements.edge_rest_length - 1.0)
    return float(np.percentile(strain, 99.0)) if np.isfinite(strain).all() else float("inf")
