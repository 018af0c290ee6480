"""Configuration of the site: `python -m pip install -e '.[docs]' && python -m sphinx -W docs docs/_build`.

Nothing is fetched, neither here nor by a reader's browser: formulas become MathML, and the pages that the package
describes itself in (`pages.py`) are written when the build begins.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml import converter
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))

import pages

import asperity

pages.write(DOCS / pages.FOLDER)  # before the extensions look for the bibliography

project = "asperity"
author = "the asperity authors"
copyright = "the asperity authors, BSD-3-Clause"
version = release = asperity.__version__

extensions = ["myst_parser", "sphinxcontrib.bibtex", "sphinx_copybutton"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3
highlight_language = "text"
smartquotes = False  # options begin with two hyphens
bibtex_bibfiles = [f"{pages.FOLDER}/models.bib"]

html_theme = "furo"
html_title = "asperity"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False


NAME = "<mi>(?:sin|cos|ln|exp|asinh|atan2)</mi>"
FUNCTION = rf"(?:<msup>{NAME}<mn>2</mn></msup>|(?<!<msup>){NAME})"
SPACE = '<mspace width="0.17em"/>'


def mathml(node: Any, display: str) -> str:
    """A formula, with spaces around functions, and bars that do not stretch, which the converter leaves out."""
    text = converter.convert(node.astext(), display=display)
    text = re.sub(f"({FUNCTION})(?=<m(?:i|n|sub|sup|frac)>)", rf"\1{SPACE}", text)
    text = re.sub(f"(?<=</mi>|</mn>)(?={FUNCTION})", SPACE, text)
    return re.sub(
        r"<mo[^>]*>(?:&#x0007C;|&#x02223;|\|)</mo>", '<mo stretchy="false" lspace="0" rspace="0">|</mo>', text
    )


def formula_in_line(writer: Any, node: Any) -> None:
    """Write a formula within a line, as MathML."""
    writer.body.append(mathml(node, "inline"))
    raise SkipNode  # its text has been written


def formula_apart(writer: Any, node: Any) -> None:
    """Write a formula in a line of its own, as MathML."""
    writer.body.append(f'<div class="formula">{mathml(node, "block")}</div>')
    raise SkipNode


def inside(app: Sphinx, docname: str, source: list[str]) -> None:
    """Lead links to a file that the site includes to the page that includes it."""
    source[0] = source[0].replace("](../CONTRIBUTING.md)", "](contributing.md)")


def inside_included(app: Sphinx, path: Path, docname: str, source: list[str]) -> None:
    """The same in files that are included."""
    source[0] = source[0].replace("](CONTRIBUTING.md)", "](docs/contributing.md)")


def setup(app: Sphinx) -> None:
    """Register what is above."""
    app.add_html_math_renderer("mathml", (formula_in_line, None), (formula_apart, None))
    app.connect("source-read", inside)
    app.connect("include-read", inside_included)


html_math_renderer = "mathml"
