"""Pictures of a measurement: maps of the BSDF and its error, slices through the plane of incidence, and albedos.

Maps and slices show f |cos θo|, its mean over each cell. Where channels differ, maps show their mean.
"""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import LogLocator

from ..errors import ParameterError
from ..lab import evaluate
from .measurement import Estimate, Measurement, estimate
from .sensors import Hemisphere, Points, Sensor, Window, directions
from .tracer import UNIT

QUANTITY = r"$f\,\cos\theta_o$ [1/sr]"
ERROR = "relative standard error [%]"
OFF = "model / measured - 1 [%]"
DECADES = 3
"""Below the largest value: what is less is not told apart."""
STEEP = 10
"""A slice whose peak is so many times its median is drawn with logarithms."""
STEPS = 8
"""Directions along each side of a cell at which the model is evaluated."""
COARSE = 3
"""The same, where there are many directions of incidence."""
SMOOTH = 256
"""Corners of the polygon that stands for a circle, at least."""
LEGIBLE = 8
"""Points whose values have a place below the axis, at most."""
SAMPLES = 2**12
"""Of a model, for each of its albedos."""
ROWS = 12
"""Directions of incidence that get a row each; more are shown together, small."""
SMALL = 48
"""Pixels along each side of a disc among many."""
COLOURS = {"R": "#c1272d", "G": "#2e8b57", "B": "#2858a8"}
BY_ORDER = ("#1f4e79", "#c8641e", "#3a7d44", "#7b3f8c", "#8c6d1f", "#555555")
MARKERS = "osD^vP"


class Line(NamedTuple):
    """What is drawn in one colour: an order of scattering (None: their sum) in a channel (None: the channels' mean)."""

    order: int | None
    channel: int | None
    label: str
    colour: str
    marker: str


ALL = Line(None, None, "sum", "black", "o")


