"""The two comparisons made for every moving scene.

Over time steps: the distance of each scheme to the fine reference over time, and the cost of a
simulated second. Against peers: the cost of a step compared with other simulators, and the quality
of the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.cloth.engines import Recipe, explicit_bias, implicit, projective_dynamics
from benchmarks.cloth.figures import Line, Panel
from benchmarks.cloth.measure import (
    SAMPLE_INTERVAL,
    Run,
    Session,
    edge_strain,
    race,
    ratio,
)
from benchmarks.cloth.peers import mujoco_flex, newton_style3d, newton_vbd
from benchmarks.cloth.reference import STIFF_FROM, Reference, fine_reference
from benchmarks.cloth.scene import Scene
from benchmarks.cloth.table import Table, milliseconds
from benchmarks.figures import Figure, at_most
from drake_dress.drawing import load_matplotlib

Result = dict[str, Any]

# Inner iterations of the accelerated scheme, in addition to the paper's single one.
_MORE_ITERATIONS = (5, 20)
# Peers run at one time step only, with a time limit longer by this factor.
_PEER_PATIENCE = 3.0
# Names of engines begin so: MuJoCo's flex, and the schemes of this package.
_MUJOCO = "MuJoCo"
_OWN = ("explicit", "implicit", "projective")
# Share of MuJoCo's time that a step of a scheme as accurate may take.
_ASKED_BESIDE_MUJOCO = 0.1


def own_recipes() -> list[Recipe]:
    """Returns this package's schemes, the controller's first."""
    return [
        explicit_bias(1),
        *(explicit_bias(count) for count in _MORE_ITERATIONS),
        implicit(),
        projective_dynamics(),
        projective_dynamics(quasi_newton=True),
    ]


def _recipes_beside_peers(scene: Scene) -> list[Recipe]:
    """Returns the schemes for a table with peers.

    Projective Dynamics is omitted for a stiff fabric: with 6,168 nodes, a step of 10 ms did not
    converge in its 5,000 iterations, which take longer than all other engines together.
    """
    own = own_recipes()
    if scene.material.stretch_stiffness > STIFF_FROM:
        own = [recipe for recipe in own if not recipe.name.startswith("projective")]
    return [*own, *peer_recipes(bool(scene.obstacles.count))]


def peer_recipes(contact: bool) -> list[Recipe]:
    """Returns the other simulators in their fastest stable settings."""
    peers = [mujoco_flex.recipe()]
    if contact:
        peers.append(mujoco_flex.recipe(passive=True))
    return [*peers, newton_style3d.recipe(1), newton_style3d.recipe(10), newton_vbd.recipe()]


def over_steps(
    session: Session,
    scene: Scene,
    time_steps: Sequence[float],
    recipes: Sequence[Recipe] | None = None,
    accuracy: bool = True,
) -> Result:
    """Returns cost and distance to the fine reference of each scheme at each time step.

    Args:
        session: Session of the benchmark.
        scene: Scene to simulate.
        time_steps: Time steps, s.
        recipes: Recipes of the schemes; None for all of this package.
        accuracy: Whether to compare with a fine reference.
    """
    session.say(f"{scene.name}: {len(scene.position)} nodes, {scene.duration:g} s")
    reference = fine_reference(session, scene) if accuracy else None
    chosen = [r for r in recipes or own_recipes() if session.wants(r.name)]
    rows: list[Result] = []
    for h in time_steps:
        if session.stop.is_set() or not chosen:
            break
        for run in race(session, scene, chosen, h):
            rows.append(run.summary() | _accuracy(run, scene, reference) | _contact(run, scene))
    return {
        "scene": scene.name,
        "nodes": len(scene.position),
        "duration_s": scene.duration,
        "material": _material(scene),
        "reference": None
        if reference is None
        else {"engine": reference.engine, "time_step_s": reference.time_step},
        "runs": rows,
    }


def _accuracy(run: Run, scene: Scene, reference: Reference | None) -> Result:
    """Returns the distances to the reference.

    An incomplete run has neither mean nor maximum: distances grow with time, so it would seem
    better than complete runs.
    """
    distance = [] if reference is None else reference.distance(run)
    away = [d for _, d in distance[1:]]
    complete = bool(away) and run.exploded is None and run.reached > scene.duration - 1e-9
    return {
        "distance_m": distance,
        "distance_mean_m": float(np.mean(away)) if complete else None,
        "distance_max_m": max(away) if complete else None,
        "distance_end_m": away[-1] if away else None,
    }


def _contact(run: Run, scene: Scene) -> Result:
    """Returns the cost of steps in contact, for scenes with contact.

    These are the steps from the first one with a node in contact to the first one with the run's
    largest number of contacts, which is all nodes if a garment comes to lie flat.
    """
    if not run.contact:
        return {}
    # Aligned at the end: the first step, which compiles, is not timed.
    count = min(len(run.contact), len(run.step_time))
    contact = np.array(run.contact[-count:]) if count else np.zeros(0, dtype=int)
    cost = np.array(run.step_time[-count:]) if count else np.zeros(0)
    n = len(scene.position)
    touched = np.flatnonzero(contact > 0)
    result: Result = {
        "contact_most": int(max(run.contact)),
        "contact_most_share": max(run.contact) / n,
        "step_in_contact_s": None,
        "step_in_contact_worst_s": None,
        "step_at_most_contact_s": None,
        "penetration_m": scene.penetration(run.final) if run.exploded is None else None,
    }
    if len(touched):
        first, full = touched[0], int(np.argmax(contact))
        part = cost[first : full + 1]
        most = contact >= 0.98 * contact.max()
        result["step_in_contact_s"] = float(np.median(part))
        result["step_in_contact_worst_s"] = float(cost[first:].max())
        result["step_at_most_contact_s"] = float(np.median(cost[most]))
    return result


def against_peers(
    session: Session, scene: Scene, time_step: float, settle: float, accuracy: bool = True
) -> Result:
    """Returns cost and quality of own schemes and peers at one time step.

    Args:
        session: Session of the benchmark.
        scene: Scene to simulate.
        time_step: Time step, s.
        settle: Time at which the mean height is reported, s.
        accuracy: Whether to compare with a fine reference.
    """
    h = time_step
    session.say(f"{scene.name}: {len(scene.position)} nodes, {scene.duration:g} s, peers")
    reference = fine_reference(session, scene) if accuracy else None
    chosen = [r for r in _recipes_beside_peers(scene) if session.wants(r.name)]
    patient = replace(session, limit=_PEER_PATIENCE * session.limit)
    runs = race(patient, scene, chosen, h)
    elements = scene.elements()
    rows: list[Result] = []
    index = round(settle / SAMPLE_INTERVAL)
    for run in runs:
        at = run.sample.get(index)
        rows.append(
            run.summary()
            | {
                "ratio_to_first": ratio(run, runs[0]),
                "edge_strain": edge_strain(run.final, elements),
                "height_m": None if at is None else float(at[:, 2].mean()),
            }
            | _accuracy(run, scene, reference)
            | _contact(run, scene)
        )
    limit = None
    if reference is not None and index in reference.sample:
        limit = float(reference.sample[index][:, 2].mean())
    return {
        "scene": scene.name,
        "nodes": len(scene.position),
        "duration_s": scene.duration,
        "material": _material(scene),
        "time_step_s": h,
        "height_at_s": settle,
        "height_limit_m": limit,
        "reference": None
        if reference is None
        else {"engine": reference.engine, "time_step_s": reference.time_step},
        "runs": rows,
    }


def _material(scene: Scene) -> Result:
    m = scene.material
    return {
        "surface_density_kg_m2": m.surface_density,
        "stretch_N_m": m.stretch_stiffness,
        "bending_N_m": m.bending_stiffness,
        "friction": m.friction,
    }


def steps_table(result: Result) -> Table:
    """Returns the table of `over_steps`."""
    contact = any("contact_most" in run for run in result["runs"])
    header = [
        "engine",
        "h ms",
        "step ms",
        "spread",
        "s per s",
        "mean cm",
        "most cm",
        "end cm",
        "to s",
    ]
    if contact:
        header += ["touching ms", "worst ms", "most contact ms", "nodes touching %", "inside mm"]
    rows = []
    for run in sorted(result["runs"], key=lambda r: r["engine"]):
        row = [
            run["engine"],
            f"{1e3 * run['time_step_s']:g}",
            milliseconds(run["step_median_s"]),
            run["step_spread"],
            run["wall_per_simulated_s"],
            *(_centi(run[key]) for key in ("distance_mean_m", "distance_max_m", "distance_end_m")),
            _end(run),
        ]
        if contact:
            row += _contact_cells(run)
        rows.append(row)
    away = f"; distances to the fine reference{_reference(result)}" if result["reference"] else ""
    title = f"{_title(result)}{away}"
    return Table(title, header, rows)


def peers_table(result: Result) -> Table:
    """Returns the table of `against_peers`."""
    contact = any("contact_most" in run for run in result["runs"])
    header = [
        "engine",
        "step ms",
        "ratio",
        "spread",
        "strain %",
        "height m",
        "mean cm",
        "end cm",
        "to s",
    ]
    if contact:
        header += ["touching ms", "worst ms", "most contact ms", "nodes touching %", "inside mm"]
    rows = []
    for run in result["runs"]:
        row = [
            run["engine"],
            milliseconds(run["step_median_s"]),
            run["ratio_to_first"],
            run["step_spread"],
            100.0 * run["edge_strain"],
            None if run["height_m"] is None else f"{run['height_m']:.4f}",
            _centi(run["distance_mean_m"]),
            _centi(run["distance_end_m"]),
            _end(run),
        ]
        if contact:
            row += _contact_cells(run)
        rows.append(row)
    limit = result["height_limit_m"]
    height = "" if limit is None else f", {limit:.4f} m for h → 0"
    title = (
        f"{_title(result)}, h = {1e3 * result['time_step_s']:g} ms; 99 % edge strain, mean height "
        f"after {result['height_at_s']:g} s{height}{_reference(result)}"
    )
    return Table(title, header, rows)


def figures_beside_peers(scenes: Result) -> list[Figure]:
    """Returns what a step of each own scheme takes beside MuJoCo's, in every scene with peers.

    Where cloth touches, the median from the first contact to the largest is compared.

    Args:
        scenes: results of scenes by name.
    """
    found = []
    for compared in _beside_peers(scenes):
        touching = any("contact_most" in run for run in compared["runs"])
        key = "step_in_contact_s" if touching else "step_median_s"
        theirs = [run[key] for run in compared["runs"] if run["engine"].startswith(_MUJOCO)]
        if not theirs or not theirs[0]:
            continue
        for run in compared["runs"]:
            if run["engine"].startswith(_OWN) and run[key]:
                name = f"{compared['scene']}: {run['engine']}, a step beside MuJoCo's"
                found.append(at_most(name, run[key] / theirs[0], "", _ASKED_BESIDE_MUJOCO))
    return found


def _beside_peers(results: Any) -> Iterator[Result]:
    """Yields the results of `against_peers`, wherever they are."""
    if isinstance(results, dict):
        if "height_at_s" in results:
            yield results
        else:
            for inner in results.values():
                yield from _beside_peers(inner)


def _contact_cells(run: Result) -> list[Any]:
    share, inside = run.get("contact_most_share"), run.get("penetration_m")
    return [
        milliseconds(run.get("step_in_contact_s")),
        milliseconds(run.get("step_in_contact_worst_s")),
        milliseconds(run.get("step_at_most_contact_s")),
        None if share is None else 100.0 * share,
        None if inside is None else 1e3 * inside,
    ]


def _centi(value: float | None) -> float | None:
    return None if value is None else 100.0 * value


def _end(run: Result) -> str:
    if run["exploded_s"] is not None:
        return f"exploded {run['exploded_s']:.2f}"
    failed = f", {run['unconverged_steps']} unconverged" if run["unconverged_steps"] else ""
    return f"{run['reached_s']:.2f}{failed}"


def _title(result: Result) -> str:
    m = result["material"]
    return (
        f"{result['scene']}: {result['nodes']} nodes, {m['surface_density_kg_m2']:g} kg/m², "
        f"stretch {m['stretch_N_m']:g} N/m, bending {m['bending_N_m']:g} N·m"
    )


def _reference(result: Result) -> str:
    if result["reference"] is None:
        return ""
    r = result["reference"]
    return f" ({r['engine']} at {1e3 * r['time_step_s']:g} ms)"


# Matplotlib colour maps of the engines; light to dark is small to large time step, as in the paper.
_MAPS = ("Blues", "Purples", "Greens", "Reds", "Oranges", "Greys")


def steps_panels(result: Result) -> list[Panel]:
    """Returns the pair of plots as in the paper: distance over time, cost of a simulated second."""
    load_matplotlib()
    from matplotlib import colormaps

    engines = list(dict.fromkeys(run["engine"] for run in result["runs"]))
    steps = sorted({1e3 * run["time_step_s"] for run in result["runs"]})
    shades = f"light to dark: h = {', '.join(f'{h:g}' for h in steps)} ms"
    distances, costs = [], []
    for engine, name in zip(engines, _MAPS, strict=False):
        runs = [run for run in result["runs"] if run["engine"] == engine]
        for k, run in enumerate(runs):
            shade = colormaps[name](0.35 + 0.6 * k / max(1, len(runs) - 1))
            # one legend entry per engine; the title explains the shades
            label = engine if k == len(runs) - 1 else "_nolegend_"
            if run["distance_m"]:
                time, distance = zip(*run["distance_m"], strict=True)
                distances.append(Line(time, distance, label, color=shade))
        costs.append(
            Line(
                [run["time_step_s"] for run in runs],
                [run["wall_per_simulated_s"] for run in runs],
                engine,
                marker="o",
                color=colormaps[name](0.8),
            )
        )
    return [
        Panel(f"mean distance to the fine reference\n{shades}", "time, s", "m", distances),
        Panel("cost of one simulated second", "time step, s", "s", costs, log=True),
    ]
