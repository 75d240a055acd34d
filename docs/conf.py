"""Sphinx's settings: `make docs` builds the site into build/docs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS), str(DOCS.parent)]

import generated_pages  # noqa: E402  # it is beside this file

from drake_dress import __version__  # noqa: E402

project = "drake_dress"
author = "The drake_dress authors"
release = version = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_design",
]
exclude_patterns: list[str] = []
html_theme = "furo"
html_title = f"drake_dress {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"navigation_with_keys": True}
# Texts are in UTF-8 with the signs of mathematics; straight quotes stay straight.
smartquotes = False

myst_enable_extensions = ["colon_fence", "attrs_block"]
myst_heading_anchors = 4

# Docstrings write names of code in single backticks.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
autodoc_default_options = {"members": True, "undoc-members": False, "show-inheritance": False}
python_use_unqualified_type_names = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
toc_object_entries_show_parents = "hide"

linkcheck_timeout = 20
linkcheck_retries = 2

# What is public; each has its pages of reference.
PUBLIC_MODULES = [
    "drake_dress.cloth",
]


def setup(app: Any) -> None:
    """Writes the generated pages before Sphinx looks for its sources."""
    app.connect("config-inited", lambda *_: generated_pages.write(PUBLIC_MODULES, DOCS))
