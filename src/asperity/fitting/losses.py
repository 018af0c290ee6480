"""What is small where a model is near the data: functions of f cosθ_o, their derivatives, and the error of a fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import UnknownNameError

Array = NDArray[np.float64]
FAINT = 1e-3 / np.pi
"""Relative errors of values below are relative to this, in 1/sr: what a diffuse surface of albedo .001 has."""
LEAST = -0.5
"""Noise may put measured values below 0, but their logarithm is taken of no less than 1 + this."""


class Loss(NamedTuple):
    """Residuals are ``scale(measured)`` times the difference of ``of(f cosθ)``, whose derivative is ``slope``."""

    of: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    scale: Callable[[Array, Array, Array | None], Array]  # of measured f cosθ, cosθ, standard errors of f
    meaning: str


def log1p(value: Array) -> Array:
    """ln(1 + f cosθ): of Löw et al. 2012, E2. Faint values count as they are, and highlights by their factors."""
    return np.log1p(np.maximum(value, LEAST))


def _one(value: Array, cosine: Array, errors: Array | None) -> Array:
    return np.ones_like(value)


def _relative(value: Array, cosine: Array, errors: Array | None) -> Array:
    return 1 / np.maximum(value, FAINT * cosine)


def _errors(value: Array, cosine: Array, errors: Array | None) -> Array:
    assert errors is not None
    return 1 / (errors * cosine)


def _same(value: Array) -> Array:
    return value


LOSSES = {
    "log": Loss(log1p, lambda v: (v > LEAST) / (1 + np.maximum(v, LEAST)), _one, "ln(1 + f cosθ), as Löw et al. 2012"),
    "linear": Loss(_same, np.ones_like, _one, "f cosθ"),
    "relative": Loss(_same, np.ones_like, _relative, "f relative to what was measured"),
    "errors": Loss(_same, np.ones_like, _errors, "f by the standard errors of the data: chi squared"),
}
"""By the names that users give."""


def by_name(name: str) -> Loss:
    """A loss; raises UnknownNameError."""
    if name not in LOSSES:
        raise UnknownNameError("loss", name, list(LOSSES))
    return LOSSES[name]


def rms(residuals: Array, weights: Array) -> float:
    """Of residuals (channels, n): over pairs by ``weights`` (n,), and all channels alike."""
    return float(np.sqrt((np.square(residuals).mean(axis=0) * weights).sum() / weights.sum()))


def log_cosine(model: Array, measured: Array, weights: Array) -> float:
    """RMS of the difference in ln(1 + f cosθ_o), of values f cosθ_o (channels, n): the metric of all tables."""
    return rms(log1p(model) - log1p(measured), weights)
