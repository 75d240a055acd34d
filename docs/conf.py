"""Sphinx's settings: `make docs` builds the site into build/docs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS), str(DOCS.parent)]

import generated_pages  # noqa: E402  # it is beside this file

from drake_dress import __version__  # noqa: E402
from drake_dress.models import arrays  # noqa: E402

ARRAYS = [name for name in vars(arrays) if name.endswith("Array")]

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
html_show_copyright = False
html_css_files = ["site.css"]
html_theme_options = {"navigation_with_keys": True}
# Dashes alone: straight quotes stay straight.
smartquotes_action = "D"

myst_enable_extensions = ["colon_fence", "attrs_block"]
myst_heading_anchors = 4

# Docstrings write names of code in single backticks.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
# Names of array types as the code writes them, not what they stand for.
autodoc_type_aliases = {name: name for name in ARRAYS}
maximum_signature_line_length = 88
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
    "drake_dress.control",
    "drake_dress.dressing",
    "drake_dress.explain",
    "drake_dress.gym",
]


def setup(app: Any) -> None:
    """Writes the generated pages before Sphinx looks for its sources."""
    app.connect("config-inited", lambda *_: generated_pages.write(PUBLIC_MODULES, DOCS))
    app.connect("autodoc-process-signature", _plain_aliases)
    app.connect("autodoc-process-docstring", _literal_blocks, priority=100)  # before napoleon


def _plain_aliases(*event: Any) -> tuple[str | None, str | None]:
    """Returns a signature with the names of type aliases that Sphinx leaves wrapped in unions."""
    pattern = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")
    signature, returned = (text and pattern.sub(r"\1", text) for text in event[-2:])
    return signature, returned


def _literal_blocks(*event: Any) -> None:
    """Marks indented code and equations of a docstring, so that they are not taken for quotes."""
    lines: list[str] = event[-1]
    for i in range(len(lines) - 1, 1, -1):
        begins = lines[i].startswith("    ") and not lines[i - 1].strip()
        if begins and lines[i - 2].strip() and not lines[i - 2].startswith(" "):
            lines[i:i] = ["::", ""]
