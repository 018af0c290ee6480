"""Writes a measurement, or any BRDF, as the file that Mitsuba's own plugin ``measured`` renders (the RGL format).

>>> write(measure(ExplicitGrains(tau_0=0.5), [(theta, 0) for theta in (0, 15, 30, 45, 60, 75, 85)]), "grains.bsdf")
>>> mi.load_dict({"type": "measured", "filename": "grains.bsdf"})

The format is that of J. Dupuy and W. Jakob, An Adaptive Parameterization for Efficient Material Acquisition and
Rendering, 2018. What follows was found out from the plugin of Mitsuba 3.9.1, by feeding it tables:

- It returns f cosθ_o (no cosine of its own) = spectra(m) ndf(m) / (4 sigma(wi)), the last factor if ``jacobian`` = 1,
  and 0 where wi or wo is below the horizon. It cuts no negative values. m is the half vector.
- Tables are bilinear, their vertices on the edges of the unit square; the last axis is u = sqrt(2 θ_m / π), the one
  before it is (φ_m - φ_i + π) / 2π, or (φ_m + π) / 2π if anisotropic; sigma has those of wi. A ``vndf`` that is not
  constant warps the square.
- Between angles of incidence it interpolates linearly at the same m; beyond the first and the last it keeps them.
- One or two φ_i mean isotropic. With more, round(2π / (last - first)) is the number of parts that mirrors make a full
  circle from, and φ_i is in (-π, π]. A circle that overlaps itself a little is one part, and has no seam.
- It samples m by ``luminance``, then ``vndf``; where wo is below the horizon the weight is 0.

So the tables are, by numbers (error of f cosθ_o over the hemisphere; grains of beta 0.3, GGX of alpha 0.4, matte):

- ``vndf`` constant: m itself is tabulated, 64 x 64 of it err by 0.1 to 0.4%. A vndf made from the measured luminance
  erred by 0.3 to 1.4%, and had weights up to 12 times their mean.
- ``luminance`` f cosθ_o dω_o/du: weights vary by 2 to 14%, and are at most 1.2 times their mean.
- ``sigma`` cosθ_i, ``spectra`` f cosθ_o cosθ_i: half-way between angles of incidence 15 degrees apart the error is
  1 to 8%; without this cosine, up to 24% for the grains, though 2% and not 5% for the matte surface.
- f, not f cosθ_o, is bilinear between the centres of cells, then multiplied by the cosine; this adds what the cells
  themselves blur (for 32 x 64 of them, GGX: 0.5% at θ_i = 0, 2% at 85 degrees).
"""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from ..errors import ParameterError
from ..files import atomically
from .measurement import Measurement
from .sensors import Hemisphere, Sensor, directions

SIGMA = 4096
"""Vertices of the table of cosines along θ_i: many, since it bends at the last θ_i, where cosines are small."""


def write(measurement: Measurement, path: str | Path) -> None:
    """Write ``measurement``, on a `Hemisphere`, all orders together, for the plugin ``measured``.

    One φ_i means that the material is isotropic: its mirror images are averaged. Several must divide the circle evenly,
    each with the same θ_i. Beyond the first and last θ_i the plugin keeps their values, which darkens rims: 0 and, say,
    89 degrees are good ends. A measurement in RGB or mono is for RGB variants, one at wavelengths for spectral ones.
    Light that goes downwards is left out.
    """
    sensor, values = measurement.sensor, measurement.summed.value
    theta, phi, rows = angles_of_incidence(sensor, measurement.incident)
    assert isinstance(sensor, Hemisphere)
    if not (np.all(np.isfinite(values)) and np.all(measurement.paths.sum(axis=0))):
        raise ParameterError("values: expected finite ones in all directions of incidence.")
    start = measurement.incident[0, 1] if len(phi) == 1 else 0.0
    n = max(sensor.rows, sensor.columns)

    def slice(row: int) -> tuple[np.ndarray, ...]:
        return _tables(lambda wo: _between_cells(sensor, values[row], wo), measurement.wi[row], n, start)

    slices = [slice(row) for row in rows.flat]
    if len(phi) == 1:
        slices = [tuple((x + x[..., ::-1, :]) / 2 for x in one) for one in slices]
    _write(path, theta, phi, slices, measurement.channels, measurement.about)


