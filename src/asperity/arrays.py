"""Functions of directions on NumPy arrays of any size: broadcast, checked, and computed in pieces.

Directions point away from the surface, in a frame whose z is its normal. They are arrays whose last axis says what they
are: of 3, unit vectors; of 2, the angles θ from the normal and φ, in degrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ParameterError, whole

Array = NDArray[np.float64]
CHUNK = 2**20
"""Pairs of directions that are computed at a time: enough to fill any processor, in a few hundred megabytes."""
LONGER = 1e-3
"""How much the length of a unit vector may differ from 1: more than rounding to four digits, less than a mistake."""

ROUNDING = 1e-6
"""Of a cosine in float32: a direction on the horizon may lie so far below."""


class Directions:
    """Directions under the name of the parameter that gave them, with θ in a range, in degrees, for some reason."""

    def __init__(self, name: str, given: ArrayLike, low: float = 0.0, high: float = 180.0, reason: str = ""):
        self.name, self.low, self.high, self.reason = name, low, high, reason
        try:
            self.array = np.asarray(given)
            if self.array.dtype.kind not in "fiu":
                raise ValueError
        except ValueError:
            raise ParameterError(f"{name}: expected an array of numbers.") from None
        if self.array.shape[-1:] not in ((2,), (3,)):
            raise ParameterError(
                f"{name} has the shape {self.array.shape}: expected (..., 3), unit vectors, or (..., 2), angles θ and "
                "φ in degrees."
            )

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the directions, without the axis of their components."""
        return self.array.shape[:-1]

    def repeated(self, n: int) -> Directions:
        """Each ``n`` times, along a new last axis; takes no memory."""
        components = self.array.shape[-1]
        array = np.broadcast_to(self.array[..., None, :], (*self.shape, n, components))
        return Directions(self.name, array, self.low, self.high, self.reason)

    def at(self, shape: tuple[int, ...], index: tuple[Any, ...]) -> Array:
        """Unit vectors (n, 3) of those at ``index``, once they are broadcast to ``shape``; raises ParameterError."""
        given = np.broadcast_to(self.array, (*shape, self.array.shape[-1]))[index].astype(np.float64)
        if given.shape[-1] == 2:
            sound = np.isfinite(given).all(axis=1) & (given[:, 0] >= 0) & (given[:, 0] <= 180)
            self.refuse(~sound, given, index, "θ within [0, 180] degrees, and a finite φ")
            theta, phi = np.radians(given).T
            unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
        else:
            length = np.linalg.norm(given, axis=1)
            self.refuse(~(np.abs(length - 1) <= LONGER), given, index, "a vector of length 1")
            unit = given / length[:, None]
        below, above = np.cos(np.radians([self.high, self.low])) + np.array([-ROUNDING, ROUNDING])
        self.refuse((unit[:, 2] < below) | (unit[:, 2] > above), given, index, f"θ within {self.range}")
        return unit

    @property
    def range(self) -> str:
        """Of θ, and why."""
        return f"[{self.low:g}, {self.high:g}] degrees{self.reason}"

    def refuse(self, wrong: NDArray[np.bool_], given: Array, index: tuple[Any, ...], expected: str) -> None:
        """Raise ParameterError if one is ``wrong``, and say which it is and what it was."""
        if wrong.any():
            k = int(np.argmax(wrong))
            place = [i.start + k if isinstance(i, slice) else i[k] for i in index]
            values = ", ".join(f"{x:g}" for x in given[k])
            raise ParameterError(f"{self.name}[{', '.join(map(str, place))}] = ({values}): expected {expected}.")


def mapped(
    function: Callable[..., Array],
    directions: Sequence[Directions],
    width: int,
    out: Any = None,
    chunk: int = CHUNK,
) -> Any:
    """``function`` of unit vectors (n, 3), which returns (n, width), over all directions: (*shape, width).

    The directions are broadcast. ``out`` is an array of that shape to write to; a ``np.memmap``, say.
    """
    chunk = whole("chunk", chunk, 1)
    try:
        shape = np.broadcast_shapes(*(each.shape for each in directions))
    except ValueError:
        shapes = " and ".join(f"{each.name} of {each.array.shape}" for each in directions)
        raise ParameterError(f"{shapes}: these shapes do not go together, but for their last axis.") from None
    try:
        result = np.empty((*shape, width)) if out is None else out
    except MemoryError:
        need = 8 * width * math.prod(shape) / 2**30
        raise ParameterError(f"{need:.3g} GiB for {math.prod(shape)} results: ask for fewer at a time.") from None
    if not (isinstance(result, np.ndarray) and result.dtype.kind == "f" and result.flags.writeable):
        raise ParameterError("out: expected an array of floating-point numbers that may be written to.")
    if result.shape != (*shape, width):
        raise ParameterError(f"out has the shape {result.shape}: expected {(*shape, width)}.")
    target, shape = (result, shape) if shape else (result[None], (1,))
    for index in pieces(shape, chunk):
        target[index] = function(*(each.at(shape, index) for each in directions))
    return result


def pieces(shape: tuple[int, ...], chunk: int) -> Iterator[tuple[Any, ...]]:
    """Indices that select up to ``chunk`` entries of an array of this shape, until all were selected."""
    total = int(np.prod(shape))
    for start in range(0, total, chunk):
        stop = min(start + chunk, total)
        yield (slice(start, stop),) if len(shape) == 1 else np.unravel_index(np.arange(start, stop), shape)
