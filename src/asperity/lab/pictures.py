"""Pictures of what a check measured: where on the sphere, and by how much."""

from __future__ import annotations

from functools import singledispatch
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from asperity.errors import ParameterError
from asperity.lab.checks import Curves, Histogram, Result, Violations

MOST_POINTS = 20_000  # more only cover each other


def write(result: Result, path: str | Path) -> None:
    """Write a PNG of what ``result`` measured."""
    figure(result).savefig(Path(path), format="png")


def figure(result: Result) -> Figure:
    """Draw what ``result`` measured."""
    if result.evidence is None:
        raise ParameterError(f"check {result.name!r} measured nothing that can be drawn")
    drawn = Figure(figsize=(12, 4.5), dpi=120, layout="constrained")
    FigureCanvasAgg(drawn)
    verdict = {True: "passed", False: "failed", None: "skipped"}[result.passed]
    drawn.suptitle(f"{result.name} {verdict}: {result.measured}", fontsize=10, wrap=True)
    plot(result.evidence, drawn)
    return drawn


@singledispatch
def plot(evidence: object, figure: Figure) -> None:
    """Plot a kind of evidence."""
    raise TypeError(f"cannot plot {type(evidence).__name__}")


@plot.register
def plot_histogram(evidence: Histogram, figure: Figure) -> None:
    """Plot counts, what the pdf expects, and their difference in standard deviations."""
    deviation = (evidence.observed - evidence.expected) / np.sqrt(np.maximum(evidence.expected, 1))
    # Lobes span decades: logarithms show their feet.
    maps = {
        "samples, log₁₀(1 + count)": (np.log10(1 + evidence.observed), "viridis", None),
        "pdf, log₁₀(1 + expected count)": (np.log10(1 + np.maximum(evidence.expected, 0)), "viridis", None),
        "difference, standard deviations": (deviation, "RdBu_r", 5),
    }
    top = max(values.max() for values, _, limit in maps.values() if limit is None)
    theta, phi = evidence.incident
    for axes, (title, (values, colours, limit)) in zip(figure.subplots(1, 3), maps.items()):
        low, high = (0, top) if limit is None else (-limit, limit)
        image = axes.imshow(values, cmap=colours, vmin=low, vmax=high, extent=(-180, 180, -1, 1), aspect="auto")
        axes.plot((phi + 180) % 360 - 180, np.cos(np.radians(theta)), "x", color="red", label="wi")
        axes.axhline(0, color="grey", linewidth=0.5)
        axes.set(title=title, xlabel="φ [°]", ylabel="cos θ")
        axes.legend(loc="lower left", fontsize=7)
        figure.colorbar(image, ax=axes)


@plot.register
def plot_violations(evidence: Violations, figure: Figure) -> None:
    """Plot where the violating directions lie, coloured by how much they violate the bound."""
    chosen = slice(None, None, max(1, len(evidence.excess) // MOST_POINTS))
    colours = np.log10(np.clip(evidence.excess[chosen], 1e-3, 1e6))
    both = figure.subplots(1, 2)
    for axes, name, w in zip(both, ("wi", "wo"), (evidence.wi[chosen], evidence.wo[chosen])):
        azimuth = np.degrees(np.arctan2(w[:, 1], w[:, 0]))
        points = axes.scatter(azimuth, w[:, 2], c=colours, s=6, cmap="magma_r", vmin=0, vmax=6)
        axes.axhline(0, color="grey", linewidth=0.5)
        axes.set(title=f"{len(evidence.excess)} violations: {name}", xlabel="φ [°]", ylabel="cos θ")
        axes.set(xlim=(-180, 180), ylim=(-1.02, 1.02))
    figure.colorbar(points, ax=both, label=f"{evidence.quantity}: log₁₀ of error / tolerance")


@plot.register
def plot_curves(evidence: Curves, figure: Figure) -> None:
    """Plot the curves over their labels."""
    axes = figure.subplots()
    for name, values in evidence.curves.items():
        axes.plot(range(len(values)), values, "o--", label=name)
    if evidence.limit is not None:
        axes.axhline(evidence.limit, color="red", linewidth=1, label="limit")
    axes.set_xticks(range(len(evidence.labels)), evidence.labels, rotation=20, ha="right", fontsize=8)
    axes.set(ylabel=evidence.quantity)
    axes.grid(alpha=0.3)
    axes.legend()
