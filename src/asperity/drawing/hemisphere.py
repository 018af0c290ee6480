"""Maps over all outgoing directions above the surface, at fixed incidence, in Lambert's equal-area projection."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import Locator, LogLocator, MaxNLocator

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere
from asperity.goniophotometer.sensors import directions
from asperity.materials import Material

from . import style, values

SIZE = 320
"""Pixels along a side of a map."""
MANY = 300
"""Ratio of the ends of a logarithmic scale from which on isolines are sparse."""
RINGS = (30, 60)
"""Degrees from the normal that are marked."""


def figure(
    materials: Sequence[Material],
    *,
    theta: Sequence[float] | None = None,
    phi: float = 0.0,
    scale: str = "log",
    cosine: bool = True,
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
    isolines: bool = False,
) -> Figure:
    """Maps over the outgoing directions, a row a material, a column an angle of incidence."""
    style.check_scale(scale)
    index = values.single(values.channels(materials, wavelengths), channel)
    incident = values.incidence(materials, theta, phi)
    found = [values.one(over_disc(material, incident, cosine, wavelengths), index) for material in materials]
    norm = style.norm(found, scale)
    made, grid = grid_of(len(materials), len(incident))
    for maps, row in zip(found, grid):
        for k, axes in enumerate(row):
            image = disc(axes, maps[k], norm, incident[k])
            if isolines:
                lines(axes, maps[k], norm)
    angles = [rf"{style.THETA_I} = {angle:g}°" for angle, _ in incident]
    label(grid, [material.name for material in materials], angles)
    bar(made, image, grid, style.quantity(cosine))
    name_marks(grid[0, 0])
    return made


def label(grid: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> None:
    """Names of materials, and of what is shown of them, beside and above discs (rows, columns)."""
    for axes, column in zip(grid[0], columns):
        axes.set_title(style.wrapped(column if len(rows) > 1 or len(columns) > 1 else f"{rows[0]}, {column}"))
    if len(rows) == 1 and len(columns) > 1:
        grid[0, 0].figure.suptitle(rows[0], fontsize=8)
    for axes, row in zip(grid[:, 0], rows if len(rows) > 1 else ()):
        look = {"rotation": 90, "ha": "right", "va": "center", "multialignment": "center"}
        axes.text(-0.06, 0.5, style.wrapped(row), transform=axes.transAxes, **look)


def grid_of(rows: int, columns: int) -> tuple[Figure, np.ndarray]:
    """A figure with discs (rows, columns)."""
    width = style.COLUMN if columns == 1 else style.PAGE
    side = min(2.3, (width - 0.9) / columns)
    made = style.figure(side * columns + 0.9, side * rows + 0.3)
    return made, made.subplots(rows, columns, squeeze=False)


def bar(made: Figure, image: Any, grid: np.ndarray, label: str, **options: Any) -> None:
    """The scale of all discs."""
    made.colorbar(image, ax=grid, label=label, fraction=0.05, aspect=22 * len(grid), pad=0.02, **options)


def name_marks(axes: Axes) -> None:
    """Say in the corner below a disc what is marked on it."""
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 0.0)}
    named = axes.legend(**place, fontsize=5.5, handletextpad=-0.2, borderpad=0, labelspacing=0.2)
    named.set_in_layout(False)


def pixels() -> np.ndarray:
    """The directions of a map's pixels (SIZE, SIZE, 3), rows from below; z < 0 outside the disc."""
    x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2 - 1] * 2)
    z = 1 - x**2 - y**2  # the area within is 1 - cos θ
    stretch = np.sqrt(1 + np.clip(z, 0, 1))
    return np.stack([x * stretch, y * stretch, z], axis=-1)


