"""Heights over a grid: how they are read, levelled, and found fit to be repeated."""

from __future__ import annotations

from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from .. import loading
from ..errors import ParameterError, UnknownNameError, UnreadableFileError, readable
from .periodic import TOLERANCE

FORMATS = (".npy", ".png", ".exr")
CLIFF = 3
"""Borders match if heights step from the last column to the first by at most so many times the steps between others."""


def read(path: str | Path, channel: str | None = None) -> np.ndarray:
    """Heights as they are stored in an array, .npy, or a channel of an image, .png or .exr.

    Whole numbers of a .png become 0 to 1, and nothing is taken for sRGB. Without a ``channel`` an image must have one
    only, or several that are equal, as grey images do; alpha does not count.
    """
    found = readable("height field", path, FORMATS)
    if found.suffix.lower() == ".npy" and channel is not None:
        raise ParameterError(f"channel = {channel!r}: an array has none; expected an image.")
    try:
        if found.suffix.lower() == ".npy":
            return np.load(found, allow_pickle=False)
        bitmap = loading.image(found)
        names, values = [field.name for field in bitmap.struct_()], np.atleast_3d(np.array(bitmap))
    except (OSError, EOFError, ValueError, RuntimeError, TokenError) as error:
        raise UnreadableFileError("height field", found, FORMATS, str(error)) from error
    chosen = values[..., _channel(names, values, channel)]
    return chosen / np.iinfo(chosen.dtype).max if found.suffix.lower() == ".png" else chosen


def _channel(names: list[str], values: np.ndarray, name: str | None) -> int:
    """The index of the channel that is asked for; if none is, of what there is no choice about."""
    if name is not None:
        if name not in names:
            raise UnknownNameError("channel", str(name), names)
        return names.index(name)
    first, *others = [k for k, each in enumerate(names) if each.split(".")[-1] != "A"] or [0]
    if not all(np.array_equal(values[..., first], values[..., other], equal_nan=True) for other in others):
        raise ParameterError(f"channel: the image has several, and they differ; choose one of {', '.join(names)}.")
    return first


def checked(values: Any) -> np.ndarray:
    """A copy of its own, not to be written to, of a 2-D array of finite numbers."""
    try:
        masked = np.ma.asarray(values)  # keeps the masks of rows, too
        if np.iscomplexobj(masked):
            raise TypeError("they are complex")
        heights = np.array(masked.data, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ParameterError(f"heights: expected a 2-D array of real numbers ({error}).") from error
    holes = np.argwhere(np.ma.getmaskarray(masked))
    if len(holes):
        raise ParameterError(
            f"heights{holes[0].tolist()}: masked, so there is no height; {len(holes)} of {heights.size} are. Expected "
            "a height everywhere: fill the holes, or cut them away."
        )
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise ParameterError(f"heights: expected a 2-D array, at least 2 x 2; its shape is {heights.shape}.")
    wrong = np.argwhere(~np.isfinite(heights))
    if len(wrong):
        row, column = wrong[0]
        raise ParameterError(
            f"heights[{row}, {column}] = {heights[row, column]}: expected finite numbers; {len(wrong)} are not."
        )
    heights.setflags(write=False)
    return heights


def slopes(heights: np.ndarray, spacing: tuple[float, float]) -> tuple[float, float]:
    """Of the plane nearest to the heights by least squares, along x and y."""

    def along(means: np.ndarray, step: float) -> float:
        x = (np.arange(len(means)) - (len(means) - 1) / 2) * step
        return float(x @ (means - means[0]) / (x @ x))  # exactly 0 if they are equal

    # On a grid x and y are independent, so each slope is that of the means.
    return along(heights.mean(axis=0), spacing[0]), along(heights.mean(axis=1), spacing[1])


def levelled(heights: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
    """The heights above the plane nearest to them."""
    (rows, columns), (dx, dy), (a, b) = heights.shape, spacing, slopes(heights, spacing)
    x, y = ((np.arange(n) - (n - 1) / 2) * step for n, step in ((columns, dx), (rows, dy)))
    return heights - heights.mean() - a * x - b * y[:, None]


def step_at_border(heights: np.ndarray, axis: int) -> tuple[float, float]:
    """Root mean square step from the last column to the first (``axis`` 1; 0: rows), and the largest between others."""
    steps = np.sqrt(np.square(np.roll(heights, -1, axis) - heights).mean(axis=1 - axis))
    return float(steps[-1]), float(steps[:-1].max())


def cliff(heights: np.ndarray, spacing: tuple[float, float]) -> tuple[str, float, float] | None:
    """The axis along which repeated heights would have a cliff, the step there, and the largest between others.

    It is judged by the map's own roughness. The steps around a period sum to zero, so one that is more than `CLIFF`
    times as high as any other must be made up for by more than that many others: a tilt, or two ends of a map that have
    nothing to do with each other. A tilt over white noise of deviation σ is found where it spans 10 σ, in all of
    10⁵ maps from 16 x 16 on, and in all of 10⁴ at 6 σ with 128 rows; below 4 σ its step is like those of the noise. Of
    a random periodic map no border stands out: of 4·10⁵ maps of white noise, 5 x 8 and larger, normal or exponential,
    none came beyond 3; with the same profile in all rows, 1 in 10⁵ of sixteen columns did, and none of thirty-two. Four
    columns or less are too few to tell.
    """
    tolerance = TOLERANCE * max(np.abs(heights).max(), *np.multiply(heights.shape[::-1], spacing))
    for axis, name in ((1, "x"), (0, "y")):
        border, inside = step_at_border(heights, axis)
        if border > max(CLIFF * inside, tolerance):
            return name, border, inside
    return None


def check_borders(heights: np.ndarray, spacing: tuple[float, float]) -> None:
    """Raise ParameterError for heights that do not go on at their borders as they do inside."""
    found = cliff(heights, spacing)
    if found is None:
        return
    name, border, inside = found
    a, b = slopes(heights, spacing)
    level = f"take the plane of slopes {a:.3g} and {b:.3g} in x and y away (level=True, --level), or "
    raise ParameterError(
        f"heights: their borders in {name} do not match: repeated, they step by {border:.3g} there, and inside by "
        f"{inside:.3g} at most (root mean square). They are tilted, or part of a larger map: "
        f"{'' if cliff(levelled(heights, spacing), spacing) else level}"
        'mirror them (periodic="mirror", --periodic mirror). If a cliff is meant, roll the map until it lies inside.'
    )
