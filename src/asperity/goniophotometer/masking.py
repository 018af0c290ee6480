"""Masking alone, for checking a GAF: which points of a surface are seen from a direction, or from two at once.

Points are found by looking straight down, so they are uniform over the plane: exposed points of normal m, by D cos θ.
Of those some face the direction, the *local* term; of these some are not hidden by anything else, the *distant* term
(Heitz 2014; Lucas et al. 2024, Sec. 4.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import ParameterError
from .measure import BATCH, PATHS, TILES, check_effort
from .measurement import Estimate, estimate
from .microgeometry import Microgeometry
from .sensors import Hemisphere, Sensor, check_angles, directions
from .tile import Tile
from .tracer import generator, visible


@dataclass(frozen=True)
class Masking:
    """Counts (tiles, directions, parts, cells) of points by the cell of ``sensor`` that their normal lies in.

    ``parts`` are the names of the scene's shapes.
    """

    sensor: Sensor
    parts: Sequence[str]
    points: np.ndarray  # (tiles, directions)
    exposed: np.ndarray
    facing: np.ndarray
    seen: np.ndarray

    @property
    def local(self) -> Estimate:
        """Share of the exposed points that face the direction (both, if there are two)."""
        return _ratio(self.facing, self.exposed)

    @property
    def distant(self) -> Estimate:
        """Share of the facing points that nothing else hides."""
        return _ratio(self.seen, self.facing)

    @property
    def masking(self) -> Estimate:
        """G: local times distant, the share of the exposed points that is seen."""
        return _ratio(self.seen, self.exposed)

    def visible(self, part: str) -> Estimate:
        """Share of the plane that is ``part``, seen from above and from the direction (both): (directions,)."""
        return estimate(self.seen[:, :, list(self.parts).index(part)].sum(axis=-1).astype(float), self.points)


def measure_masking(
    geometry: Microgeometry,
    wi: Sequence[tuple[float, float]],
    wo: Sequence[tuple[float, float]] | None = None,
    *,
    sensor: Sensor | None = None,
    points: float = PATHS,
    tiles: int = TILES,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Masking:
    """Measure the masking of a height field along directions ``wi``, or the masking-shadowing of pairs ``wi``, ``wo``.

    Parameters are those of `measure`; ``sensor`` cuts the normals of the surface into cells.
    """
    sensor = sensor or Hemisphere()
    pairs = list(zip(wi) if wo is None else zip(wi, wo))
    check_effort(wi, points, tiles, seed)
    if wo is not None and len(wo) != len(wi):
        raise ParameterError(f"wo: expected as many directions as wi has ({len(wi)}).")
    check_angles(wo or ())
    if overhangs := getattr(geometry, "overhangs", 0):
        raise ParameterError(
            f"masking needs a height field, and {overhangs} faces overhang: some of it is out of sight."
        )
    quota = -(-int(points) // tiles) * len(pairs)
    batch = max(BATCH // len(pairs), 1) * len(pairs)  # lanes take the pairs in turn
    counts, parts = [], []
    for number in range(tiles):
        tile = geometry.piece(np.random.default_rng([seed, number]))
        if not isinstance(tile, Tile):
            raise ParameterError(f"masking needs shapes that one can look at, not {type(tile).__name__}.")
        parts = list(tile.facets())
        total: Any = 0
        for done in range(0, quota, batch):
            stream = np.random.SeedSequence([seed, number, done])
            total = total + look(tile, sensor, pairs, stream, min(batch, quota - done))
        counts.append(total)
        progress(len(counts) * quota, tiles * quota)
    exposed, facing, seen = np.moveaxis(np.array(counts), 1, 0)
    return Masking(sensor, parts, np.full(exposed.shape[:2], quota // len(pairs)), exposed, facing, seen)


def look(tile: Tile, sensor: Sensor, pairs: Sequence, seed: np.random.SeedSequence, lanes: int) -> np.ndarray:
    """Counts (exposed / facing / seen, pairs, parts, cells) of points that are seen along both directions of a pair."""
    box = tile.rays()
    rng, corner = generator(seed, lanes)
    step = box.step(rng, box.enter(rng, corner, lanes), mi.Vector3f(0, 0, -1), mi.Bool(True))
    si, shapes = step.si, tile.scene.shapes()
    part = sum(dr.select(si.shape == mi.ShapePtr(shape), k, mi.UInt32(0)) for k, shape in enumerate(shapes))
    cell, inside = sensor.locate(mi.Vector3f(si.n))
    pair = dr.arange(mi.UInt32, lanes) % len(pairs)
    exposed = facing = seen = step.hit & inside
    for angles in zip(*pairs):
        w = dr.gather(mi.Vector3f, mi.Vector3f(directions(angles).T), pair)
        faces = dr.dot(si.n, w) > 0
        facing = facing & faces
        seen = seen & faces & visible(box, rng, box.leave(si, w), w, seen & faces)
    shape = (3, len(pairs), len(shapes), sensor.cells)
    counts = dr.zeros(mi.UInt32, int(np.prod(shape)))
    for k, which in enumerate((exposed, facing, seen)):
        dr.scatter_inc(counts, ((k * len(pairs) + pair) * len(shapes) + part) * sensor.cells + cell, which)
    return np.array(counts).reshape(shape)


def _ratio(part: np.ndarray, whole: np.ndarray) -> Estimate:
    """A ratio of counts over tiles (axis 0); NaN where there is nothing. None is known better than to one point."""
    value, error = estimate(part.astype(float), whole)
    return Estimate(value, np.maximum(error, 1 / np.maximum(whole.sum(axis=0), 1)))
