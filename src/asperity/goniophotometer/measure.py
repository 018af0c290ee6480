"""Runs the instrument: tiles, directions and batches of paths."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import ParameterError
from .measurement import Measurement, check_alike
from .microgeometry import Microgeometry, Piece
from .sensors import Hemisphere, Points, Sensor, check_angles
from .tile import VISIBLE, Tile
from .tracer import EXTRA, Settings, trace

BATCH = 2**20
"""Paths in one kernel launch, at most: they fill any processor, and little memory."""
PATHS, TILES = 4_000_000, 32
INTERVAL = 60.0
"""Seconds from one checkpoint to the next."""
COPIES = 5
"""Of the counts, at the same time: themselves, a checkpoint, and three while it is written."""
ENDLESS = 10_000
"""Scatterings that stand for all of them; what is left is counted as cut."""


def measure(
    geometry: Microgeometry,
    incident: Sequence[tuple[float, float]],
    *,
    sensor: Sensor | None = None,
    orders: int | None = None,
    apart: int = 1,
    paths: float = PATHS,
    tiles: int = TILES,
    seed: int = 0,
    wavelengths: Sequence[float] | None = None,
    before: Measurement | None = None,
    about: dict[str, Any] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    stop: Callable[[], bool] = lambda: False,
    checkpoint: Callable[[Measurement], None] | None = None,
    interval: float = INTERVAL,
) -> Measurement:
    """Measure the BSDF of a microgeometry.

    Parameters
    ----------
    incident : directions of incidence, (θ, φ) in degrees, θ in [0, 90)
    sensor : a `Hemisphere` (the default), a `Window`, or `Points` for next-event estimation
    orders : the highest order of scattering that is followed; all of them if None
    apart : how many orders are counted apart; the last one takes all that follow
    paths : per direction, shared among the tiles
    tiles : how many tiles are drawn; the standard error comes from their differences, so at least 2
    seed : the same seed gives the same result, bit for bit, on any machine of the same kind
    wavelengths : in nm, as many as the spectral variant has channels
    before : a measurement of the same thing. If it was stopped, it is taken up to what it was asked for, whatever
        ``paths`` is: the result is that of one that was not stopped, bit for bit. If it is finished, its tiles get as
        many ``paths`` more. (Other seeds, more tiles: see `merge`.)
    about : what else to note in the result
    progress(done, total) : called after each batch of paths
    stop() : asked after each batch; True ends the measurement with what there is
    checkpoint(measurement) : called with what there is, to save it, say, every ``interval`` seconds, and not so often
        if it takes more than a tenth of that

    Raises ParameterError for what cannot be measured, or not with the memory that there is.
    """
    sensor = sensor or Hemisphere()
    check_angles(incident)
    check_effort(incident, paths, tiles, seed)
    for name, order in (("orders", orders), ("apart", apart)):
        if order is not None:
            _check_whole(name, order, 1)
    settings = Settings(orders or ENDLESS, min(apart, orders or apart), _wavelengths(wavelengths))
    result = _empty(geometry, incident, sensor, settings, tiles, seed, about or {})
    if before is not None:
        check_alike(before, result, "continuing")
        result = before.copy()
    # Each path of a batch aims at one of the points: every point must get as many.
    share = sensor.cells if isinstance(sensor, Points) else 1
    batch = max(BATCH // share, 1) * share
    if result.finished:
        quota = -(-int(paths) // (len(result.labels) * share)) * share
        result = replace(result, goal=result.paths.max(axis=1) + quota)
    missing = np.maximum(result.goal[:, None] - result.paths, 0)
    done, total, due = 0, int(missing.sum()), time.monotonic() + interval
    while done < total:
        for row, (tile_seed, number) in enumerate(result.labels):
            if np.all(result.paths[row] >= result.goal[row]):
                continue
            tile = geometry.piece(np.random.default_rng([tile_seed, number]))
            if isinstance(sensor, Points):
                _check_facets(tile)
            if done == 0:
                _warn_of_repetition(tile, result.incident)
            for k, wi in enumerate(result.wi):
                # Batches begin at the same paths, and have the same numbers, wherever the measurement was stopped.
                lanes = min(batch, int(result.goal[row] - result.paths[row, k]))
                if lanes <= 0:
                    continue
                stream = np.random.SeedSequence([int(tile_seed), int(number), k, int(result.paths[row, k])])
                result.energy[row, k] += trace(tile, sensor, wi, settings, stream, lanes)
                result.paths[row, k] += lanes
                done += lanes
                progress(done, total)
                if stop():
                    return result
                if checkpoint is not None and time.monotonic() >= due:
                    due = _saved(checkpoint, result) + interval
    return result


def _saved(checkpoint: Callable[[Measurement], None], result: Measurement) -> float:
    """Hand over what there is; return the time from which to count to the next."""
    start = time.monotonic()
    checkpoint(result.copy())
    end = time.monotonic()
    return end + 9 * (end - start)


def _empty(geometry, incident, sensor, settings, tiles, seed, about) -> Measurement:
    """A measurement of no paths."""
    channels = dr.size_v(mi.UnpolarizedSpectrum)
    names = [f"{w:g} nm" for w in settings.wavelengths] or list("RGB" if channels == 3 else "Y")
    shape = (tiles, len(incident), settings.orders, sensor.cells + EXTRA, channels)
    _check_memory(*shape)
    return Measurement(
        about
        | {
            "geometry": geometry.description,
            "sensor": sensor.describe(),
            "limit": settings.limit,
            "orders": settings.orders,
            "channels": names,
        },
        np.array(incident, dtype=float),
        np.stack([np.full(tiles, seed), np.arange(tiles)], axis=1),
        np.zeros(shape[:2], dtype=np.int64),
        np.zeros(shape, dtype=np.uint64),
    )


def _check_memory(tiles: int, directions: int, orders: int, columns: int, channels: int) -> None:
    """Raise ParameterError if the machine has less memory than so many counts, and what is made of them, need."""
    need = COPIES * 8 * tiles * directions * orders * columns * channels
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # Windows does not tell
        return
    if need > there:
        raise ParameterError(
            f"tiles = {tiles}, {directions} directions of incidence, {orders} orders apart, {columns - EXTRA} cells "
            f"and {channels} channels need {need / 2**30:.3g} GiB of memory, and this machine has {there / 2**30:.3g}. "
            "Measure fewer of one of these."
        )


def check_effort(incident: Sequence[Any], paths: float, tiles: int, seed: int) -> None:
    """Raise ParameterError for numbers with which nothing can be measured."""
    if not incident:
        raise ParameterError("theta: expected at least one direction of incidence.")
    _check_whole("tiles", tiles, 2)
    _check_whole("seed", seed, 0)
    if not 1 <= paths <= 1e13:  # nor NaN
        raise ParameterError(f"paths = {paths:g}: expected a number in [1, 1e13].")


def _check_whole(name: str, value: Any, least: int) -> None:
    if not (isinstance(value, int) and least <= value < 2**63):
        raise ParameterError(f"{name} = {value!r}: expected a whole number in [{least}, 2^63).")


def _wavelengths(given: Sequence[float] | None) -> tuple[float, ...]:
    """The wavelengths of the channels; none in RGB."""
    if not dr.is_jit_v(mi.Float):
        raise ParameterError(f"variant {mi.variant()}: the goniophotometer traces arrays; use llvm_ad_rgb, say.")
    if not mi.is_spectral:
        if given is not None:
            raise ParameterError(f"wavelengths: variant {mi.variant()} has none; use a spectral one.")
        return ()
    chosen = tuple(float(w) for w in given or VISIBLE)
    channels = dr.size_v(mi.UnpolarizedSpectrum)
    if len(chosen) != channels or not all(360 <= w <= 830 for w in chosen):
        raise ParameterError(f"wavelengths = {chosen}: expected {channels} of them, in [360, 830] nm.")
    return chosen


def _warn_of_repetition(piece: Piece, incident: np.ndarray) -> None:
    """Light that crosses more than a tile on its way in meets the same things again, unlike on an endless surface."""
    theta = incident[:, 0].max()
    if isinstance(piece, Tile) and piece.random:
        crossed = (piece.top - piece.bottom) * np.tan(np.radians(theta)) / min(piece.width, piece.depth)
        if crossed > 1:
            warnings.warn(
                f"theta = {theta:g}: light crosses {crossed:.1f} tiles on its way in, and they repeat; larger ones, of "
                "more grains, say, would be nearer to an endless surface.",
                stacklevel=3,
            )


def _check_facets(piece: Piece) -> None:
    """Light cannot be sent from mirrors to given directions."""
    for name, bsdf in piece.facets().items():
        if int(bsdf.flags()) & int(mi.BSDFFlags.Delta):
            raise ParameterError(
                f"points: the facets of {name!r} are mirrors ({bsdf.class_name()}): no light leaves "
                "them in exactly these directions. Use a hemisphere or a window."
            )
