"""Two materials side by side: maps, their relative difference, slices, albedos, and the previews with theirs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from asperity.goniophotometer import Hemisphere, against
from asperity.lab import compare as lab_compare
from asperity.lab.compare import FAINT, Comparison
from asperity.materials import Material

from . import curves, hemisphere, slices, style, values

ANGLES = (0.0, 30.0, 60.0)
"""Of incidence, in degrees; the second is that of the maps. Of measurements, they are among what was measured."""


class Previews(NamedTuple):
    """Renders (height, width, 3) of two materials in sRGB, their difference, and FLIP's map, (height, width) each."""

    a: np.ndarray
    b: np.ndarray
    difference: np.ndarray
    flip: np.ndarray | None


def compare(a: Material, b: Material, names: Sequence[str]) -> Comparison:
    """Compare two materials, the first of which is the reference; a measurement, in its own directions.

    Raises ParameterError if that makes no sense.
    """
    if a.measured is not None:
        return against.against(a.measured, b.load() if b.measured is None else b.measured)
    if b.measured is not None:
        return against.swapped(against.against(b.measured, a.load()))
    return lab_compare.compare(a.load(), b.load(), names)


def figure(materials: Sequence[Material], found: Comparison, previews: Previews | None = None) -> Figure:
    """A figure of two loaded materials, the first of which is the reference, and of what `compare` found."""
    incident = values.incidence(materials, None, float(found.incident[0, 1]), ANGLES, most=len(ANGLES))
    measured = [material.measured for material in materials if material.measured is not None]
    whole = all(isinstance(one.sensor, Hemisphere) for one in measured)  # of windows and points there are no maps
    heights = [2.15] * whole + [2.2] + [1.85] * (previews is not None)
    made = style.figure(style.PAGE, sum(heights))
    parts = iter(made.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0])
    if whole:
        maps(materials, found, incident[len(incident) // 2], next(parts).subplots(1, 3))
    slices_and_albedo(materials, found, incident, next(parts))
    if previews is not None:
        pictures([material.name for material in materials], previews, next(parts))
    return made


def maps(materials: Sequence[Material], found: Comparison, incident: np.ndarray, places: np.ndarray) -> None:
    """Fill three axes: f cos θo of both, and the relative difference."""
    a, b = (hemisphere.over_disc(material, incident[None]).mean(axis=0)[0] for material in materials)
    norm = style.norm([a, b], "log")
    for axes, material, map in zip(places, materials, (a, b)):
        image = hemisphere.disc(axes, map, norm, incident)
        axes.set_title(style.wrapped(rf"{material.name}, {style.THETA_I} = {incident[0]:g}°"))
    relative = relative_map(materials, found, incident, a, b)
    sizes = np.abs(relative[np.isfinite(relative)])
    end = float(np.clip(np.quantile(sizes, 0.95), 0.01, 1)) if len(sizes) else 1.0
    errors = hemisphere.disc(places[2], relative, Normalize(-end, end), incident, style.DIFFERENCES)
    places[2].set_title("relative difference")
    hemisphere.name_marks(places[0])
    look = {"fraction": 0.05, "pad": 0.02, "shrink": 0.85}
    made = places[0].figure
    made.colorbar(image, ax=places[:2], label=style.quantity(True), **look)
    made.colorbar(errors, ax=places[2:], label="second / first - 1", extend="both", **look)


def relative_map(
    materials: Sequence[Material], found: Comparison, incident: np.ndarray, a: np.ndarray, b: np.ndarray
) -> np.ndarray:
    """b / a - 1 of the maps; where it was measured, of means over the same cells."""
    for material in materials:
        if material.measured is not None:
            sensor, k = material.measured.sensor, values.row(material, tuple(incident))
            assert isinstance(sensor, Hemisphere)
            of_cells = found.relative[:, k].mean(axis=0)
            wo, relative = hemisphere.pixels(), np.full_like(a, np.nan)
            inside = wo[..., 2] > 0
            relative[inside] = of_cells[hemisphere.cells(wo[inside], sensor.rows, sensor.columns)]
            return relative
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = (b - a) / np.maximum(a, FAINT * np.nanmean(a))
    relative[a == b] = 0
    return relative


def slices_and_albedo(materials: Sequence[Material], found: Comparison, incident: np.ndarray, figure: Any) -> None:
    """Fill a row: slices in the plane of incidence, and the albedos."""
    names = [material.name for material in materials]
    planes = [values.in_plane(material, incident) for material in materials]
    panels = curves.arrange(names, [rf"{style.THETA_I} = {angle:g}°" for angle, _ in incident], [("", None)])
    places = figure.subplots(1, len(panels) + 1)
    scale = slices.suited([curve.value for plane in planes for curve in plane])
    for axes, panel in zip(places, panels):
        for line in panel.lines:
            curves.draw(axes, planes[line.material][line.case], line)
        slices.finish(axes, scale, True)
        axes.set(title=panel.title, xlabel=rf"{style.THETA_O} [°]", xticks=(-90, 0, 90))
        if axes is not places[0]:
            axes.set_ylabel("")
    last, order = places[-1], np.argsort(found.theta)
    few = "o" if len(order) <= curves.FEW // 2 else ""
    for line, albedo in zip(panels[0].lines, (found.albedo_a, found.albedo_b)):
        last.plot(found.theta[order], albedo.mean(axis=0)[order], few + "-", markersize=3, **line.look)
    top = max(found.albedo_a.max(), found.albedo_b.max())
    last.set(title="albedo", xlabel=rf"{style.THETA_I} [°]", xticks=(0, 30, 60, 90), ylim=(0, 1.05 * top or 1))
    last.grid()
    style.legend(figure, places)


def pictures(names: Sequence[str], previews: Previews, figure: Any) -> None:
    """Fill a row: both previews, their difference, and FLIP's map if there is one."""
    places = figure.subplots(1, 4)
    for axes, name, image in zip(places, names, (previews.a, previews.b)):
        _picture(axes, image, name)
    top = max(float(np.quantile(previews.difference, 0.999)), 1e-3)
    shown = [(previews.difference, f"difference, mean {previews.difference.mean():.3g}", top)]
    if previews.flip is not None:
        shown.append((previews.flip, f"FLIP, mean {previews.flip.mean():.3g}", 1.0))
    for axes, (map, title, high) in zip(places[2:], shown):
        image = _picture(axes, map, title, vmin=0, vmax=high, cmap=style.ERRORS)
        figure.colorbar(image, ax=axes, orientation="horizontal", fraction=0.06, pad=0.03)
    for axes in places[2 + len(shown) :]:
        axes.set_visible(False)


def _picture(axes: Axes, image: np.ndarray, title: str, **look: Any) -> Any:
    axes.set_title(style.wrapped(title, 28), fontsize=7)
    axes.set_axis_off()
    return axes.imshow(image, **look)
