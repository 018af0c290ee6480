"""How all figures look: widths of a paper's columns, type, colours, scales, labels."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure, FigureBase

from asperity.errors import UnknownNameError
from asperity.files import atomically

COLUMN, PAGE = 3.35, 7.0
"""Inches: one column of a paper (8.5 cm), and both."""
SCALES = ("linear", "log")
DECADES = 4
"""Below the largest value: what is less is not told apart on logarithmic scales."""

LEAST = 0.02
"""Share of the values in a map that may lie below its logarithmic scale."""
MAP, ERRORS, DIFFERENCES = "viridis", "magma", "RdBu_r"
"""Colour maps, uniform to the eye: of values, of errors from zero on, of differences about zero."""
MATERIALS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
"""Okabe and Ito's colours, which the colour-blind tell apart."""
CHANNELS = {"R": "#c1272d", "G": "#2e8b57", "B": "#2858a8", "Y": "#333333"}
DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1.2)), (0, (5, 1.2, 1, 1.2)))
MARKERS = "osD^vP"
RULES = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "grid.linewidth": 0.4,
    "grid.alpha": 0.35,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "pdf.fonttype": 42,  # type that journals accept, and that stays text
    "svg.fonttype": "none",
    "axes.formatter.use_mathtext": True,
}

THETA_I, THETA_O = r"$\theta_i$", r"$\theta_o$"
LIGHT = "#d62728"
"""Of the marks where light comes from, and where a mirror would send it."""


def quantity(cosine: bool) -> str:
    """The label of what is drawn."""
    return r"$f\,\cos\theta_o$ [1/sr]" if cosine else r"$f$ [1/sr]"


@contextmanager
def applied() -> Iterator[None]:
    """Let Matplotlib draw in this style."""
    with mpl.rc_context(RULES):
        yield


def figure(width: float, height: float) -> Figure:
    """An empty figure of this size in inches, which belongs to no window."""
    made = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(made)
    return made


def panels(count: int, height: float, columns: int = 3, **options: Any) -> tuple[Figure, list[Axes]]:
    """A figure with ``count`` diagrams: one column of a paper wide if it is one, else a page.

    ``height`` is that of a row in inches; ``options`` are those of `Figure.subplots`.
    """
    columns = min(count, columns)
    rows = -(-count // columns)
    made = figure(COLUMN if count == 1 else PAGE, height * rows)
    grid = made.subplots(rows, columns, squeeze=False, **options).ravel()
    for axes in grid[count:]:
        axes.set_visible(False)
    return made, list(grid[:count])


def save(made: Figure, path: Path) -> None:
    """Write a figure: PNG of 300 dots an inch, PDF or SVG, by the ending; whole, or not at all."""
    with applied(), atomically(path) as part:
        made.savefig(part, dpi=300)


def sequence(count: int) -> list[Any]:
    """Colours in an order, dark to light, legible on white."""
    return list(mpl.colormaps[MAP](np.linspace(0.05, 0.8, max(count, 2))[:count]))


def legend(made: FigureBase, axes: Sequence[Axes]) -> None:
    """Name the lines of all diagrams once, below them; nothing if there is but one."""
    named: dict[str, Any] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels()):
            named.setdefault(label, handle)
    if len(named) > 1:
        widest = max(len(re.sub(r"\$.*?\$", "x", name)) for name in named)
        columns = max(1, int(made.bbox.width / made.dpi * 14 / (widest + 5)))
        made.legend(named.values(), named.keys(), loc="outside lower center", ncols=min(columns, len(named)))


def wrapped(title: str, width: int = 34) -> str:
    """A title in lines of so many letters, where a formula counts as one; names stay with their values."""
    short = re.sub(r"\$.*?\$", "x", title)
    return title if len(short) <= width else fill(title.replace(" = ", "\u00a0=\u00a0"), width)


def check_scale(scale: str) -> str:
    """The scale, if it is one; else raise UnknownNameError."""
    if scale not in SCALES:
        raise UnknownNameError("scale", scale, SCALES)
    return scale


def norm(maps: Sequence[np.ndarray], scale: str, quantile: float = 1.0) -> Normalize:
    """Maps values to [0, 1] for a colour map, the ``quantile`` of them to 1; NaN is left out.

    Logarithms begin `DECADES` below that, or higher, where the least percents of the values are.
    """
    values = np.concatenate([one[np.isfinite(one)] for one in maps])
    positive = values[values > 0]
    high = float(np.quantile(positive, quantile)) if len(positive) else 1.0
    if check_scale(scale) == "linear":
        return Normalize(0, high)
    low = float(np.quantile(positive, LEAST)) if len(positive) else high / 10
    return LogNorm(max(min(low, high / 2), high / 10**DECADES), high)


def visible(values: np.ndarray, scale: Normalize) -> np.ndarray:
    """The values, what is too small for the scale, zeros too, moved to its end; NaN stays."""
    return np.maximum(values, scale.vmin)
