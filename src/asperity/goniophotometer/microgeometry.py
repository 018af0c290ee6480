"""What the goniophotometer measures: a surface that repeats, as a scene of Mitsuba's."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import mitsuba as mi
import numpy as np


class Tile(NamedTuple):
    """One period of a surface. Its normal is z; the middle of the tile is the origin of x and y.

    Shapes of ``scene`` that stick out of the tile must be there twice: once more where the next tile's stick in.
    """

    scene: mi.Scene
    width: float  # period in x
    depth: float  # period in y
    bottom: float  # height below which there is nothing
    top: float  # height above which there is nothing
    window: float = np.inf  # side of the square through which a batch of rays enters: coherent rays are fast rays


class Microgeometry(Protocol):
    """A kind of surface, from which tiles are drawn."""

    @property
    def description(self) -> dict[str, Any]:
        """What identifies it in a file of measurements; numbers, words, lists and dictionaries only."""
        ...

    def tile(self, rng: np.random.Generator) -> Tile:
        """A tile: one of many, if the surface is random, else always the same."""
        ...
