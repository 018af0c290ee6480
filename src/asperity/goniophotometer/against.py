"""A BSDF against a measurement, in its cells and directions of incidence; or one measurement against another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import ParameterError
from ..lab import evaluate
from ..lab.compare import SAMPLES, Comparison
from ..loading import short
from .measurement import Measurement
from .plots import STEPS, check_channels


def against(measured: Measurement, other: mi.BSDF | Measurement) -> Comparison:
    """Compare with ``measured``, the reference: nothing is interpolated, and the noise is known.

    A BSDF is averaged over the cells. Another measurement has to be of the same directions and cells. Raises
    ParameterError if it is not, or if the channels are others.
    """
    value, error = (np.moveaxis(numbers, -1, 0) for numbers in measured.summed)
    if isinstance(other, Measurement):
        values, errors = _alike(measured, other)
        error, albedo = np.hypot(error, errors), other.total_albedo.value.T
    else:
        check_channels(measured)
        cells = [measured.sensor.directions(wi, STEPS) for wi in measured.wi]
        means = [evaluate.cell_means(other, wi, wo, measured.wavelengths) for wi, wo in zip(measured.wi, cells)]
        values = np.stack(means, axis=1)
        albedo = evaluate.albedo(other, measured.wi, SAMPLES, measured.wavelengths)
    return Comparison(
        incident=measured.incident,
        outgoing=_angles(measured),
        a=value,
        b=values,
        theta=measured.incident[:, 0],
        albedo_a=measured.total_albedo.value.T,
        albedo_b=albedo,
        error=error,
    )


def swapped(found: Comparison) -> Comparison:
    """The same with the other one as the reference."""
    return replace(found, a=found.b, b=found.a, albedo_a=found.albedo_b, albedo_b=found.albedo_a)


def _alike(one: Measurement, other: Measurement) -> tuple[Any, ...]:
    """Values and errors of the other (channels, incidence, cells)."""
    for name in ("sensor", "channels"):
        if one.about[name] != other.about[name]:
            raise ParameterError(f"comparing: {name} differs: {one.about[name]} and {other.about[name]}.")
    if not np.array_equal(one.incident, other.incident):
        both = " and ".join(short(which.incident.tolist()) for which in (one, other))
        raise ParameterError(f"comparing: directions of incidence differ: {both}.")
    return tuple(np.moveaxis(numbers, -1, 0) for numbers in other.summed)


def _angles(measured: Measurement) -> np.ndarray:
    """θ and φ of the cells' centres (incidence, cells, 2), in degrees."""
    x, y, z = np.moveaxis(np.stack([measured.sensor.directions(wi)[:, 0] for wi in measured.wi]), -1, 0)
    return np.degrees(np.stack([np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x) % (2 * np.pi)], axis=-1))
