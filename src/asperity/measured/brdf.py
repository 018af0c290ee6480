"""What all measured BRDFs become, whatever file they come from: values in pairs of directions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError
from ..goniophotometer import Measurement

Array = NDArray[np.float64]
ABOVE = 1e-9
"""Cosines of directions above the surface are larger; what is nearer to the horizon is on it, but for rounding."""
LARGEST = 1e30
"""Of numbers: what is beyond would overflow."""
UNIT = 1e-3
"""How far the length of a direction may be from 1, as rounded as files have it."""


@dataclass(frozen=True)
class BRDF:
    """A BRDF in pairs of directions above the surface, in no order.

    Directions are local: z is the normal, and both point away from the surface. Raises ParameterError if it is at odds
    with itself, or if a number is not finite.
    """

    wi: Array  # (n, 3), to where light comes from
    wo: Array  # (n, 3)
    values: Array  # (n, channels), in 1/sr, without the cosine; noise may put them below 0
    channels: tuple[str, ...]  # R, G and B; Y; or wavelengths, such as "532 nm"
    errors: Array | None = None  # standard errors of the values, if they are known
    isotropic: bool = True
    source: str = ""
    left_out: Mapping[str, int] = field(default_factory=dict)  # pairs in the file that are not here: why, how many
    weights: Array | None = None  # (n,): dω_i dω_o that a pair stands for, up to a factor; None if all the same

    def __post_init__(self) -> None:
        pairs = len(self.wi)
        shapes = {"wi": (pairs, 3), "wo": (pairs, 3), "values": (pairs, len(self.channels))}
        shapes |= {} if self.errors is None else {"errors": shapes["values"]}
        for name, shape in shapes.items():
            numbers = np.asarray(getattr(self, name), dtype=np.float64)
            if numbers.shape != shape or not numbers.size:
                raise ParameterError(f"{name} is of shape {numbers.shape}, not {shape}, or empty")
            if len(wrong := np.flatnonzero(~np.isfinite(numbers).all(axis=1))):
                raise ParameterError(
                    f"{name} is not finite in {len(wrong)} of {pairs} pairs, the first number {wrong[0]}"
                )
            if np.abs(numbers).max() > LARGEST:
                raise ParameterError(f"{name} is as large as {np.abs(numbers).max():.3g}, which is damage")
            object.__setattr__(self, name, numbers)
        for name in ("wi", "wo"):
            w = getattr(self, name)
            if np.abs(np.linalg.norm(w, axis=1) - 1).max() > UNIT:
                raise ParameterError(f"{name} holds directions that are not of length 1")
            if w[:, 2].min() <= 0:
                raise ParameterError(f"{name} holds directions that are not above the surface")
        if self.errors is not None and self.errors.min() < 0:
            raise ParameterError("errors has numbers below 0")
        if self.weights is not None:
            weights = np.asarray(self.weights, dtype=np.float64)
            if weights.shape != (pairs,) or not (np.isfinite(weights) & (weights >= 0)).all() or not weights.any():
                raise ParameterError(f"weights: expected {pairs} finite numbers, not below 0, and not all 0")
            object.__setattr__(self, "weights", weights)
        if self.mode == "spectral" and len(set(self.wavelengths or ())) < len(self.channels):
            raise ParameterError(f"channels are {', '.join(self.channels)}: expected different wavelengths")

    def __len__(self) -> int:
        return len(self.wi)

    def subset(self, index: NDArray[np.intp]) -> BRDF:
        """Some of the pairs, by their numbers; what was ``left_out`` is that of the file."""
        errors = None if self.errors is None else self.errors[index]
        weights = None if self.weights is None else self.weights[index]
        wi, wo, values = self.wi[index], self.wo[index], self.values[index]
        return replace(self, wi=wi, wo=wo, values=values, errors=errors, weights=weights)

    @property
    def mode(self) -> str:
        """The kind of Mitsuba's variants that have these channels: ``rgb``, ``mono`` or ``spectral``."""
        return mode(self.channels)

    @property
    def wavelengths(self) -> list[float] | None:
        """In nm, of the channels; None in RGB and mono."""
        return wavelengths(self.channels)

    @property
    def incident(self) -> Array:
        """θ and φ of ``wi`` in degrees (n, 2)."""
        return angles(self.wi)

    @property
    def outgoing(self) -> Array:
        """θ and φ of ``wo`` in degrees (n, 2)."""
        return angles(self.wo)


def mode(channels: tuple[str, ...]) -> str:
    """The kind of variants that have these channels; raises ParameterError if none has."""
    if channels in (("R", "G", "B"), ("Y",)):
        return "rgb" if len(channels) == 3 else "mono"
    if channels and wavelengths(channels) is not None:
        return "spectral"
    raise ParameterError(f"channels are {', '.join(channels)}: expected R, G and B; Y; or wavelengths, such as 532 nm")


def wavelengths(channels: tuple[str, ...]) -> list[float] | None:
    """In nm, if all channels are wavelengths; else None."""
    found = [re.fullmatch(r"(\d+\.?\d*) nm", name) for name in channels]
    return [float(one[1]) for one in found if one] if all(found) else None


def angles(w: Array) -> Array:
    """θ and φ in degrees (..., 2), φ from [0, 360)."""
    theta = np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2])
    return np.degrees(np.stack([theta, np.arctan2(w[..., 1], w[..., 0]) % (2 * np.pi)], axis=-1))


def from_measurement(measured: Measurement) -> BRDF:
    """What the virtual goniophotometer measured, all orders together, at the centres of its cells.

    A value is the mean of f cosθ over its cell, divided by the cosine of the centre. Of a hemisphere's cells that is
    the mean cosine, so that a constant f comes out as it is. Cells of windows below the surface are left out.
    """
    count = len(measured.wi)
    wo = np.stack([measured.sensor.directions(wi)[:, 0] for wi in measured.wi])
    wi = np.repeat(measured.wi, wo.shape[1], axis=0)
    wo = wo.reshape(-1, 3)
    above = wo[:, 2] > 0
    cosine = wo[above, 2:]
    value, error = (numbers.reshape(-1, len(measured.channels))[above] / cosine for numbers in measured.summed)
    azimuths = measured.incident[measured.incident[:, 0] > 0, 1] if count > 1 else measured.incident[:, 1]
    return BRDF(
        wi[above],
        wo[above],
        value,
        tuple(measured.channels),
        error if np.isfinite(error).all() else None,
        isotropic=len(np.unique(azimuths)) <= 1,
        source=str(measured.about.get("geometry", {}).get("type", "virtual goniophotometer")),
        left_out={"below the surface": int((~above).sum())} if not above.all() else {},
    )
