"""Figures that are renders, a file a paper: of materials side by side, and of presets that follow a figure."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import mitsuba as mi
import numpy as np

from ...scenes import presets
from ...scenes.preview import preview
from ...validation import figures
from ...validation.report import Effort, Finding, Section

Description = dict[str, Any]
Maker = Callable[[Effort], Section]
SIZE = 160
"""Pixels along a side of each render."""
COLUMNS = 4
"""Of presets."""
PATHS_PER_SAMPLE = 25_000
"""Of an effort, for each sample of a pixel: 16 when quick, 160 in full."""


def rendered(material: Description, effort: Effort, **view: Any) -> np.ndarray:
    """Linear RGB (size, size, 3) of the preview scene."""
    effort.tick()
    spp = int(np.clip(effort.paths / PATHS_PER_SAMPLE, 1, 256))
    scene = mi.load_dict(preview(material, **view, size=(SIZE, SIZE), spp=spp), parallel=False)
    return np.array(mi.render(scene, seed=effort.seed))[..., :3]


def materials(
    title: str,
    text: str,
    rows: Mapping[str, Mapping[str, Description]],
    views: Mapping[str, Description] | None = None,
    compared: bool = False,
) -> Maker:
    """Materials by row and column, on spheres unless the ``views`` of a row say otherwise.

    If ``compared``, what a row's first material differs from the others by is told.
    """

    def make(effort: Effort) -> Section:
        images, told = {}, []
        for row, columns in rows.items():
            view = {"object": "sphere"} | (views or {}).get(row, {})
            images[row] = {name: rendered(material, effort, **view) for name, material in columns.items()}
            first, *others = images[row].items()
            for name, image in others if compared else ():
                off = np.abs(image - first[1]).mean() / first[1].mean()
                told.append(Finding(f"{row}: {name} against {first[0]}", f"mean difference {off:.1%} of the mean"))
        return Section(title, text, told, figures={slug(title): drawn(title, images)})

    return make


def of_presets(title: str, text: str, source: str) -> Maker:
    """The presets that are made after a figure, ``source``, each in its own preview."""

    def make(effort: Effort) -> Section:
        loaded = {name: presets.load(name) for name in presets.names()}
        after = {name: one for name, one in loaded.items() if re.match(rf"{re.escape(source)}(?!\d)", one.source)}
        images = [(name, rendered(one.material, effort, **one.preview)) for name, one in after.items()]
        rows = {str(k): dict(images[k : k + COLUMNS]) for k in range(0, len(images), COLUMNS)}
        return Section(title, text, figures={slug(title): drawn(title, rows)})

    return make


def drawn(title: str, images: Mapping[str, Mapping[str, np.ndarray]]) -> Any:
    """Renders side by side, in sRGB; rows are named by words, not by numbers."""
    figure, grid = figures.panels(len(images), max(map(len, images.values())), "", "", title, width=2.0)
    for axes in grid.flat:
        axes.set_axis_off()
    for places, (row, named) in zip(grid, images.items()):
        for axes, (name, image) in zip(places, named.items()):
            axes.imshow(encoded(image))
            axes.set_title(name if row.isdigit() else f"{row}: {name}", fontsize=8)
    return figure


def encoded(image: np.ndarray) -> np.ndarray:
    """Linear RGB as sRGB (IEC 61966-2-1), cut at 1."""
    values = np.clip(image, 0, 1)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def slug(title: str) -> str:
    """The name of a title's file."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