def over_disc(
    material: Material, incident: np.ndarray, cosine: bool = True, wavelengths: Sequence[float] | None = None
) -> np.ndarray:
    """f |cos θo|, or f, at `pixels`: (channels, directions of incidence, SIZE, SIZE), NaN outside the disc."""
    wo = pixels()
    inside = wo[..., 2] > 0
    if material.measured is not None:
        found = _measured_cells(material, incident, wo[inside])
    else:
        found = values.at(material, directions(incident)[:, None], wo[inside], wavelengths)
    result = np.full((*found.shape[:2], SIZE, SIZE), np.nan)
    result[..., inside] = found if cosine else found / wo[inside][:, 2]
    return result


def _measured_cells(material: Material, incident: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Values of the cells that directions (n, 3) fall into: (channels, directions of incidence, n)."""
    measured = values.measurement(material)
    sensor = measured.sensor
    if not isinstance(sensor, Hemisphere):
        raise ParameterError(f"{material.name}: a {sensor.kind} was measured, not the hemisphere.")
    cell = cells(wo, sensor.rows, sensor.columns)
    chosen = [values.row(material, tuple(one)) for one in incident]
    return np.moveaxis(measured.summed.value[chosen][:, cell], -1, 0)


def cells(wo: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The cells of a `Hemisphere` that directions (n, 3) fall into."""
    row = np.minimum(((1 - wo[:, 2]) * rows).astype(int), rows - 1)
    turn = np.arctan2(wo[:, 1], wo[:, 0]) / (2 * np.pi) % 1
    return row * columns + np.minimum((turn * columns).astype(int), columns - 1)


def disc(axes: Axes, map: np.ndarray, norm: Normalize, incident: np.ndarray, colours: str = style.MAP) -> Any:
    """Draw a map (SIZE, SIZE) with what helps to read it; returns the image."""
    map = style.visible(map, norm)
    image = axes.imshow(map, origin="lower", extent=(-1, 1, -1, 1), norm=norm, cmap=colours, interpolation="bilinear")
    rim = Circle((0, 0), 1, facecolor="none", edgecolor="black", linewidth=0.7, transform=axes.transData)
    axes.add_patch(rim)
    image.set_clip_path(rim)
    axes.set(xlim=(-1.14, 1.14), ylim=(-1.14, 1.14))
    axes.set_axis_off()
    shade = "white" if colours == style.MAP else "0.4"
    for ring in RINGS:
        r = np.sqrt(1 - np.cos(np.radians(ring)))
        axes.add_patch(Circle((0, 0), r, facecolor="none", edgecolor=shade, linewidth=0.35, alpha=0.7))
        axes.text(0, -r, f"{ring}°", color=shade, fontsize=5, ha="center", va="bottom")
    for azimuth in (0, 90, 180, 270):
        x, y = 1.08 * np.cos(np.radians(azimuth)), 1.08 * np.sin(np.radians(azimuth))
        turn = (azimuth + 90) % 180
        axes.text(x, y, f"{azimuth}°", fontsize=5, color="0.35", ha="center", va="center", rotation=-turn)
    theta, phi = incident
    r = np.sqrt(1 - np.cos(np.radians(theta)))
    x, y = r * np.cos(np.radians(phi)), r * np.sin(np.radians(phi))
    marks = {"linestyle": "none", "color": style.LIGHT, "markersize": 4, "markeredgewidth": 0.9}
    axes.plot(x, y, marker="x", label="light", **marks)
    axes.plot(-x, -y, marker="o", markerfacecolor="none", label="mirror", **marks)
    return image


def lines(axes: Axes, map: np.ndarray, norm: Normalize) -> None:
    """Draw isolines, with their values."""
    low, high = norm.vmin, norm.vmax
    if isinstance(norm, LogNorm):
        locator: Locator = LogLocator(10, (1.0, 3.0) if high / low > MANY else (1.0, 2.0, 5.0))
    else:
        locator = MaxNLocator(6)
    levels = [level for level in locator.tick_values(low, high) if low < level < high]
    place = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    drawn = axes.contour(place, place, map, levels=levels, colors="white", linewidths=0.5)
    axes.clabel(drawn, fontsize=4.5, fmt="%.2g", inline_spacing=1)