def figure(measured: Measurement, model: dict[str, Any] | None = None) -> Figure:
    """A figure: a row for each direction of incidence, and below them the albedos, if there are several.

    More than `ROWS` directions are shown together, as small maps.

    ``model`` is the description of a BSDF to draw as well; it needs a variant with the measurement's channels.
    """
    if model is not None:
        check_channels(measured)
        measured = replace(measured, about=measured.about | {"model": model})  # lines are named by it
    bsdf = None if model is None else mi.load_dict(model, parallel=False)
    if len(measured.incident) > ROWS:
        return overview(measured, bsdf)
    several = len(np.unique(measured.incident[:, 0])) > 1
    heights = [3.4] * len(measured.incident) + [3.0] * several
    figure = Figure(figsize=(13, sum(heights) + 0.2), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    rows = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for k, row in enumerate(rows[: len(measured.incident)]):
        theta, phi = measured.incident[k]
        value, error = (numbers[k].mean() for numbers in measured.total_albedo)
        light = rf"Light from $\theta_i$ = {theta:g}°, $\phi_i$ = {phi:g}°"
        row.suptitle(f"{light}:  directional albedo {value:.4f} ± {error:.1g}", fontsize=11)
        plot(measured.sensor, measured, k, bsdf, row)
    if several:
        plot_albedo(measured, bsdf, rows[-1])
    return figure


def overview(measured: Measurement, bsdf: Any) -> Figure:
    """A figure of many directions of incidence: a small map of each, beside its error, or how far the model is off."""
    sensor, (value, error) = measured.sensor, (numbers.mean(axis=-1) for numbers in measured.summed)
    if bsdf is None:
        with np.errstate(invalid="ignore", divide="ignore"):
            beside, name, norm, colours = 100 * error / value, ERROR, LogNorm(0.1, 100), "magma"
    else:
        found = [model_means(measured, k, bsdf, *each(sensor), COARSE) for k in range(len(value))]
        means = np.stack(found).mean(axis=-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            beside, name, norm, colours = 100 * (means / value - 1), OFF, Normalize(-50, 50), "RdBu_r"
    figure = Figure(figsize=(13, 11), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    top, bottom = figure.subfigures(2, 1, height_ratios=(8, 3))
    value = np.where(value > 0, value, np.nan)
    left = (value, QUANTITY, LogNorm(*brightness_range(measured)), "viridis")
    for axes, (values, label, scale, map) in zip(top.subplots(1, 2), (left, (beside, name, norm, colours))):
        mosaic(axes, measured, [small(sensor, one, measured.wi[k]) for k, one in enumerate(values)], scale, map, label)
    plot_albedo(measured, bsdf, bottom)
    return figure


def mosaic(axes: Axes, measured: Measurement, pictures: list[np.ndarray], norm: Any, colours: str, label: str) -> None:
    """Draw equal pictures in rows of θ and columns of φ, if they fill such a table; or else in a square, in order."""
    (theta, phi), count = (np.unique(angles) for angles in measured.incident.T), len(pictures)
    tabular = len(theta) * len(phi) == count
    columns = len(phi) if tabular else int(np.ceil(np.sqrt(count)))
    order = np.lexsort(measured.incident.T[::-1]) if tabular else np.arange(count)
    height, width = np.array(pictures[0].shape) + 2
    canvas = np.full((height * -(-count // columns), width * columns), np.nan)
    for place, k in enumerate(order):
        row, column = divmod(place, columns)
        y, x = row * height, column * width
        canvas[y : y + height - 2, x : x + width - 2] = pictures[k]
        if not tabular:
            name = f"{measured.incident[k, 0]:.3g}°, {measured.incident[k, 1]:.3g}°"
            axes.text(x, y, name, fontsize=4, va="bottom")
    image = axes.imshow(canvas, norm=norm, cmap=colours, interpolation="nearest")
    axes.spines[:].set_visible(False)
    axes.set(xticks=[], yticks=[])
    if tabular:
        axes.set_xticks((np.arange(len(phi)) + 0.5) * width - 1, [f"{angle:.3g}°" for angle in phi], fontsize=7)
        axes.set_yticks((np.arange(len(theta)) + 0.5) * height - 1, [f"{angle:.3g}°" for angle in theta], fontsize=7)
        axes.set(xlabel=r"$\phi_i$", ylabel=r"$\theta_i$")
    ticks = {"ticks": LogLocator(10, (1, 2, 5)), "format": "%.3g"} if isinstance(norm, LogNorm) else {}
    bar = axes.figure.colorbar(image, ax=axes, label=label, location="top", shrink=0.9, extend="both", **ticks)
    bar.ax.minorticks_off()


@singledispatch
def small(sensor: Sensor, values: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """A small picture, rows from above, of values (cells,) that a sensor has measured."""
    return values[None]


@small.register
def small_hemisphere(sensor: Hemisphere, values: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """A disc in the equal-area projection, seen from above."""
    x, y = np.meshgrid((np.arange(SMALL) + 0.5) / SMALL * 2 - 1, 1 - (np.arange(SMALL) + 0.5) / SMALL * 2)
    square = x**2 + y**2  # 1 - cos θ
    row = np.minimum((square * sensor.rows).astype(int), sensor.rows - 1)
    turn = np.arctan2(y, x) / (2 * np.pi) % 1
    column = np.minimum((turn * sensor.columns).astype(int), sensor.columns - 1)
    return np.where(square < 1, values[row * sensor.columns + column], np.nan)


@small.register
def small_window(sensor: Window, values: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """A square, away from the normal to the right."""
    above = sensor.directions(wi)[:, 0, 2] > 0
    return np.where(above, values, np.nan).reshape(sensor.n, sensor.n).T[::-1]


@singledispatch
def plot(sensor: Sensor, measured: Measurement, k: int, bsdf: Any, figure: SubFigure) -> None:
    """Plot what a sensor of some kind has measured for direction of incidence ``k``."""
    raise TypeError(f"cannot plot what a {type(sensor).__name__} measured")


@plot.register
def plot_hemisphere(sensor: Hemisphere, measured: Measurement, k: int, bsdf: Any, figure: SubFigure) -> None:
    """Plot discs in Lambert's equal-area projection, seen from above, and the slice through the plane of incidence."""
    repeat = -(-SMOOTH // sensor.columns)
    azimuth = np.linspace(0, 2 * np.pi, sensor.columns * repeat + 1)
    r = np.sqrt(np.arange(sensor.rows + 1) / sensor.rows)[:, None]  # the area within is 1 - cos θ
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.6))

    def paint(axes: Axes, values: np.ndarray, **style: Any) -> Any:
        disc(axes, *measured.incident[k])
        values = np.repeat(values.reshape(sensor.rows, sensor.columns), repeat, axis=1)
        return axes.pcolormesh(r * np.cos(azimuth), r * np.sin(azimuth), values, **style)

    maps(measured, k, paint, left, middle)
    left.legend(fontsize=7, frameon=False, loc="lower left", bbox_to_anchor=(-0.05, -0.08), handletextpad=0)
    theta, phi = measured.incident[k]
    backward, forward = (sectors(sensor, phi + turn) for turn in (0, 180))
    cells = np.concatenate([backward[0][::-1], forward[0]])
    weights = np.repeat([backward[1], forward[1]], sensor.rows, axis=0)
    edges = np.degrees(np.arccos(1 - np.arange(sensor.rows + 1) / sensor.rows))
    profile(measured, k, bsdf, (cells, weights), np.concatenate([-edges[:0:-1], edges]), right)
    place(right, {"light": -theta, "mirror": theta})
    right.set(xlim=(-90, 90), xticks=range(-90, 91, 30), xlabel=r"$\theta_o$ in the plane of incidence [°]")


@plot.register
def plot_window(sensor: Window, measured: Measurement, k: int, bsdf: Any, figure: SubFigure) -> None:
    """Plot squares in Lambert's equal-area projection, and the slice along the plane of incidence."""
    edges = np.degrees(2 * np.arcsin(np.linspace(-1, 1, sensor.n + 1) * sensor.half_width / 2))
    above = sensor.directions(measured.wi[k])[:, 0, 2] > 0
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.6))

    def paint(axes: Axes, values: np.ndarray, **style: Any) -> Any:
        axes.set(aspect="equal", facecolor="0.85", xlabel="away from the normal [°]", ylabel="across [°]")
        values = np.where(above, values, np.nan).reshape(sensor.n, sensor.n).T  # rows to the right
        return axes.pcolormesh(edges, edges, values, **style)

    maps(measured, k, paint, left, middle)
    middle.set(ylabel="")
    cells = np.arange(sensor.n)[:, None] * sensor.n + [(sensor.n - 1) // 2, sensor.n // 2]
    profile(measured, k, bsdf, (cells, np.full(cells.shape, 0.5)), edges, right)
    centre = {"retro": "light", "mirror": "mirror", "normal": "normal"}[sensor.about]
    place(right, {centre: 0})
    right.set(xlim=edges[[0, -1]], xlabel=f"from the {centre}, away from the normal [°]")


@plot.register
def plot_points(sensor: Points, measured: Measurement, k: int, bsdf: Any, figure: SubFigure) -> None:
    """Plot a column of error bars for each point."""
    axes = figure.subplots()
    profile(measured, k, bsdf, each(sensor), np.arange(sensor.cells + 1) - 0.5, axes)
    names = [f"{theta:g}°, {phi:g}°" for theta, phi in sensor.angles]
    if sensor.cells <= LEGIBLE:
        numbers = zip(*curve(measured, k, *each(sensor), ALL))
        names = [f"{name}\n{value:.4g} ± {error:.1g}" for name, (value, error) in zip(names, numbers)]
    axes.set_xticks(range(sensor.cells), names, rotation=0 if sensor.cells <= LEGIBLE else 90, fontsize=8)
    axes.set(xlim=(-0.5, sensor.cells - 0.5), xlabel=r"$\theta_o$, $\phi_o$")


def plot_albedo(measured: Measurement, bsdf: Any, figure: SubFigure) -> None:
    """Plot the directional albedo over θ of the incident light, by order or channel, a marker for each azimuth."""
    axes = figure.subplots()
    theta, phi = measured.incident.T
    azimuths, grid = np.unique(phi), np.linspace(0, 89.5, 90)
    if len(azimuths) > LEGIBLE:
        axes.set_title(f"{LEGIBLE} of {len(azimuths)} azimuths", fontsize=9)
        azimuths = azimuths[np.linspace(0, len(azimuths) - 1, LEGIBLE).round().astype(int)]
    for n, azimuth in enumerate(azimuths):
        chosen = np.flatnonzero(phi == azimuth)
        at = rf", $\phi_i$ = {azimuth:g}°" if len(azimuths) > 1 else ""
        for line in lines(measured):
            numbers = measured.total_albedo if line.order is None else measured.albedo
            value, error = (x[chosen] if line.order is None else x[chosen, line.order] for x in numbers)
            value, error = (x.mean(axis=-1) if line.channel is None else x[:, line.channel] for x in (value, error))
            where = line._replace(label=line.label + at, marker=MARKERS[n % len(MARKERS)])
            errorbars(axes, theta[chosen], value, error, where, size=2)
        if bsdf is not None:
            incident = directions(np.c_[grid, np.full(len(grid), azimuth)])
            values = evaluate.albedo(bsdf, incident, SAMPLES, measured.wavelengths).T
            for one, style in model_lines(measured, values):
                dashes = {"linestyle": ("-", "--", ":", "-.")[n % 4], "label": style["label"] and style["label"] + at}
                axes.plot(grid, one, **style | dashes)
    axes.set(xlim=(-1, 91), xticks=range(0, 91, 15), ylim=(0, None))
    axes.set(xlabel=r"$\theta_i$ [°]", ylabel="directional albedo")
    axes.grid(alpha=0.3)
    legend(axes)


def errorbars(axes: Axes, x: np.ndarray, value: np.ndarray, error: np.ndarray, line: Line, size: float = 1) -> None:
    """Draw values with their standard errors; the sum of orders as rings, through which the orders are seen."""
    whole = line.order is None
    axes.errorbar(
        x,
        value,
        error,
        color=line.colour,
        label=line.label,
        marker=line.marker,
        markersize=size * (4.5 if whole else 2.6),
        markerfacecolor="none" if whole else line.colour,
        markeredgewidth=0.6,
        linestyle="none",
        elinewidth=0.8,
        capsize=1.5,
        capthick=0.8,
    )


def legend(axes: Axes) -> None:
    """Name the lines, what was measured first, at the right: inside it would cover some."""
    named = sorted(zip(*axes.get_legend_handles_labels()), key=lambda pair: pair[1].startswith("model"))
    handles, labels = zip(*named)
    axes.legend(handles, labels, fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))


def maps(measured: Measurement, k: int, paint: Any, left: Axes, right: Axes) -> None:
    """Fill two axes: the BSDF, all orders together, and its relative standard error; scales serve all directions."""
    value, error = curve(measured, k, *each(measured.sensor), ALL)
    value = np.where(value > 0, value, np.nan)  # logarithms have no place for cells without light
    low, high = brightness_range(measured)
    channels = ", mean of " + ", ".join(measured.channels) if measured.colourful else ""
    for axes, values, name, norm, colours in (
        (left, value, QUANTITY + channels, LogNorm(low, high), "viridis"),
        (right, 100 * error / value, ERROR, LogNorm(0.1, 100), "magma"),
    ):
        image = paint(axes, values, norm=norm, cmap=colours, rasterized=True)
        axes.figure.colorbar(image, ax=axes, label=name, shrink=0.85)


def profile(measured: Measurement, k: int, bsdf: Any, bins: tuple[Any, Any], edges: np.ndarray, axes: Axes) -> None:
    """Plot weighted means of cells with error bars, and the model's as steps."""
    for line in lines(measured):
        value, error = curve(measured, k, *bins, line)
        errorbars(axes, (edges[1:] + edges[:-1]) / 2, value, error, line)
    if bsdf is not None:
        for values, style in model_lines(measured, model_means(measured, k, bsdf, *bins)):
            if isinstance(measured.sensor, Points):  # not beside each other
                axes.hlines(values, edges[:-1] + 0.1, edges[1:] - 0.1, **style)
            else:
                axes.stairs(values, edges, baseline=None, **style)
    value, _ = curve(measured, k, *bins, ALL)
    if 0 < np.median(value) < value.max() / STEEP:
        axes.set(yscale="log", ylim=(brightness_range(measured)[0], None))
    else:
        axes.set(ylim=(0, None))
    axes.set(ylabel=QUANTITY)
    axes.grid(alpha=0.3)
    legend(axes)


def brightness_range(measured: Measurement) -> tuple[float, float]:
    """Of the logarithmic scales."""
    values = measured.summed.value.mean(axis=-1)
    values = values[values > 0]
    high = values.max(initial=0) or 1.0
    return max(values.min(initial=high / 10), high / 10**DECADES), high


def curve(measured: Measurement, k: int, cells: np.ndarray, weights: np.ndarray, line: Line) -> Estimate:
    """Means over cells (bins, n) with weights (bins, n), for direction of incidence ``k``."""
    energy = measured.energy[:, k].sum(axis=1) if line.order is None else measured.energy[:, k, line.order]
    energy = energy.mean(axis=-1) if line.channel is None else energy[..., line.channel]
    value, error = estimate((energy[:, cells] * weights).sum(axis=-1) * UNIT, measured.paths[:, k])
    return Estimate(value / measured.sensor.solid_angle, error / measured.sensor.solid_angle)


def each(sensor: Sensor) -> tuple[np.ndarray, np.ndarray]:
    """Every cell by itself, and its weight."""
    return np.arange(sensor.cells)[:, None], np.ones((sensor.cells, 1))


def sectors(sensor: Hemisphere, azimuth: float) -> tuple[np.ndarray, np.ndarray]:
    """The cells (rows, 2) of the two sectors nearest to an azimuth in degrees, and weights that interpolate there."""
    first, share = divmod(azimuth / 360 * sensor.columns - 0.5, 1)
    columns = (int(first) + np.arange(2)) % sensor.columns
    return np.arange(sensor.rows)[:, None] * sensor.columns + columns, np.array([1 - share, share])


def lines(measured: Measurement) -> list[Line]:
    """What to draw: the orders that were counted apart, and their sum; or, if there is one only, the channels."""
    count, names = measured.orders, measured.channels
    if count == 1 and measured.colourful:
        return [Line(0, n, name, COLOURS.get(name, BY_ORDER[n]), MARKERS[n]) for n, name in enumerate(names)]
    found = [Line(n, None, name, BY_ORDER[n % 6], MARKERS[n % 6]) for n, name in enumerate(measured.order_names)]
    return found if count == 1 else [*found, ALL]


def model_lines(measured: Measurement, values: np.ndarray) -> list[tuple[np.ndarray, dict[str, Any]]]:
    """Lines of a model's values (n, channels), and their styles: as the measured ones are told apart."""
    label = f"model: {measured.about['model']['type']}"
    if any(line.channel is None for line in lines(measured)):
        return [(values.mean(axis=-1), {"color": "black", "linewidth": 0.9, "label": label})]
    return [
        (values[:, line.channel], {"color": line.colour, "linewidth": 0.9, "label": None if n else label})
        for n, line in enumerate(lines(measured))
    ]


def model_means(
    measured: Measurement, k: int, bsdf: Any, cells: np.ndarray, weights: np.ndarray, steps: int = STEPS
) -> np.ndarray:
    """What `curve` would give if the surface were the model's: (bins, channels)."""
    wo = measured.sensor.directions(measured.wi[k], steps)[cells]  # (bins, n, steps², 3)
    means = evaluate.cell_means(bsdf, measured.wi[k], wo, measured.wavelengths)
    return (means * weights).sum(axis=-1).T


def check_channels(measured: Measurement) -> None:
    """Raise ParameterError if a model has other channels, in the variant in use, than what was measured."""
    names = measured.channels
    spectral, count = measured.wavelengths is not None, dr.size_v(mi.UnpolarizedSpectrum)
    if (spectral, len(names)) != (mi.is_spectral, count):
        raise ParameterError(
            f"variant {mi.variant()}: a model has {count} {'wavelengths' if mi.is_spectral else 'channels'} there, and "
            f"{', '.join(names)} were measured. Choose a variant like that of the measurement."
        )


def disc(axes: Axes, theta: float, phi: float) -> None:
    """Draw what belongs to a disc: rings, azimuths, where light comes from, and where a mirror would send it."""
    axes.set(aspect="equal", xlim=(-1.3, 1.3), ylim=(-1.25, 1.25))
    axes.set_axis_off()
    around = np.linspace(0, 2 * np.pi, SMOOTH + 1)
    for ring in (30, 60, 90):
        r = np.sqrt(1 - np.cos(np.radians(ring)))
        style = {"color": "black", "linewidth": 0.8} if ring == 90 else {"color": "white", "linewidth": 0.4}
        axes.plot(r * np.cos(around), r * np.sin(around), **style)
        if ring < 90:
            axes.text(0, -r, f"{ring}°", color="white", fontsize=6, ha="center", va="bottom")
    for azimuth in (0, 90, 180, 270):
        x, y = (1.13 * trig(np.radians(azimuth)) for trig in (np.cos, np.sin))
        axes.text(x, y, f"{azimuth}°", fontsize=7, ha="center", va="center", color="0.3")
    r = np.sqrt(1 - np.cos(np.radians(theta)))
    x, y = r * np.cos(np.radians(phi)), r * np.sin(np.radians(phi))
    axes.plot(x, y, "x", color="red", markersize=5, label="light")
    axes.plot(-x, -y, "o", color="red", markersize=5, markerfacecolor="none", label="mirror")
    axes.text(-1.3, 1.05, "equal-area\nprojection", fontsize=6, color="0.3")


def place(axes: Axes, angles: dict[str, float]) -> None:
    """Mark directions on the x axis of a slice."""
    if len(set(angles.values())) < len(angles):
        angles = {" = ".join(angles): next(iter(angles.values()))}
    for name, angle in angles.items():
        axes.axvline(angle, color="red", linewidth=0.7, linestyle=":")
        axes.text(angle, 1.01, name, transform=axes.get_xaxis_transform(), color="red", fontsize=7, ha="center")
