"""What was measured, with standard errors; kept in files, continued and merged."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ParameterError, UnreadableFileError, readable
from ..files import atomically
from . import sensors
from .tracer import BELOW, CUT, ELSEWHERE, EXTRA, UNIT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".npz",)
ARRAYS = {"incident": "f", "labels": "iu", "paths": "iu", "energy": "u", "goal": "iu"}
"""What a file holds to go on from it, and the kinds of numbers (NumPy's letters); ``goal`` may be missing."""


class Estimate(NamedTuple):
    """Values and their standard errors, of the same shape."""

    value: np.ndarray
    error: np.ndarray


def estimate(sums: np.ndarray, paths: np.ndarray) -> Estimate:
    """Mean per path, and its standard error, from sums over the paths of each tile (axis 0).

    The error is that of a ratio estimator over tiles: it holds the noise of the paths and the randomness of the tiles,
    and has one degree of freedom less than there are tiles. NaN where there are no paths, or those of one tile only.
    """
    paths = paths.reshape(paths.shape + (1,) * (sums.ndim - paths.ndim))
    tiles, total = np.count_nonzero(paths, axis=0), paths.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = sums.sum(axis=0) / total
        spread = np.square(sums - paths * mean).sum(axis=0) * (tiles / (tiles - 1))
        return Estimate(mean, np.sqrt(spread) / total)


def with_error(value: float, error: float) -> str:
    """A value with as many digits as its standard error, which gets two, deserves: 0.3670 ± 0.0044."""
    if not np.isfinite(value):
        return "not measured"
    if not (np.isfinite(error) and error > 0):
        return f"{value:.4g} ± {'0' if error == 0 else '?'}"
    digits = int(np.clip(1 - np.floor(np.log10(error)), 0, 6))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


@dataclass(frozen=True)
class Measurement:
    """Light counted by tile, direction of incidence, order of scattering, cell and channel.

    ``about`` says of what and how: the microgeometry, the sensor, the limits. Two measurements that are about the same
    may be merged. One that was stopped has fewer ``paths`` than its ``goal``; `measure` takes it up there.
    """

    about: dict[str, Any]
    incident: np.ndarray  # (directions, 2): θ and φ in degrees
    labels: np.ndarray  # (tiles, 2): seed and number
    paths: np.ndarray  # (tiles, directions)
    energy: np.ndarray  # (tiles, directions, orders, cells + EXTRA, channels), in units
    goal: np.ndarray = None  # type: ignore[assignment]  # (tiles,): paths each direction is to get; by default, has

    def __post_init__(self):
        if self.goal is None:
            object.__setattr__(self, "goal", self.paths.max(axis=1, initial=0))

    @cached_property
    def sensor(self) -> sensors.Sensor:
        """Where the light was collected."""
        return sensors.from_description(self.about["sensor"])

    @cached_property
    def wi(self) -> np.ndarray:
        """Directions of incidence (directions, 3)."""
        return sensors.directions(self.incident)

    @property
    def channels(self) -> list[str]:
        """Names of the channels: R, G and B; Y; or wavelengths in nm."""
        return self.about["channels"]

    @property
    def wavelengths(self) -> list[float] | None:
        """In nm, of the channels; None in RGB."""
        return [float(name.split()[0]) for name in self.channels] if "nm" in self.channels[0] else None

    @property
    def mode(self) -> str:
        """The kind of Mitsuba's variants that have these channels: ``rgb``, ``mono`` or ``spectral``."""
        return "spectral" if self.wavelengths else "mono" if len(self.channels) == 1 else "rgb"

    @cached_property
    def colourful(self) -> bool:
        """Whether the channels hold different values."""
        return bool(np.ptp(self.energy, axis=-1).any())

    @property
    def orders(self) -> int:
        """How many orders were counted apart; the last holds all that follow, up to the limit."""
        return self.energy.shape[2]

    @property
    def total_paths(self) -> int:
        """Over all directions."""
        return int(self.paths.sum())

    @property
    def missing(self) -> np.ndarray:
        """Paths that were asked for and not traced yet: (tiles, directions)."""
        return np.maximum(self.goal[:, None] - self.paths, 0)

    @property
    def finished(self) -> bool:
        """Whether all paths were traced that were asked for."""
        return not self.missing.any()

    def copy(self) -> Measurement:
        """One to add to."""
        return replace(self, paths=self.paths.copy(), energy=self.energy.copy())

    @cached_property
    def values(self) -> Estimate:
        """f |cos θo|, 1/sr, its mean over each cell: (directions, orders, cells, channels)."""
        return self._estimate(self._cells, self.sensor.solid_angle)

    @cached_property
    def summed(self) -> Estimate:
        """`values` of all orders together: (directions, cells, channels)."""
        return self._estimate(self._cells.sum(axis=2), self.sensor.solid_angle)

    @cached_property
    def albedo(self) -> Estimate:
        """Directional albedo by order: (directions, orders, channels)."""
        return self._estimate(self._reflected)

    @cached_property
    def total_albedo(self) -> Estimate:
        """Directional albedo of all orders together: (directions, channels)."""
        return self._estimate(self._reflected.sum(axis=2))

    @cached_property
    def transmitted(self) -> Estimate:
        """Share of the light that left downwards: (directions, channels)."""
        return self._estimate(self._beside(BELOW).sum(axis=2))

    @cached_property
    def cut(self) -> Estimate:
        """Share of the light that was not followed beyond the limit of orders: (directions, channels)."""
        return self._estimate(self._beside(CUT).sum(axis=2))

    @property
    def order_names(self) -> list[str]:
        """What the orders that were counted apart are called; the last one may hold all that follow."""
        more = " and more" if self.about["limit"] > self.orders else ""
        return [f"order {n}" for n in range(1, self.orders)] + [f"order {self.orders}{more}"]

    @property
    def balance(self) -> dict[str, Estimate]:
        """Where the light went, by name, (directions, channels) each: ``albedo``, the total one, and its orders.

        With them ``transmitted`` and ``cut``, if that happened to more than a millionth of the light.
        """
        found = {"albedo": self.total_albedo}
        if self.orders > 1:
            found |= {name: Estimate(*(x[:, n] for x in self.albedo)) for n, name in enumerate(self.order_names)}
        lost = {"transmitted": self.transmitted, "cut": self.cut}
        return found | {name: part for name, part in lost.items() if np.any(part.value > 1e-6)}

    @property
    def wants_tiles(self) -> bool:
        """Whether the errors are mostly the surface's own randomness, which more tiles lower, and more paths do not.

        That is if all errors of the albedo are above zero, and one is four times what so many paths would make it if
        each were reflected, or not, with its whole weight.
        """
        value, error = self.total_albedo
        noise = np.sqrt(np.clip(value * (1 - value), 0, None) / np.maximum(self.paths.sum(axis=0), 1)[:, None])
        return bool(np.any(error > 4 * noise) and np.all(noise > 0))

    @property
    def _cells(self) -> np.ndarray:
        return self.energy[..., : self.sensor.cells, :]

    def _beside(self, what: int) -> np.ndarray:
        return self.energy[..., self.sensor.cells + what, :]

    @property
    def _reflected(self) -> np.ndarray:
        """All that left upwards; what is sent to points comes on top of it."""
        aimed = isinstance(self.sensor, sensors.Points)
        return self._beside(ELSEWHERE) + (0 if aimed else self._cells.sum(axis=3, dtype=np.uint64))

    def _estimate(self, energy: np.ndarray, solid_angle: float = 1.0) -> Estimate:
        value, error = estimate(energy * UNIT, self.paths)
        return Estimate(value / solid_angle, error / solid_angle)

    def save(self, path: str | Path) -> None:
        """Write a NumPy archive: what is needed to go on, and values, errors and directions for everybody else."""
        path = Path(path)
        with atomically(path) as part:
            np.savez_compressed(
                part,
                about=json.dumps(self.about),
                **{name: getattr(self, name) for name in ARRAYS},
                wi=self.wi,
                wo=np.stack([self.sensor.directions(wi)[:, 0] for wi in self.wi]),
                values=self.values.value,
                errors=self.values.error,
                albedo=self.albedo.value,
                albedo_errors=self.albedo.error,
                orders=np.arange(1, self.orders + 1),
            )

    def plot(self, model: dict[str, Any] | None = None) -> Figure:
        """A figure of it, for `savefig`; ``model``, a description, draws a model's values as well."""
        from . import plots

        return plots.figure(self, model)

    @staticmethod
    def load(path: str | Path) -> Measurement:
        """Read what `save` wrote."""
        path = readable("measurement", path, FORMATS)
        try:
            with np.load(path, allow_pickle=False) as file:
                found = Measurement(
                    json.loads(str(file["about"])), **{name: file[name] for name in ARRAYS.keys() & set(file.files)}
                )
            _check_whole(found)
        except Exception as error:  # of zipfile, zlib, NumPy and json: damage shows in any way
            raise UnreadableFileError("measurement", path, FORMATS, f"not written by asperity ({error})") from error
        return found


def _check_whole(measured: Measurement) -> None:
    """Raise if a measurement is at odds with itself."""
    about, energy = measured.about, measured.energy
    tiles, directions = len(measured.labels), len(measured.incident)
    shapes = {
        "incident": (directions, 2),
        "labels": (tiles, 2),
        "paths": (tiles, directions),
        "energy": (tiles, directions, about["orders"], measured.sensor.cells + EXTRA, len(about["channels"])),
        "goal": (tiles,),
    }
    for name, kinds in ARRAYS.items():
        array = getattr(measured, name)
        if array.dtype.kind not in kinds or array.shape != shapes[name]:
            raise ParameterError(f"{name} is of type {array.dtype} and shape {array.shape}, not {shapes[name]}")
    if min(energy.shape) < 1 or min(measured.labels.min(), measured.paths.min(), measured.goal.min()) < 0:
        raise ParameterError("it is empty, or counts below zero")
    sensors.check_angles(measured.incident)
    if energy[measured.paths == 0].any():
        raise ParameterError("light where no path was")
    if not (isinstance(about["geometry"], dict) and isinstance(about["limit"], int)):
        raise ParameterError("it does not say of what it is")


def check_alike(one: Measurement, other: Measurement, doing: str) -> None:
    """Raise ParameterError if two measurements are not about the same."""
    for name in sorted(one.about.keys() | other.about.keys()):
        if one.about.get(name) != other.about.get(name):
            raise ParameterError(f"{doing}: {name} differs: {one.about.get(name)} and {other.about.get(name)}.")
    if not np.array_equal(one.incident, other.incident):
        raise ParameterError(
            f"{doing}: the directions of incidence differ: {one.incident.tolist()} and {other.incident.tolist()}."
        )


def check_tiles(one: Measurement, tiles: int | None, seed: int | None, name: str = "before") -> None:
    """Raise ParameterError if a measurement, called ``name``, has other tiles than are asked for; None is anything."""
    for option, value, had in (("tiles", tiles, {len(one.labels)}), ("seed", seed, set(one.labels[:, 0]))):
        if value is not None and {value} != had:
            raise ParameterError(
                f"{option} = {value}: {name} has {', '.join(map(str, sorted(had)))}. "
                "Measure other tiles into a file of their own, and merge both by `asperity merge`."
            )


def merge(measurements: Sequence[Measurement]) -> Measurement:
    """All the tiles of several measurements of the same thing with different seeds. It is exact: counts are whole."""
    first, *others = measurements
    for other in others:
        check_alike(first, other, "merging")
    labels, paths, energy, goal = (
        np.concatenate([getattr(one, name) for one in measurements]) for name in ("labels", "paths", "energy", "goal")
    )
    unique, counts = np.unique(labels, axis=0, return_counts=True)
    if counts.max() > 1:
        seed = unique[np.argmax(counts)][0]
        raise ParameterError(f"merging: seed {seed} is there twice, and its paths are the same. Use other seeds.")
    order = np.lexsort(labels.T[::-1])
    return Measurement(first.about, first.incident, labels[order], paths[order], energy[order], goal[order])
