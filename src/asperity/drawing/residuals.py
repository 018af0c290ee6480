"""A fit beside its data: maps over the angles of half vector and difference, and where the residuals are."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, FigureBase

from asperity.measured import BRDF, merl

from . import comparison, style
from .comparison import Previews

BINS = 45
"""Along either angle, at most; those of θ_h are narrow at highlights, as MERL's are."""
EACH = 12
"""Pairs that a bin has on average, at least, where data are few."""


def figure(name: str, data: BRDF, values: np.ndarray, previews: Previews | None = None) -> Figure:
    """Of the data, a model's ``values`` f cosθ_o (channels, n) there, and their difference in ln(1 + f cosθ_o).

    With ``previews``, of data and model, they come below.
    """
    made = style.figure(style.PAGE, 2.5 if previews is None else 4.6)
    rows = made.subfigures(
        1 if previews is None else 2, 1, squeeze=False, height_ratios=None if previews is None else (2.5, 2.1)
    )
    maps(name, data, values, rows[0, 0])
    if previews is not None:
        comparison.pictures((data.source or "data", name), previews, rows[1, 0])
    return made


def maps(name: str, data: BRDF, values: np.ndarray, made: FigureBase) -> None:
    """Fill three axes."""
    measured = data.values.T * data.wo[:, 2]
    found = [over_angles(data, one.mean(axis=0)) for one in (measured, values)]
    difference = over_angles(data, (np.log1p(np.maximum(values, 0)) - np.log1p(np.maximum(measured, 0))).mean(axis=0))
    places = made.subplots(1, 3, sharey=True)
    norm = style.norm(found, "log")
    end = float(max(np.nanquantile(np.abs(difference), 0.98), 1e-4))
    shown = [(found[0], data.source or "data", norm, style.MAP), (found[1], name, norm, style.MAP)]
    shown.append((difference, "model less data", Normalize(-end, end), style.DIFFERENCES))
    for axes, (map, title, scale, colours) in zip(places, shown):
        edges_h, edges_d = edges(len(map.T), len(map))
        drawn = style.visible(map, norm) if scale is norm else map
        image = axes.pcolormesh(np.sqrt(edges_h), edges_d, drawn, norm=scale, cmap=colours, rasterized=True)
        ticks = np.array([0, 2, 10, 30, 60, 90])
        axes.set(title=style.wrapped(title), xlabel=r"$\theta_h$ [°]", xticks=np.sqrt(ticks), facecolor="0.85")
        axes.set_xticklabels(ticks)
        axes.set_yticks(range(0, 91, 30))
        if axes is places[1]:
            made.colorbar(image, ax=places[:2], label=style.quantity(True), fraction=0.05, pad=0.02)
    places[0].set_ylabel(r"$\theta_d$ [°]")
    label = r"difference of $\ln(1 + f\,\cos\theta_o)$"
    made.colorbar(image, ax=places[2], label=label, fraction=0.05, pad=0.02, extend="both")


def edges(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Of bins of θ_h and θ_d, in degrees."""
    return np.linspace(0, 1, columns + 1) ** 2 * 90, np.linspace(0, 90, rows + 1)


def over_angles(data: BRDF, values: np.ndarray) -> np.ndarray:
    """Means of values (n,) in bins (θ_d, θ_h); NaN where there is no pair."""
    size = int(np.clip(np.sqrt(len(data) / EACH), 4, BINS))
    theta_h, theta_d, _ = np.degrees(merl.angles(data.wi, data.wo)).T
    places = (theta_d, theta_h)
    bins = edges(size, size)[::-1]
    total, count = (np.histogram2d(*places, bins=bins, weights=w)[0] for w in (values, None))
    with np.errstate(invalid="ignore"):
        return total / count
