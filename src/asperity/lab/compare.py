"""Two BSDFs in numbers: how far one is from the other, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from asperity.errors import ParameterError

from . import evaluate

RINGS, AZIMUTHS = 12, (0.0, 45.0, 90.0)
"""Directions of incidence: in the middles of rings of equal solid angle, at azimuths for what is not isotropic."""
ROWS, COLUMNS = 64, 128
"""Outgoing directions: the centres of cells of equal solid angle over the hemisphere."""
FAINT = 0.01
"""Of the mean over the hemisphere: errors of values below are relative to that."""
THETA = np.arange(0, 90, 5.0)
"""Angles of incidence of the albedos, in degrees."""
SAMPLES = 2**14
"""For each albedo."""


class Worst(NamedTuple):
    """The largest relative error, and the directions (θ, φ in degrees) where it is."""

    error: float
    incident: tuple[float, float]
    outgoing: tuple[float, float]


@dataclass(frozen=True)
class Comparison:
    """Values f |cos θo| of two materials, ``a`` the reference, (channels, incidence, outgoing), and their albedos.

    All means are over these directions, which share solid angles evenly, and over channels. Mirrors count in the
    albedos only.
    """

    incident: np.ndarray  # (incidence, 2): θ and φ in degrees
    outgoing: np.ndarray  # (incidence, outgoing, 2)
    a: np.ndarray
    b: np.ndarray
    theta: np.ndarray  # degrees, of the albedos
    albedo_a: np.ndarray  # (channels, angles)
    albedo_b: np.ndarray
    error: np.ndarray | None = None  # standard errors of b - a, if they were measured

    @cached_property
    def floor(self) -> np.ndarray:
        """What errors of fainter values are relative to."""
        return np.maximum(self.a, FAINT * self.a.mean(axis=-1, keepdims=True))

    @cached_property
    def relative(self) -> np.ndarray:
        """(b - a) / a; where a is below `FAINT` of its mean over outgoing directions, relative to that; else 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found = (self.b - self.a) / self.floor
        return np.where(self.b == self.a, 0.0, found)

    @property
    def mean_relative(self) -> float:
        """Mean of |b - a| / a, as `relative` has it."""
        return float(np.abs(self.relative).mean())

    @property
    def noise(self) -> float | None:
        """What `mean_relative` would be if nothing but noise of the measurement told a and b apart; None without any.

        The mean of |x| of a normal distribution is sqrt(2 / π) times its standard deviation.
        """
        return None if self.error is None else float(np.sqrt(2 / np.pi) * (self.error / self.floor).mean())

    @property
    def worst(self) -> Worst:
        """Where |b - a| / a is largest."""
        error = np.abs(self.relative)
        _, i, o = np.unravel_index(error.argmax(), error.shape)
        return Worst(float(error.max()), tuple(self.incident[i].tolist()), tuple(self.outgoing[i, o].tolist()))

    @property
    def albedo_difference(self) -> np.ndarray:
        """Albedo of b minus that of a, the mean over channels: (angles,)."""
        return (self.albedo_b - self.albedo_a).mean(axis=0)

    @property
    def log_cosine(self) -> float:
        """Root of the mean of (ln(1 + f_a cos θ) - ln(1 + f_b cos θ))², θ of the light (Löw et al. 2012)."""
        return float(np.sqrt(np.square(np.log1p(self.b) - np.log1p(self.a)).mean()))

    def numbers(self) -> dict[str, Any]:
        """All of it by name, for JSON; what is infinite, since a is black, is None."""
        worst, difference = self.worst, self.albedo_difference
        largest = int(np.abs(difference).argmax())
        numbers = {
            "mean_relative_error": self.mean_relative,
            "of_it_noise": self.noise,
            "worst_relative_error": worst.error,
            "worst_incident": worst.incident,
            "worst_outgoing": worst.outgoing,
            "log_cosine_rms": self.log_cosine,
            "albedo_largest_difference": float(difference[largest]),
            "albedo_largest_difference_theta": float(self.theta[largest]),
            "theta": self.theta.tolist(),
            "albedo_a": self.albedo_a.mean(axis=0).tolist(),
            "albedo_b": self.albedo_b.mean(axis=0).tolist(),
        }
        return {name: None if isinstance(x, float) and not np.isfinite(x) else x for name, x in numbers.items()}


def compare(a: mi.BSDF, b: mi.BSDF, names: Sequence[str] = ("a", "b")) -> Comparison:
    """Compare two BSDFs of the active variant over directions above the surface; ``a`` is the reference.

    Raises ParameterError in variants without arrays, and if one, called by its name, is not finite.
    """
    evaluate.require_arrays("comparing")
    rings = np.degrees(np.arccos((np.arange(RINGS) + 0.5) / RINGS))[::-1]
    incident, outgoing = grid(rings, np.array(AZIMUTHS)), grid(*cells())
    wi, wo = (_directions(angles) for angles in (incident, outgoing))
    pairs = np.repeat(wi, len(wo), axis=0), np.tile(wo, (len(wi), 1))
    # In spectral variants, every lane has wavelengths of its own, the same for both.
    of_a, of_b = (evaluate.at_pairs(bsdf, *pairs)[:-1].reshape(-1, len(wi), len(wo)) for bsdf in (a, b))
    for name, found in zip(names, (of_a, of_b)):
        if len(wrong := np.argwhere(~np.isfinite(found))):
            where = f"the first at θ_i = {incident[wrong[0][1], 0]:.4g}°, θ_o = {outgoing[wrong[0][2], 0]:.4g}°"
            raise ParameterError(f"{name} is not finite at {len(wrong)} of {found.size} values, {where}.")
    upright = _directions(grid(THETA, np.zeros(1)))
    albedo_a, albedo_b = (evaluate.albedo(bsdf, upright, SAMPLES) for bsdf in (a, b))
    outgoing = np.broadcast_to(outgoing, (len(wi), *outgoing.shape))
    return Comparison(incident, outgoing, of_a, of_b, THETA, albedo_a, albedo_b)


def cells() -> tuple[np.ndarray, np.ndarray]:
    """θ of the rows and φ of the columns of the outgoing directions, in degrees."""
    theta = np.degrees(np.arccos(1 - (np.arange(ROWS) + 0.5) / ROWS))
    return theta, (np.arange(COLUMNS) + 0.5) * 360 / COLUMNS


def grid(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """All pairs of angles (n, 2), row by row."""
    return np.stack([np.repeat(theta, len(phi)), np.tile(phi, len(theta))], axis=1)


def _directions(angles: np.ndarray) -> np.ndarray:
    theta, phi = np.radians(angles).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
