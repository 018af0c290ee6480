"""Curves over the outgoing direction in the plane of incidence; of measurements, with error bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.materials import Material

from . import curves, style, values

STEEP = 20
"""A peak so many times the median of its curve is drawn with logarithms, if nothing is said."""


def figure(
    materials: Sequence[Material],
    *,
    theta: Sequence[float] | None = None,
    phi: float = 0.0,
    scale: str | None = None,
    cosine: bool = True,
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
) -> Figure:
    """Values over θ_o in the plane of incidence; error bars for measurements."""
    scale = scale if scale is None else style.check_scale(scale)
    channels = values.pick(values.channels(materials, wavelengths), channel)
    incident = values.incidence(materials, theta, phi)
    found = [values.in_plane(material, incident, cosine, wavelengths) for material in materials]
    cases = [rf"{style.THETA_I} = {angle:g}°" for angle, _ in incident]
    panels = curves.arrange([material.name for material in materials], cases, channels)
    made, places = style.panels(len(panels), 2.3)
    scale = scale or suited([curve.value for one in found for curve in one])
    for axes, panel in zip(places, panels):
        for line in panel.lines:
            curves.draw(axes, found[line.material][line.case], line)
        finish(axes, scale, cosine)
        for line in panel.lines if len(panels) == 1 else panel.lines[:1]:
            mark(axes, incident[line.case, 0], line.look["color"] if len(panels) == 1 else "0.5")
    return curves.finish(made, places, panels)


def suited(found: Sequence[np.ndarray]) -> str:
    """The scale on which values (channels, n) are seen."""
    lit = [value[value > 0] for value in found if (value > 0).any()]
    return "log" if any(STEEP * np.median(value) < value.max() for value in lit) else "linear"


def finish(axes: Axes, scale: str, cosine: bool) -> None:
    """Scales and labels of a slice."""
    end = 180 if np.abs(np.concatenate([line.get_xdata() for line in axes.lines])).max() > 95 else 90
    top = max(np.max(line.get_ydata(), initial=0) for line in axes.lines) or 1.0
    axes.set(xlim=(-end, end), xticks=range(-end, end + 1, end // 3), ylim=(0, 1.05 * top))
    if scale == "log":
        low = min(min((y[y > 0].min() for y in map(_heights, axes.lines) if (y > 0).any()), default=top / 10), top / 2)
        axes.set(yscale="log", ylim=(max(low, top / 10**style.DECADES), 1.5 * top))
    axes.set(xlabel=rf"{style.THETA_O} in the plane of incidence [°]", ylabel=style.quantity(cosine))
    axes.grid()


def _heights(line: Any) -> np.ndarray:
    return np.asarray(line.get_ydata(), dtype=float)


def mark(axes: Axes, theta: float, colour: Any) -> None:
    """Mark on the upper edge where light comes from (a triangle) and where a mirror would send it (a ring)."""
    across = axes.get_xaxis_transform()
    common = {"transform": across, "color": colour, "clip_on": False, "zorder": 3, "linestyle": "none"}
    axes.plot([-theta], [1.0], marker="v", markersize=3.5, **common)
    axes.plot([theta], [1.0], marker="o", markersize=3.5, markerfacecolor="white", markeredgewidth=0.7, **common)
