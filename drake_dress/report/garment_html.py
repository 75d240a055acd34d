"""The page `garment.html`: drawings of a garment, its measures beside the person's, the verdict."""

from __future__ import annotations

import html
from collections.abc import Sequence

from drake_dress import __version__
from drake_dress.drawing import plain_settings
from drake_dress.models.garment.fit import Comparison, Finding
from drake_dress.report.garment_drawing import COLORS, draw_garment
from drake_dress.report.garment_look import GarmentLook
from drake_dress.report.page import embedded, html_page

_STATES = {"fits": "yes", "tight": "no", "too tight": "no", "too narrow": "no"}


@plain_settings()
def garment_page(look: GarmentLook) -> str:
    """Returns the page as HTML that needs no other file."""
    parts = [
        _verdict(look),
        f'<p class="note">{html.escape(look.name)}</p>',
        _drawings(look),
        "<h2>Measures</h2>",
        _comparisons(look.fit.comparisons),
        "<p class=\"note\">A limit is a ratio of the garment's measure to the person's. Below it, "
        "dressings in simulation took much longer or failed. Measures without a limit are not "
        "judged.</p>",
        "<h2>Size</h2>",
        f"<p>{html.escape(look.advice.sentence)}</p>",
        _list("Notes", look.fit.notes),
        "<h2>Openings</h2>",
        _loops(look),
        "<h2>Mesh</h2>",
        _mesh(look),
        "<h2>Run it</h2>",
        f"<pre>{html.escape(look.command)}</pre>",
        f"<details><summary>garment.yaml</summary><pre>{html.escape(look.scenario)}</pre>"
        "</details>",
        f'<p class="note">drake_dress {html.escape(__version__)}</p>',
    ]
    return html_page(f"Garment {look.name}", [part for part in parts if part])


def _verdict(look: GarmentLook) -> str:
    fits = look.fit.fits
    words = {True: "It fits", False: "It does not fit", None: "It cannot be judged"}
    if look.fit.impossible:
        words[False] = "It cannot go on"
    if look.fit.reasons:
        words[True] = "It is tight"
    reasons = "".join(f"<p>{html.escape(_sentence(f.text))}</p>" for f in look.fit.reasons)
    kind = "good" if fits and not look.fit.reasons else "bad"
    return f'<header class="{kind}"><h1>{words[fits]}</h1>{reasons}</header>'


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _drawings(look: GarmentLook) -> str:
    names = {
        "armhole": "armholes",
        "cuff": "cuffs",
        "other": "other openings",
        "grasp": "held by the grippers",
    }
    keys = "".join(
        f'<span class="key" style="background:{COLORS[kind]}"></span>{name}'
        for kind, name in names.items()
    )
    note = (
        f"{keys}. Dotted lines are on the far side. Behind the garment stands the "
        "person with the arms along the sleeves."
    )
    return embedded(draw_garment(look), "At rest", note)


def _comparisons(rows: Sequence[Comparison]) -> str:
    body = "".join(
        f"<tr><td>{html.escape(row.name)}</td><td>{_cm(row.garment)}</td>"
        f"<td>{html.escape(row.part)}</td><td>{_cm(row.person)}</td><td>{_ratio(row.ratio)}</td>"
        f"<td>{_limits(row)}</td>"
        f'<td class="{_STATES.get(row.state, "")}">{row.state}</td></tr>'
        for row in rows
    )
    head = "".join(
        f"<th>{name}</th>" for name in ("garment", "", "person", "", "ratio", "limits", "")
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _limits(row: Comparison) -> str:
    return f"≥ {row.limits.wanted:.2f}" if row.limits.wanted > 0.0 else ""


def _list(title: str, findings: Sequence[Finding]) -> str:
    if not findings:
        return ""
    lines = "".join(f"<li>{html.escape(_sentence(f.text))}</li>" for f in findings)
    return f"<h2>{title}</h2><ul>{lines}</ul>"


def _loops(look: GarmentLook) -> str:
    body = "".join(
        f"<tr><td>{html.escape(loop.name.replace('_', ' '))}</td><td>{_cm(loop.girth)}</td>"
        f"<td>{', '.join(f'{round(100.0 * value) + 0:d}' for value in loop.center)}</td>"
        f"<td>{len(loop.points)}</td></tr>"
        for loop in look.sizes.loops
    )
    return (
        "<table><thead><tr><th>opening</th><th>girth</th><th>centre, cm</th><th>nodes</th></tr>"
        f"</thead><tbody>{body}</tbody></table>"
        '<p class="note">The centre is forward, left and up from the point midway between the '
        "shoulder tips.</p>"
    )


def _mesh(look: GarmentLook) -> str:
    s = look.sizes
    depth, width, height = (_cm(value) for value in s.extent)
    rows = [
        ("depth, width, height", f"{depth}, {width}, {height}"),
        ("length from the shoulder tips to the hem", _cm(s.body_length)),
        ("gap between the edges of the opening at the chest", _cm(s.front_gap)),
        ("area of the cloth", f"{s.area:.2f} m²"),
        ("difference between left and right, mean", f"{1e3 * s.asymmetry:.1f} mm"),
        (
            "edges: shortest, median, longest",
            ", ".join(f"{1e3 * value:.1f} mm" for value in s.edges),
        ),
        ("nodes, triangles", f"{s.node_count:,}, {s.triangle_count:,}"),
        *(("mended", line) for line in look.mended),
    ]
    body = "".join(f"<tr><td>{name}</td><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f"<table><tbody>{body}</tbody></table>"


def _cm(length: float | None) -> str:
    return "–" if length is None else f"{100.0 * length:.1f} cm"


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
