"""What is drawn: values of materials, computed in one call each, or measured, with their errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.errors import ParameterError, UnknownNameError
from asperity.goniophotometer import Hemisphere, Measurement, Points, Window
from asperity.goniophotometer.measurement import estimate
from asperity.goniophotometer.plots import sectors
from asperity.goniophotometer.sensors import check_angles, directions
from asperity.goniophotometer.tracer import UNIT
from asperity.lab import evaluate
from asperity.materials import Material

ANGLES = (0.0, 30.0, 60.0)
"""Of incidence, in degrees, if none are asked for."""
MOST = 6
"""Angles that are taken of a measurement unasked."""
STEP, FINE, NEAR = 0.1, 0.01, 2.0
"""Degrees between the points of a curve; the same near the mirrored direction and the light, and how near."""
HORIZON = 89.95
"""Degrees up to which f is drawn: there it is divided by a cosine."""
NEAREST = 0.5
"""Degrees within which a measured point lies in a plane."""


class Curve(NamedTuple):
    """Values (channels, n) at ``x`` (n,), in degrees or nm; standard errors if they were measured."""

    x: np.ndarray
    value: np.ndarray
    error: np.ndarray | None = None


def channels(materials: Sequence[Material], wavelengths: Sequence[float] | None = None) -> list[str]:
    """Names of the channels in which all of these are drawn; raises ParameterError if they have different ones.

    Those of the measurements among them, or else of the variant in use, at ``wavelengths`` in nm if that is spectral.
    """
    measured = {material.name: material.measured for material in materials if material.measured is not None}
    if len({tuple(one.channels) for one in measured.values()}) > 1:
        kinds = "; ".join(f"{name} has {', '.join(one.channels)}" for name, one in measured.items())
        raise ParameterError(f"measurements with different channels have no place in one picture: {kinds}.")
    modelled = len(measured) < len(materials)
    if modelled:
        _check_variant(wavelengths)
    for name, one in measured.items():
        if modelled and (mi.is_spectral, mi.is_monochromatic) != (one.mode == "spectral", one.mode == "mono"):
            mode = f"{', '.join(one.channels)} were measured: choose llvm_ad_{one.mode}, say"
            raise ParameterError(f"variant {mi.variant()}: a model has other channels there than {name}. {mode}.")
        return one.channels
    if mi.is_spectral:
        return [f"{wavelength:g} nm" for wavelength in wavelengths or spread()]
    return ["Y"] if mi.is_monochromatic else ["R", "G", "B"]


def _check_variant(wavelengths: Sequence[float] | None) -> None:
    """Raise ParameterError if no curve can be computed in the variant in use."""
    evaluate.require_arrays("drawing")
    if wavelengths is not None and not mi.is_spectral:
        raise ParameterError(
            f"wavelengths: variant {mi.variant()} has none. Choose a spectral one, such as llvm_ad_spectral."
        )
    for wavelength in wavelengths or ():
        if not mi.MI_CIE_MIN <= wavelength <= mi.MI_CIE_MAX:
            raise ParameterError(f"wavelength = {wavelength:g}: expected nm in [{mi.MI_CIE_MIN:g}, {mi.MI_CIE_MAX:g}].")


def spread() -> np.ndarray:
    """Wavelengths in the middles of equal parts of the visible range, one for each channel of the variant."""
    count = dr.size_v(mi.UnpolarizedSpectrum)
    return evaluate.SHORTEST + (np.arange(count) + 0.5) * (evaluate.LONGEST - evaluate.SHORTEST) / count


def pick(names: Sequence[str], channel: str) -> list[tuple[str, int | None]]:
    """Label and index of each channel to draw: ``mean`` (index None), ``each``, or the name of one."""
    if channel == "mean":
        return [("", None)]
    if channel == "each":
        return [(name, n) for n, name in enumerate(names)]
    if channel not in names:
        raise UnknownNameError("channel", channel, ["mean", "each", *names])
    return [(channel, names.index(channel))]


def single(names: Sequence[str], channel: str) -> int | None:
    """The index of the one channel that a map shows; None for the mean."""
    if channel == "each":
        raise ParameterError(f"channel = each: a map shows one channel. Allowed: mean, {', '.join(names)}.")
    return pick(names, channel)[0][1]


def one(values: np.ndarray, index: int | None) -> np.ndarray:
    """A channel of values (channels, ...), or their mean."""
    return values.mean(axis=0) if index is None else values[index]


def at(material: Material, wi: np.ndarray, wo: np.ndarray, wavelengths: Any = None) -> np.ndarray:
    """f |cos θo| in 1/sr (channels, ...) for directions (..., 3), which are broadcast; raises ParameterError for NaN.

    In spectral variants at ``wavelengths``, any number of them, all in the same call.
    """
    wi, wo = np.broadcast_arrays(wi, wo)
    shape, lanes = wi.shape[:-1], wi[..., 0].size
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    if not mi.is_spectral:
        values = evaluate.at_pairs(material.load(), wi, wo)[:-1]
    else:
        wanted = np.asarray(spread() if wavelengths is None else wavelengths, dtype=float)
        count = dr.size_v(mi.UnpolarizedSpectrum)
        groups = np.pad(wanted, (0, -len(wanted) % count), mode="edge").reshape(-1, count)
        si = evaluate.interaction(evaluate.vectors(np.tile(wi, (len(groups), 1))), len(groups) * lanes)
        si.wavelengths = [mi.Float(np.repeat(column, lanes).astype(np.float32)) for column in groups.T]
        found = material.load().eval(mi.BSDFContext(), si, evaluate.vectors(np.tile(wo, (len(groups), 1))))
        values = evaluate.to_numpy(mi.unpolarized_spectrum(found), len(groups) * lanes)
        values = values.reshape(count, len(groups), lanes).swapaxes(0, 1).reshape(-1, lanes)[: len(wanted)]
    if len(wrong := np.flatnonzero(~np.isfinite(values).all(axis=0))):
        i, o = (np.degrees(np.arccos(w[wrong[0], 2])) for w in (wi, wo))
        first = f"the first at θ_i = {i:.4g}°, θ_o = {o:.4g}°"
        raise ParameterError(f"{material.name} is not finite at {len(wrong)} of {lanes} pairs of directions, {first}.")
    return values.reshape(-1, *shape)


def transmits(material: Material) -> bool:
    """Whether light goes through the surface."""
    return material.measured is None and bool(mi.has_flag(material.load().flags(), mi.BSDFFlags.Transmission))


def incidence(
    materials: Sequence[Material],
    theta: Sequence[float] | None,
    phi: float,
    default: Sequence[float] = ANGLES,
    most: int = MOST,
) -> np.ndarray:
    """The directions of incidence (n, 2) to draw, θ and φ in degrees.

    Those asked for, which all measurements must have; or, of those that all measurements have, ``most`` at most; or
    ``default``. Raises ParameterError.
    """
    measured = [material for material in materials if material.measured is not None]
    if theta is not None:
        check_angles([(one, phi) for one in theta])
        for material in measured:
            for angle in theta:
                row(material, (angle, phi))
        return np.array([(angle, phi) for angle in theta], dtype=float)
    check_angles([(0, phi)])
    if not measured:
        return np.array([(angle, phi) for angle in default], dtype=float)
    common = set.intersection(*(set(_angles(measurement(material), phi)) for material in measured))
    if not common:
        had = "; ".join(f"{material.name}: {_named(measurement(material))}" for material in measured)
        raise ParameterError(f"φ_i = {phi:g}°: no direction of incidence that all measurements have. Measured: {had}.")
    angles = sorted(common)
    chosen = np.unique(np.linspace(0, len(angles) - 1, min(len(angles), most)).round().astype(int))
    return np.array([(angles[n], phi) for n in chosen])


def measurement(material: Material) -> Measurement:
    """What was measured of a material that is a measurement."""
    assert material.measured is not None
    return material.measured


def row(material: Material, incident: tuple[float, float]) -> int:
    """Which direction of incidence of a measurement this is; raises ParameterError if it is none."""
    theta, phi = incident
    near = np.linalg.norm(measurement(material).wi - directions([incident]), axis=1)
    if near.min() > 1e-6:
        had = _named(measurement(material))
        raise ParameterError(f"{material.name}: not measured at θ_i = {theta:g}°, φ_i = {phi:g}°, but at {had}.")
    return int(near.argmin())


def _angles(measured: Measurement, phi: float) -> list[float]:
    """The θ at which light came from this azimuth."""
    theta, azimuth = measured.incident.T
    same = np.abs((azimuth - phi + 180) % 360 - 180) < 1e-6
    return [float(angle) for angle in theta[same | (theta == 0)]]


def _named(measured: Measurement) -> str:
    """The directions of incidence, or the first of them."""
    names = [f"({theta:g}°, {phi:g}°)" for theta, phi in measured.incident[:MOST]]
    return ", ".join(names) + (" ..." if len(measured.incident) > MOST else "")


def in_plane(
    material: Material, incident: np.ndarray, cosine: bool = True, wavelengths: Sequence[float] | None = None
) -> list[Curve]:
    """f |cos θo|, or f, over the plane of incidence: a curve for each direction of incidence (n, 2).

    ``x`` is θo, negative on the side that light comes from; beyond 90 degrees, it is below the surface.
    """
    if material.measured is not None:
        curves = [_measured_in_plane(material, incident[k]) for k in range(len(incident))]
    else:
        x = np.stack([_points(theta, transmits(material), cosine) for theta, _ in incident])
        values = at(material, directions(incident)[:, None], in_azimuth(x, incident[:, 1:]), wavelengths)
        curves = [Curve(x[k], values[:, k]) for k in range(len(x))]
    if cosine:
        return curves
    scales = [1 / np.abs(np.cos(np.radians(curve.x))) for curve in curves]
    return [
        Curve(curve.x, curve.value * scale, None if curve.error is None else curve.error * scale)
        for curve, scale in zip(curves, scales)
    ]


def in_azimuth(x: np.ndarray, phi: np.ndarray | float) -> np.ndarray:
    """Directions (..., 3) at signed θo in the plane of azimuth ``phi``, negative towards it, in degrees."""
    sin, cos, phi = np.sin(np.radians(x)), np.cos(np.radians(x)), np.radians(phi)
    return np.stack(np.broadcast_arrays(-sin * np.cos(phi), -sin * np.sin(phi), cos), axis=-1)


def _points(theta: float, below: bool, cosine: bool) -> np.ndarray:
    """Signed θo of a curve, denser near the light and the mirrored direction; their number is always the same."""
    end = 180.0 if below else 90.0
    even = np.linspace(-end, end, round(2 * end / STEP) + 1)
    fine = np.arange(-NEAR, NEAR + FINE / 2, FINE)
    x = np.sort(np.concatenate([even, theta + fine, -theta + fine]))
    x = np.clip(x, -end, end)
    horizontal = np.abs(np.abs(x) - 90) < 90 - HORIZON
    return x if cosine else np.where(horizontal, np.sign(x) * HORIZON, x)


def _measured_in_plane(material: Material, incident: np.ndarray) -> Curve:
    """What a sensor has measured in the plane of incidence."""
    measured, k = measurement(material), row(material, tuple(incident))
    cells, weights, x = _cells_in_plane(material, incident[1], k)
    energy = measured.energy[:, k].sum(axis=1)[:, cells]  # (tiles, bins, n, channels)
    value, error = estimate((energy * weights[..., None]).sum(axis=2) * UNIT, measured.paths[:, k])
    order = np.argsort(x, kind="stable")
    scale = 1 / measured.sensor.solid_angle
    return Curve(x[order], value[order].T * scale, error[order].T * scale)


def _cells_in_plane(material: Material, phi: float, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells (bins, n) of a sensor that lie in the plane, their weights, and signed θo of the bins."""
    sensor = measurement(material).sensor
    if isinstance(sensor, Hemisphere):
        centres = np.degrees(np.arccos(1 - (np.arange(sensor.rows) + 0.5) / sensor.rows))
        back, forth = sectors(sensor, phi), sectors(sensor, phi + 180)
        weights = np.repeat([back[1], forth[1]], sensor.rows, axis=0)
        return np.concatenate([back[0], forth[0]]), weights, np.concatenate([-centres, centres])
    cells: np.ndarray
    centre = sensor.directions(measurement(material).wi[k])[:, 0]
    toward = np.array([np.cos(np.radians(phi)), np.sin(np.radians(phi))])
    if isinstance(sensor, Window):
        cells = np.arange(sensor.n)[:, None] * sensor.n + [(sensor.n - 1) // 2, sensor.n // 2]
        centre = centre[cells].mean(axis=1)
        chosen = np.asarray(centre[:, 2] > 0)
    else:
        assert isinstance(sensor, Points)
        cells = np.arange(sensor.cells)[:, None]
        across = centre[:, 0] * -toward[1] + centre[:, 1] * toward[0]
        chosen = np.abs(across) < np.sin(np.radians(NEAREST))
    x = np.degrees(np.arctan2(-centre[:, :2] @ toward, centre[:, 2]))
    if not chosen.any():
        raise ParameterError(f"{material.name}: nothing was measured in the plane of φ_i = {phi:g}°.")
    cells = cells[chosen]
    return cells, np.full(cells.shape, 1 / cells.shape[1]), x[chosen]