def tabulate(
    f: Callable[[np.ndarray, np.ndarray], np.ndarray],
    path: str | Path,
    theta: Sequence[float],
    phi: Sequence[float],
    n: int,
    channels: Sequence[str],
    about: Any = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Write any BRDF: f (n, channels) in 1/sr, for ``wi`` and ``wo`` (n, 3) above the surface.

    ``theta`` and ``phi`` are angles of incidence, in degrees, as `write` has them; ``n`` counts θ_m, and φ_m (the
    plugin wants as many). ``about`` becomes the description in the file.
    """
    incident = directions([(t, p) for p in phi for t in theta])
    start = phi[0] if len(phi) == 1 else 0.0

    def slice(k: int) -> tuple[np.ndarray, ...]:
        progress(k, len(incident))
        return _tables(lambda wo: f(np.broadcast_to(incident[k], wo.shape), wo), incident[k], n, start)

    slices = [slice(k) for k in range(len(incident))]
    _write(path, np.radians(theta), np.radians(phi), slices, channels, about)


def _write(
    path: str | Path,
    theta: np.ndarray,
    phi: np.ndarray,
    slices: Sequence[tuple[np.ndarray, ...]],
    channels: Sequence[str],
    about: Any,
) -> None:
    """Write `_tables` of all angles of incidence, θ_i fastest, in radians."""
    from mitsuba.python import tensor_io

    table, luminance = (np.stack(x).reshape(len(phi), len(theta), *x[0].shape) for x in zip(*slices))
    if len(phi) == 1:
        phi = np.zeros(1)
    else:
        around = [len(phi) - 1, *range(len(phi)), 0]
        phi = phi[around] + 2 * np.pi * np.array([-1, *np.zeros(len(phi)), 1])
        table, luminance = table[around], luminance[around]
    fields = {}
    if channels[0].endswith(" nm"):
        wavelengths = np.array([float(name.removesuffix(" nm")) for name in channels])
        order = np.argsort(wavelengths)
        fields = {"wavelengths": wavelengths[order], "spectra": table[:, :, order]}
    else:
        fields = {"rgb": np.broadcast_to(table, (*table.shape[:2], 3, *table.shape[3:]))}
    cosine = np.cos(np.minimum(_theta(np.linspace(0, 1, SIGMA)), theta[-1]))
    fields |= {
        "phi_i": phi,
        "theta_i": theta,
        "ndf": np.full((2, 2), 4),
        "sigma": np.tile(cosine, (2, 1)),
        "vndf": np.ones((len(phi), len(theta), 2, 2)),
        "luminance": luminance,
    }
    with atomically(Path(path)) as part, contextlib.redirect_stdout(io.StringIO()):
        tensor_io.write(
            str(part),
            description=json.dumps(about),
            jacobian=np.ones(1, dtype=np.uint8),
            **{name: values.astype(np.float32) for name, values in fields.items()},
        )


def angles_of_incidence(sensor: Sensor, incident: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """θ_i and φ_i in radians, φ_i from [-π, π), and the rows (φ_i, θ_i) of a measurement that belong to them.

    Raises ParameterError if what is measured so cannot be written.
    """
    if not isinstance(sensor, Hemisphere):
        raise ParameterError(f"sensor = {sensor.kind!r}: expected a hemisphere, for all directions.")
    row = {(theta, (phi + 180) % 360 - 180): k for k, (theta, phi) in enumerate(np.asarray(incident).tolist())}
    thetas, phis = (list(dict.fromkeys(angles)) for angles in zip(*row))
    if len(thetas) < 2 or thetas != sorted(thetas):
        raise ParameterError(f"theta = {thetas}: expected at least two θ_i, increasing.")
    phis.sort()
    even = np.allclose(np.diff(phis), 360 / len(phis), atol=0.01)
    if not even or not len(incident) == len(row) == len(thetas) * len(phis):
        raise ParameterError(f"phi = {phis}: expected one φ_i, or some that divide the circle evenly, for each θ_i.")
    rows = np.array([[row[theta, phi] for theta in thetas] for phi in phis])
    return np.radians(thetas), np.radians(phis), rows


def _tables(
    f: Callable[[np.ndarray], np.ndarray], wi: np.ndarray, n: int, start: float
) -> tuple[np.ndarray, np.ndarray]:
    """`spectra` (channels, n, n) and `luminance` (n, n) of one direction of incidence.

    ``f`` (k, channels) is asked for ``wo`` (k, 3) above the surface; azimuths begin at ``start``.
    """
    u, turn = np.meshgrid(np.linspace(0, 1, n), np.linspace(-180, 180, n))
    m = directions(np.stack([np.degrees(_theta(u)), turn + start], axis=-1).reshape(-1, 2))
    i_m = m @ wi
    wo = 2 * i_m[:, None] * m - wi
    above = (i_m > 0) & (wo[:, 2] > 0)
    found = f(wo[above]) * wo[above, 2:]
    value = np.zeros((found.shape[1], len(m)))
    value[:, above] = found.T
    value = value.reshape(-1, n, n)
    density = np.maximum(value.mean(axis=0), 0) * u * np.sin(_theta(u)) * i_m.clip(0).reshape(n, n)
    return value * wi[2], density if density.any() else np.ones((n, n))


def _between_cells(sensor: Hemisphere, values: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (n, channels) at directions (n, 3), from means of f cosθ_o over the cells (cells, channels).

    It is bilinear, across the pole, and even at the rim.
    """
    cosine = 1 - (np.arange(sensor.rows) + 0.5) / sensor.rows  # its mean over a cell, too
    turn = np.arctan2(wo[:, 1], wo[:, 0]) / (2 * np.pi) % 1
    where = [(1 - np.clip(wo[:, 2], 0, 1)) * sensor.rows + 0.5, turn * sensor.columns + 0.5]
    found = []
    for channel in values.T:
        f = channel.reshape(sensor.rows, sensor.columns) / cosine[:, None]
        f = np.concatenate([np.roll(f[:1], sensor.columns // 2, axis=1), f, f[-1:]])
        found.append(map_coordinates(np.pad(f, ((0, 0), (1, 1)), "wrap"), where, order=1, mode="nearest"))
    return np.stack(found, axis=-1)


def _theta(u: np.ndarray) -> np.ndarray:
    """The angle from the normal that a table's last axis stands for."""
    return u**2 * np.pi / 2
