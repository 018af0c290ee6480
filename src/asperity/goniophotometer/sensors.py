"""Where light is collected: cells of equal solid angle over the hemisphere or a window of it, or exact directions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import ParameterError, UnknownNameError, refuse_unused

CENTRES = ("retro", "mirror", "normal")
"""Of windows."""


class Sensor:
    """A number of cells of equal solid angle, in a frame that may turn with the direction of incidence."""

    kind: ClassVar[str]
    cells: int
    solid_angle: float
    """Of a cell, in steradians."""

    def axes(self, wi: np.ndarray) -> np.ndarray:
        """The sensor's x, y and z in the surface's frame, as rows."""
        return np.eye(3)

    def locate(self, w: mi.Vector3f) -> tuple[mi.UInt32, mi.Bool]:
        """The cell that ``w``, above the surface and in the sensor's frame, falls into, and whether there is one."""
        raise NotImplementedError

    def grid(self, k: int) -> np.ndarray:
        """Directions (cells, k², 3) in the sensor's frame that cover each cell evenly."""
        raise NotImplementedError

    def directions(self, wi: np.ndarray, k: int = 1) -> np.ndarray:
        """Directions (cells, k², 3) in the surface's frame that cover each cell evenly; its centre for ``k`` = 1."""
        return self.grid(k) @ self.axes(wi)

    def describe(self) -> dict[str, Any]:
        """What `from_description` makes this sensor from."""
        fields = asdict(self)  # type: ignore[call-overload]  # every sensor is a dataclass
        return json.loads(json.dumps({"kind": self.kind} | fields))  # as it comes back from a file: lists, no tuples


@dataclass(frozen=True)
class Hemisphere(Sensor):
    """``rows`` rings of equal height, from the normal to the horizon, cut into ``columns`` sectors from φ = 0 on."""

    rows: int = 32
    columns: int = 64
    kind: ClassVar[str] = "hemisphere"

    def __post_init__(self):
        _counts(rows=self.rows, columns=self.columns)

    @property
    def cells(self) -> int:  # type: ignore[override]
        """Rows times columns, counted row by row."""
        return self.rows * self.columns

    @property
    def solid_angle(self) -> float:  # type: ignore[override]
        """2π / cells."""
        return 2 * np.pi / self.cells

    def locate(self, w):
        """Every direction is in a cell."""
        row = dr.minimum(mi.UInt32((1 - dr.clip(w.z, 0, 1)) * self.rows), self.rows - 1)
        turn = dr.atan2(w.y, w.x) * dr.inv_two_pi
        column = dr.minimum(mi.UInt32((turn - dr.floor(turn)) * self.columns), self.columns - 1)
        return row * self.columns + column, mi.Bool(True)

    def grid(self, k):
        """Even in height and azimuth."""
        steps = (np.arange(k) + 0.5) / k
        z = 1 - (np.arange(self.rows)[:, None] + steps) / self.rows
        phi = (np.arange(self.columns)[:, None] + steps) / self.columns * 2 * np.pi
        z, phi = np.broadcast_arrays(z[:, None, :, None], phi[None, :, None, :])
        r = np.sqrt(1 - z**2)
        return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).reshape(self.cells, k * k, 3)


@dataclass(frozen=True)
class Window(Sensor):
    """A square of ``n`` x ``n`` cells about a direction, in Lambert's equal-area projection.

    ``about`` is ``retro`` (wi itself), ``mirror`` or ``normal``; ``radius`` is half the window's width in degrees.
    Rows go along the plane of incidence, columns across it. Part of the window may lie below the horizon.
    """

    about: str = "retro"
    radius: float = 10.0
    n: int = 32
    kind: ClassVar[str] = "window"

    def __post_init__(self):
        _counts(n=self.n)
        if self.about not in CENTRES:
            raise UnknownNameError("centre of a window", self.about, CENTRES)
        if not 0 < self.radius <= 60:
            raise ParameterError(f"radius = {self.radius}: expected half a window's width, in (0, 60] degrees.")

    @property
    def cells(self) -> int:  # type: ignore[override]
        """n²."""
        return self.n**2

    @property
    def half_width(self) -> float:
        """In the projection, where areas are solid angles."""
        return float(2 * np.sin(np.radians(self.radius) / 2))

    @property
    def solid_angle(self) -> float:  # type: ignore[override]
        """The window's area in the projection, shared equally."""
        return (2 * self.half_width / self.n) ** 2

    def axes(self, wi):
        """Away from the normal, across the plane of incidence, and the centre."""
        phi = np.arctan2(wi[1], wi[0])
        x, y, z = wi
        centre = np.array({"retro": (x, y, z), "mirror": (-x, -y, z), "normal": (0, 0, 1)}[self.about])
        across = np.array([-np.sin(phi), np.cos(phi), 0])
        return np.array([np.cross(across, centre), across, centre])

    def locate(self, w):
        """Directions outside the window are in no cell."""
        scale = dr.rsqrt(dr.maximum((1 + w.z) / 2, 1e-6)) / (2 * self.half_width)
        u, v = w.x * scale + 0.5, w.y * scale + 0.5
        inside = (u >= 0) & (u < 1) & (v >= 0) & (v < 1)
        row, column = (dr.minimum(mi.UInt32(dr.clip(x, 0, 1) * self.n), self.n - 1) for x in (u, v))
        return row * self.n + column, inside

    def grid(self, k):
        """Even in the projection."""
        x = ((np.arange(self.n)[:, None] + (np.arange(k) + 0.5) / k) / self.n * 2 - 1) * self.half_width
        u, v = np.broadcast_arrays(x[:, None, :, None], x[None, :, None, :])
        square = u**2 + v**2
        stretch = np.sqrt(1 - square / 4)
        return np.stack([u * stretch, v * stretch, 1 - square / 2], axis=-1).reshape(self.cells, k * k, 3)


