"""The documentation: links are valid, every page is reachable, and its examples are true.

The site itself is built by `make docs`, where every warning is an error.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from drake_dress import cloth
from drake_dress.diagrams.scenario.key_table import scenario_keys

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "reference" not in page.parts)
TEXTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES]
# Generated when the site is built.
GENERATED = {DOCS / "scenario_keys.md", DOCS / "reference" / "index.md"}
LINK = re.compile(r"\]\(([^)\s]+)\)")
TOCTREE = re.compile(r"```\{toctree\}\n(.*?)```", re.DOTALL)


def prose(path: Path) -> str:
    """Returns a page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(path: Path) -> set[str]:
    """Returns the anchors of a page's headings, as GitHub and MyST make them."""
    headings = re.findall(r"^#+ (.+)$", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


def is_generated(path: Path) -> bool:
    return path in GENERATED or path.is_relative_to(DOCS / "reference")


def names(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", TEXTS, ids=names)
def test_every_link_leads_to_a_file_or_heading_that_is_there(path: Path) -> None:
    for link in LINK.findall(prose(path)):
        if re.match(r"[a-z]+://", link):
            continue
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        if is_generated(target):
            continue
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(target), link


def test_links_are_seen() -> None:
    assert len(LINK.findall(prose(DOCS / "how_it_works.md"))) >= 12
    assert "what-to-record" in anchors(DOCS / "explain.md")


def test_every_page_is_reached_from_the_front_page() -> None:
    reached: set[Path] = set()
    waiting = [DOCS / "index.md"]
    while waiting:
        page = waiting.pop()
        if page in reached or is_generated(page):
            continue
        reached.add(page)
        for tree in TOCTREE.findall(page.read_text(encoding="utf-8")):
            for entry in re.findall(r"^[\w*/]+$", tree, re.MULTILINE):
                waiting += page.parent.glob(f"{entry}.md")
    assert reached == set(PAGES) - GENERATED


@pytest.mark.parametrize("path", TEXTS, ids=names)
def test_every_key_that_a_page_sets_is_a_key_of_a_scenario(path: Path) -> None:
    known = {key.name for key in scenario_keys()} | {"station.cameras", "lab.faults"}
    known.add("plant.material.frction")  # the mistake that first_ten_minutes.md makes
    text = path.read_text(encoding="utf-8")
    said = set(re.findall(r"--set '?([a-z_]+(?:\.[a-z_]+)+)=", text))
    # effects that the page itself defines
    own = {key for name in re.findall(r'NAME = "(\w+)"', text) for key in said if name in key}
    assert said - own <= known


@pytest.mark.parametrize("path", TEXTS, ids=names)
def test_every_example_that_a_page_names_is_there(path: Path) -> None:
    for example in re.findall(r"examples/\w+\.py", path.read_text(encoding="utf-8")):
        assert (ROOT / example).exists(), example


def generated_pages() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generated_pages", DOCS / "generated_pages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_has_a_page_for_each_public_name(tmp_path: Path) -> None:
    pages = generated_pages()
    pages.write(["drake_dress.cloth"], tmp_path)
    made = {page.stem for page in (tmp_path / "reference" / "cloth").glob("*.md")}
    assert made == set(cloth.__all__)
    table = (tmp_path / "reference" / "cloth.md").read_text(encoding="utf-8")
    assert all(f"[`{name}`](cloth/{name}.md) | " in table for name in cloth.__all__)
    assert "drake_dress.cloth" in (tmp_path / "reference" / "index.md").read_text("utf-8")


def test_pages_of_names_that_are_gone_go(tmp_path: Path) -> None:
    pages = generated_pages()
    old = tmp_path / "reference" / "cloth" / "Gone.md"
    old.parent.mkdir(parents=True)
    old.write_text("# Gone\n")
    pages.write(["drake_dress.cloth"], tmp_path)
    assert not old.exists()


def test_the_fit_of_a_drape_ends_as_its_tutorial_says() -> None:
    told = (DOCS / "tutorials" / "fit_fabric.md").read_text(encoding="utf-8")
    done = subprocess.run(
        [sys.executable, DOCS / "tutorials" / "fit_drape.py"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1]
    assert last in told
