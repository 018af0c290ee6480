"""What the curves of a figure stand for: materials, cases (such as angles of incidence) and channels.

One material in one channel: one diagram, a colour for each case. Otherwise a diagram for each case, a colour for each
material; or, of several channels, their colours, and dashes for the materials.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from . import style
from .values import Curve, one

FEW = 20
"""Measured points that are drawn larger."""


class Line(NamedTuple):
    """Indices of a material, a case and a channel (None: their mean), and how that is drawn."""

    material: int
    case: int
    channel: int | None
    look: dict[str, Any]


class Panel(NamedTuple):
    """A diagram."""

    title: str
    lines: list[Line]


def arrange(names: Sequence[str], cases: Sequence[str], channels: Sequence[tuple[str, int | None]]) -> list[Panel]:
    """Panels of lines, for materials and cases by name, and channels as `values.pick` gives them."""
    if len(names) == len(channels) == 1:
        looks = zip(cases, style.sequence(len(cases)))
        lines = [Line(0, n, channels[0][1], {"label": case, "color": colour}) for n, (case, colour) in enumerate(looks)]
        return [Panel(names[0], lines)]
    several = len(channels) > 1

    def look(material: int, channel: int) -> dict[str, Any]:
        label = names[material] if not several else channels[channel][0]
        if several and len(names) > 1:
            label = f"{names[material]}, {label}"
        if not several:
            return {"label": label, "color": style.MATERIALS[material % len(style.MATERIALS)]}
        colours = [style.CHANNELS.get(name) for name, _ in channels]
        colour = colours[channel] or style.sequence(len(channels))[channel]
        return {"label": label, "color": colour, "linestyle": style.DASHES[material % len(style.DASHES)]}

    return [
        Panel(case, [Line(m, n, index, look(m, c)) for m in range(len(names)) for c, (_, index) in enumerate(channels)])
        for n, case in enumerate(cases)
    ]


def draw(axes: Axes, curve: Curve, line: Line) -> None:
    """Draw a curve; what was measured, as points with their standard errors."""
    value = one(curve.value, line.channel)
    if curve.error is None:
        axes.plot(curve.x, value, **line.look)
        return
    # Of a mean, as if channels were one: they see the same paths, so that their errors go together.
    error = one(curve.error, line.channel)
    look = {name: what for name, what in line.look.items() if name != "linestyle"}
    axes.errorbar(
        curve.x,
        value,
        error,
        **look,
        linestyle="none",
        marker=style.MARKERS[line.material % len(style.MARKERS)],
        markersize=2 if len(curve.x) > FEW else 3.5,
        markeredgewidth=0,
        elinewidth=0.6,
        capsize=1.2,
        capthick=0.6,
    )


def finish(made: Figure, axes: Sequence[Axes], panels: Sequence[Panel]) -> Figure:
    """Titles and the legend."""
    for place, panel in zip(axes, panels):
        place.set_title(style.wrapped(panel.title))
    style.legend(made, axes)
    return made
