"""Polar plots in the plane of incidence: the radius is the value towards that direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.materials import Material

from . import curves, style, values
from .values import Curve

RAYS = (-90, -60, -30, 0, 30, 60, 90)
"""Degrees from the normal that are marked."""


def figure(
    materials: Sequence[Material],
    *,
    theta: Sequence[float] | None = None,
    phi: float = 0.0,
    scale: str = "linear",
    cosine: bool = True,
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
) -> Figure:
    """Polar plot in the plane of incidence, at several angles of incidence."""
    style.check_scale(scale)
    channels = values.pick(values.channels(materials, wavelengths), channel)
    incident = values.incidence(materials, theta, phi)
    found = [values.in_plane(material, incident, cosine, wavelengths) for material in materials]
    below = any(values.transmits(material) for material in materials)
    cases = [rf"{style.THETA_I} = {angle:g}°" for angle, _ in incident]
    panels = curves.arrange([material.name for material in materials], cases, channels)
    made, places = style.panels(len(panels), (2.0, 3.3)[below] if len(panels) == 1 else (1.6, 2.6)[below])
    for axes, panel in zip(places, panels):
        drawn = [found[line.material][line.case] for line in panel.lines]
        top = max(values.one(curve.value, line.channel).max() for curve, line in zip(drawn, panel.lines))
        radius = Radius(top, scale)
        grid(axes, radius, below)
        for curve, line in zip(drawn, panel.lines):
            draw(axes, curve, radius, line)
        for line in panel.lines if len(panels) == 1 else panel.lines[:1]:
            light(axes, incident[line.case, 0], line.look["color"] if len(panels) == 1 else "0.3")
    places[0].text(-1, -0.03, style.quantity(cosine), fontsize=6, color="0.35", ha="left", va="top")
    return curves.finish(made, places, panels)


class Radius:
    """Which radius, 1 at most, stands for a value."""

    def __init__(self, top: float, scale: str):
        self.top, self.log = top or 1.0, scale == "log"
        decade = int(np.floor(np.log10(self.top)))
        self.low = 10.0 ** (decade + 1 - style.DECADES)

    def __call__(self, value: Any) -> Any:
        """The radius of values; those below the lowest decade are at the centre."""
        if not self.log:
            return np.asarray(value) / self.top
        return np.log(np.maximum(value, self.low) / self.low) / np.log(max(self.top, 2 * self.low) / self.low)

    def ticks(self) -> list[float]:
        """Values of rings."""
        if self.log:
            return [self.low * 10.0**n for n in range(1, style.DECADES) if self.low * 10.0**n <= self.top * 1.001]
        return [tick for tick in MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(0, self.top) if 0 < tick <= self.top]


def draw(axes: Axes, curve: Curve, radius: Radius, line: curves.Line) -> None:
    """Draw a curve in the plane: x to the side that a mirror would send light to, y along the normal."""
    value, sin, cos = values.one(curve.value, line.channel), np.sin(np.radians(curve.x)), np.cos(np.radians(curve.x))
    r = radius(value)
    if curve.error is None:
        axes.plot(r * sin, r * cos, **line.look)
        return
    colour, error = line.look["color"], values.one(curve.error, line.channel)
    ends = radius(np.stack([value - error, value + error]))
    axes.plot(ends * sin, ends * cos, color=colour, linewidth=0.6, zorder=3)
    marker = style.MARKERS[line.material % len(style.MARKERS)]
    look = {"label": line.look["label"], "markersize": 2, "markeredgewidth": 0, "zorder": 3}
    axes.plot(r * sin, r * cos, marker, color=colour, **look)


def grid(axes: Axes, radius: Radius, below: bool) -> None:
    """Rings with their values, rays with their angles, the surface."""
    end = 180 if below else 90
    around = np.radians(np.linspace(-end, end, 361))
    axes.set(aspect="equal", xlim=(-1.27, 1.27), ylim=(-1.2 if below else -0.17, 1.2))
    axes.set_axis_off()
    faint = {"color": "0.82", "linewidth": 0.5, "zorder": 0}
    for tick in radius.ticks():
        r = float(radius(tick))
        axes.plot(r * np.sin(around), r * np.cos(around), **faint)
        place = {"fontsize": 6, "color": "0.35", "zorder": 1}
        axes.text(r, -0.03, f"{tick:.2g}", ha="center", va="top", **place, bbox=_blank() if below else None)
    for angle in (*RAYS, *((-150, -120, 120, 150, 180) if below else ())):
        x, y = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        axes.plot([0, x], [0, y], **faint)
        axes.text(1.1 * x, 1.1 * y, f"{angle}°", fontsize=6, color="0.35", ha="center", va="center")
    axes.plot(np.sin(around), np.cos(around), color="0.82", linewidth=0.5, zorder=0)
    axes.plot([-1, 1], [0, 0], color="0.2", linewidth=0.9, zorder=1)


def _blank() -> dict[str, Any]:
    return {"facecolor": "white", "edgecolor": "none", "pad": 0.4}


def light(axes: Axes, theta: float, colour: Any) -> None:
    """An arrow from where light comes."""
    x, y = -np.sin(np.radians(theta)), np.cos(np.radians(theta))
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
    axes.annotate("", (0.78 * x, 0.78 * y), (0.98 * x, 0.98 * y), arrowprops=look, zorder=4)
