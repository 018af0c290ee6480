"""Runs the instrument: pieces, directions and batches of paths."""

from __future__ import annotations

import json
import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import ParameterError
from .measurement import Measurement, check_alike, check_tiles
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
    tiles: int | None = None,
    seed: int | None = None,
    wavelengths: Sequence[float] | None = None,
    before: Measurement | None = None,
    about: dict[str, Any] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    stop: Callable[[], bool] = lambda: False,
    checkpoint: str | Path | Callable[[Measurement], None] | None = None,
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
    tiles : how many pieces of the surface are drawn, 32 if None; the standard error comes from their differences, so at
        least 2
    seed : 0 if None; the same seed gives the same result, bit for bit, on any machine of the same kind
    wavelengths : in nm, as many as the spectral variant has channels
    before : a measurement of the same thing. If it was stopped, it is taken up to what it was asked for, whatever
        ``paths`` is: the result is that of one that was not stopped, bit for bit. If it is finished, its tiles get as
        many ``paths`` more. (Other seeds, more tiles: see `merge`.)
    about : what else to note in the result: numbers, words, lists and dictionaries
    progress(done, total) : called after each batch of paths
    stop() : asked after each batch; True ends the measurement with what there is
    checkpoint : a file, .npz, to save what there is to, every ``interval`` seconds, and not so often if that takes more
        than a tenth of the time; if it cannot be written, there is a warning. Or what to call with a `Measurement`

    Raises ParameterError for what cannot be measured, or not with the memory that there is.
    """
    check_effort(incident, paths, tiles, seed)
    sensor, settings = sensor or Hemisphere(), _settings(orders, apart, wavelengths)
    about = _described(geometry, sensor, settings, about or {})
    if before is None:
        result = _empty(about, incident, sensor.cells, TILES if tiles is None else tiles, 0 if seed is None else seed)
    else:
        result = _taken_up(before, about, incident, tiles, seed)
    if result.finished:
        result = _prolonged(result, paths)
    done, total, save = 0, int(result.missing.sum()), _Checkpoints(checkpoint, interval)
    for batch in _batches(geometry, result):
        if done == 0:
            _warn_of_repetition(batch.piece, result.incident)
        wi, counted = result.wi[batch.direction], (batch.tile, batch.direction)
        result.energy[counted] += trace(batch.piece, sensor, wi, settings, batch.seed, batch.paths)
        result.paths[counted] += batch.paths
        done += batch.paths
        progress(done, total)
        if stop():
            break
        save.if_due(result)
    return result


def _settings(orders: int | None, apart: int, wavelengths: Sequence[float] | None) -> Settings:
    """How far to follow paths, and what to tell apart."""
    _check_whole("orders", orders, 1)
    _check_whole("apart", apart, 1)
    return Settings(orders or ENDLESS, min(apart, orders or apart), _wavelengths(wavelengths))


def _described(geometry: Microgeometry, sensor: Sensor, settings: Settings, others: dict[str, Any]) -> dict[str, Any]:
    """What a measurement is about, as it comes back from a file: lists for tuples, which continuing would tell apart.

    Raises ParameterError for what a file cannot keep: now, and not after the tracing.
    """
    channels = [f"{w:g} nm" for w in settings.wavelengths] or list("RGB" if mi.is_rgb else "Y")
    about = others | {
        "geometry": geometry.description,
        "sensor": sensor.describe(),
        "limit": settings.limit,
        "orders": settings.orders,
        "channels": channels,
    }
    for name, description in about.items():
        try:
            about[name] = json.loads(json.dumps(description))
        except TypeError as error:
            raise ParameterError(f"{name}: a measurement cannot keep its description: {error}.") from error
    return about


def _empty(about: dict[str, Any], incident: Sequence[Any], cells: int, tiles: int, seed: int) -> Measurement:
    """A measurement of no paths."""
    shape = (tiles, len(incident), about["orders"], cells + EXTRA, len(about["channels"]))
    _check_memory(*shape)
    labels = np.stack([np.full(tiles, seed), np.arange(tiles)], axis=1)
    paths, energy = np.zeros(shape[:2], dtype=np.int64), np.zeros(shape, dtype=np.uint64)
    return Measurement(about, np.array(incident, dtype=float), labels, paths, energy)


def _taken_up(
    before: Measurement, about: dict[str, Any], incident: Sequence[Any], tiles: int | None, seed: int | None
) -> Measurement:
    """The measurement ``before``, to add to, if it is of what is asked for."""
    check_tiles(before, tiles, seed)
    check_alike(before, replace(before, about=about, incident=np.array(incident, dtype=float)), "continuing")
    _check_memory(*before.energy.shape)
    return before.copy()


def _prolonged(result: Measurement, paths: float) -> Measurement:
    """The measurement with a goal of so many paths more per direction."""
    share = _share(result.sensor)
    quota = -(-int(paths) // (len(result.labels) * share)) * share
    return replace(result, goal=result.paths.max(axis=1) + quota)


class _Batch(NamedTuple):
    """Some paths, from one of the directions of incidence through one of the pieces."""

    piece: Piece
    tile: int
    direction: int
    paths: int
    seed: np.random.SeedSequence


def _batches(geometry: Microgeometry, result: Measurement) -> Iterator[_Batch]:
    """What ``result`` misses, for the caller to add to it: a batch for each direction of each tile, again and again.

    Batches begin at the same paths, and have the same numbers, wherever the measurement was stopped.
    """
    share = _share(result.sensor)
    most = max(BATCH // share, 1) * share
    while not result.finished:
        for row in map(int, np.flatnonzero(result.missing.any(axis=1))):
            label = tuple(map(int, result.labels[row]))
            piece = geometry.piece(np.random.default_rng(label))
            if isinstance(result.sensor, Points):
                _check_facets(piece)
            for k in map(int, np.flatnonzero(result.missing[row])):
                seed = np.random.SeedSequence([*label, k, int(result.paths[row, k])])
                yield _Batch(piece, row, k, min(most, int(result.missing[row, k])), seed)


def _share(sensor: Sensor) -> int:
    """What the number of paths must be a multiple of: each aims at one of the points, and every point gets as many."""
    return sensor.cells if isinstance(sensor, Points) else 1


class _Checkpoints:
    """Saves what there is now and then."""

    def __init__(self, to: str | Path | Callable[[Measurement], None] | None, interval: float):
        self.to, self.interval, self.due = to, interval, time.monotonic() + interval

    def if_due(self, result: Measurement) -> None:
        """Save it if it is time to, and set the next time."""
        start = time.monotonic()
        if self.to is None or start < self.due:
            return
        part = result.copy()  # which remembers values that ``result`` is yet to change
        if callable(self.to):
            self.to(part)
        else:
            try:
                part.save(self.to)
            except OSError as error:  # the next time may be luckier
                warnings.warn(f"no checkpoint: cannot write {self.to}: {error.strerror}.", stacklevel=3)
        end = time.monotonic()
        self.due = end + 9 * (end - start) + self.interval


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


def check_effort(incident: Sequence[Any], paths: float, tiles: int | None, seed: int | None) -> None:
    """Raise ParameterError for numbers with which nothing can be measured; None is the default."""
    if not incident:
        raise ParameterError("theta: expected at least one direction of incidence.")
    check_angles(incident)
    _check_whole("tiles", tiles, 2)
    _check_whole("seed", seed, 0)
    if not (isinstance(paths, Real) and 1 <= paths <= 1e13):  # nor NaN
        raise ParameterError(f"paths = {paths!r}: expected a number in [1, 1e13].")


def _check_whole(name: str, value: Any, least: int) -> None:
    if value is not None and not (isinstance(value, int) and least <= value < 2**63):
        raise ParameterError(f"{name} = {value!r}: expected a whole number in [{least}, 2^63).")


def _wavelengths(given: Sequence[float] | None) -> tuple[float, ...]:
    """The wavelengths of the channels; none in RGB."""
    if not dr.is_jit_v(mi.Float):
        raise ParameterError(f"variant {mi.variant()}: the goniophotometer traces arrays; use llvm_ad_rgb, say.")
    if not mi.is_spectral:
        if given is not None:
            raise ParameterError(f"wavelengths: variant {mi.variant()} has none; use a spectral one.")
        return ()
    chosen = tuple(float(w) for w in (VISIBLE if given is None else given))
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


def _kind(bsdf: Any) -> str:
    """The name of a BSDF's class; a microgeometry's own facets need be none of Mitsuba's."""
    return bsdf.class_name() if isinstance(bsdf, mi.BSDF) else type(bsdf).__name__


def _check_facets(piece: Piece) -> None:
    """Light cannot be sent from mirrors to given directions."""
    for name, bsdf in piece.facets().items():
        if int(bsdf.flags()) & int(mi.BSDFFlags.Delta):
            raise ParameterError(
                f"points: the facets of {name!r} are mirrors ({_kind(bsdf)}): no light leaves them in "
                "exactly these directions. Use a hemisphere or a window."
            )
