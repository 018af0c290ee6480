"""Where ``sample`` sends light, counted, beside the density that ``pdf`` gives; as the check ``chi2`` compares them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from asperity.errors import ParameterError
from asperity.goniophotometer.sensors import check_angles
from asperity.lab.checks import density
from asperity.materials import Material

from . import style, values
from .hemisphere import SIZE, bar, cells, disc, label, name_marks, pixels

LIMIT = 4
"""Standard deviations at the ends of the scale."""
CELL = 4 * np.pi / (density.ROWS * density.COLUMNS)
"""Solid angle in steradians."""


def figure(
    materials: Sequence[Material], *, theta: Sequence[float] | None = None, phi: float = 0.0, scale: str = "log"
) -> Figure:
    """Histogram of `sample` beside `pdf`, and their difference in standard deviations, a row a material."""
    style.check_scale(scale)
    values.channels(materials)
    angles = [45.0] if theta is None else list(theta)
    if len(angles) != 1:
        raise ParameterError(f"theta: sampling is shown for one angle of incidence; {len(angles)} were given.")
    check_angles([(angles[0], phi)])
    found = [densities(material, (angles[0], phi)) for material in materials]
    norm = style.norm([one[1] for one in found], scale)
    made = style.figure(style.PAGE, 2.1 * len(materials) + 0.3)
    grid = made.subplots(len(materials), 3, squeeze=False)
    incident = np.array([angles[0], phi])
    for maps, row in zip(found, grid):
        disc(row[0], maps[0], norm, incident)
        image = disc(row[1], maps[1], norm, incident)
        deviation = disc(row[2], maps[2], Normalize(-LIMIT, LIMIT), incident, style.DIFFERENCES)
    names = [f"{material.name}, {style.THETA_I} = {angles[0]:g}°" for material in materials]
    label(grid, names, ("sample", "pdf", "difference"))
    name_marks(grid[0, 0])
    bar(made, image, grid[:, :2], "density [1/sr]")
    bar(made, deviation, grid[:, 2:], "standard deviations", extend="both")
    return made


def densities(material: Material, incident: tuple[float, float]) -> np.ndarray:
    """Density of a million samples and of the pdf in 1/sr, and their difference: (3, SIZE, SIZE), NaN off the disc.

    Over cells of the upper hemisphere; the difference is in standard deviations of the count.
    """
    table = density.tabulate(material.load(), incident)
    above = np.stack([table.observed, table.expected])[:, : density.ROWS // 2]
    above = np.roll(above, -density.COLUMNS // 2, axis=2)  # from φ = 0 on
    difference = (above[0] - above[1]) / np.sqrt(np.maximum(above[1], 1))
    wo = pixels()
    inside = wo[..., 2] > 0
    cell = cells(wo[inside], density.ROWS // 2, density.COLUMNS)
    result = np.full((3, SIZE, SIZE), np.nan)
    shown = np.stack([*(above / (density.PAIRS * CELL)), difference])
    result[:, inside] = shown.reshape(3, -1)[:, cell]
    return result