@dataclass(frozen=True)
class Points(Sensor):
    """Exact directions, (θ, φ) in degrees, reached by next-event estimation: no error from cells, no mirrors either.

    Each path aims at one of the points.
    """

    angles: tuple[tuple[float, float], ...]
    kind: ClassVar[str] = "points"

    def __post_init__(self):
        object.__setattr__(self, "angles", tuple((float(theta), float(phi)) for theta, phi in self.angles))
        if not self.angles:
            raise ParameterError("angles: expected at least one direction.")
        check_angles(self.angles)

    @property
    def cells(self) -> int:  # type: ignore[override]
        """One a point."""
        return len(self.angles)

    @property
    def solid_angle(self) -> float:  # type: ignore[override]
        """What makes the mean over all paths a value: a path in ``cells`` aims at this point."""
        return 1 / self.cells

    def locate(self, w):
        """Light is sent to the points; none is collected."""
        return mi.UInt32(0), mi.Bool(False)

    def grid(self, k):
        """The points themselves."""
        return np.broadcast_to(directions(self.angles)[:, None], (self.cells, k * k, 3))


SENSORS = {sensor.kind: sensor for sensor in (Hemisphere, Window, Points)}
OPTIONS = {"hemisphere": ("cells",), **dict.fromkeys(CENTRES, ("cells", "radius")), "points": ("towards",)}
"""What `by_name` knows, and the options that shape it."""


def by_name(
    name: str | None = None,
    *,
    cells: Sequence[int] | None = None,
    radius: float | None = None,
    towards: Sequence[tuple[float, float]] | None = None,
) -> Sensor:
    """The sensor of a name, for those who have words: ``hemisphere``; ``retro``, ``mirror`` or ``normal``; ``points``.

    Parameters
    ----------
    name : a hemisphere if None, or points if there are some in ``towards``
    cells : rows and columns of a `Hemisphere`; the one number of a `Window`
    radius : half the width of a window in degrees
    towards : the angles of `Points`

    Raises ParameterError for an option that the sensor does not have, and where it raises one itself.
    """
    name = name or ("points" if towards else "hemisphere")
    if name not in OPTIONS:
        raise UnknownNameError("sensor", name, OPTIONS)
    refuse_unused({"cells": cells, "radius": radius, "towards": towards}, OPTIONS[name], f"sensor {name}")
    if name == "points":
        if not towards:
            raise ParameterError("towards: sensor points needs the directions, such as 60:0,30:180.")
        return Points(tuple(towards))
    count, form = (2, "ROWSxCOLUMNS") if name == "hemisphere" else (1, "N")
    if cells is not None and len(cells) != count:
        raise ParameterError(f"cells: sensor {name} takes {form}.")
    if name == "hemisphere":
        return Hemisphere(*(cells or ()))
    window = Window(name) if radius is None else Window(name, radius)
    return window if cells is None else replace(window, n=cells[0])


def from_description(description: dict[str, Any]) -> Sensor:
    """The sensor that `Sensor.describe` described."""
    return SENSORS[description["kind"]](**{name: value for name, value in description.items() if name != "kind"})


def directions(angles: Any) -> np.ndarray:
    """Unit vectors (n, 3) of directions (n, 2), θ and φ in degrees."""
    theta, phi = np.radians(np.asarray(angles, dtype=float)).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def check_angles(angles: Any) -> None:
    """Raise ParameterError for a θ that is not in [0, 90) degrees: at 90 no light reaches the surface."""
    for theta, phi in angles:
        if not (0 <= theta < 90 and np.isfinite(phi)):
            raise ParameterError(f"theta = {theta:g}, phi = {phi:g}: expected θ in [0, 90) degrees, and a finite φ.")


def _counts(**counts: int) -> None:
    for name, count in counts.items():
        if not (isinstance(count, int) and 1 <= count <= 4096):
            raise ParameterError(f"{name} = {count}: expected a whole number in [1, 4096].")
