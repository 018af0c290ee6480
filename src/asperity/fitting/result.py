"""What a fit found: parameters and how sure they are, what the data do not determine, and how large the errors are."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .. import drawing
from ..drawing import residuals
from ..drawing.comparison import Previews
from ..files import atomically
from ..measured import BRDF
from . import losses
from .free import Free

Array = NDArray[np.float64]
RELATED = 0.95
"""Correlations beyond are told."""
TOLD = 5
"""Of these in words: spectra have thousands."""
VAGUE = 0.5
"""Standard errors beyond this part of the usual range are those of parameters that the data do not determine."""
WIDER = (1.3, 1.7, 2.2, 2.8, 3.6, 5.0, 7.0)
"""Factors by which `profiled` tries whether standard errors are too small."""
AT_END = 1e-4
"""Of the usual range, within which a parameter is at the end of the allowed one."""


class Parameter(NamedTuple):
    """A number that was fitted."""

    name: str  # its path in the description; a colour's with the channel, "base.reflectance[R]"
    value: float
    error: float  # standard error; infinite if nothing determines it
    low: float
    high: float
    remark: str = ""  # "not determined by the data", or "at the end of its range"


class Worst(NamedTuple):
    """The largest error of ln(1 + f cosθ_o), and the directions (θ, φ in degrees) where it is."""

    error: float
    channel: str
    incident: tuple[float, float]
    outgoing: tuple[float, float]


@dataclass(frozen=True)
class Errors:
    """How far a fit is from all the data, by `losses`; ``noise`` is the log-cosine error that the data's own make."""

    log_cosine: float
    linear: float  # RMS of f cosθ_o, in 1/sr
    relative: float  # RMS
    bias: float  # mean of f cosθ_o over that of the data, less 1; NaN if that is not positive
    worst: Worst
    noise: float | None = None


@dataclass(frozen=True)
class Fit:
    """A model fitted to data. ``material`` is its description, which `render`, `plot` and `compare` take."""

    name: str
    material: dict[str, Any]
    parameters: tuple[Parameter, ...]
    correlation: Array  # (parameters, parameters)
    errors: Errors
    data: BRDF
    values: Array = field(repr=False)  # f cosθ_o (channels, n) at all of the data
    aic: float = np.nan  # Akaike's criterion: smaller is better, of the same data and loss
    pairs: int = 0  # that were fitted, of all
    loss: str = "log"
    seconds: float = 0.0
    complete: bool = True  # False if it was interrupted

    @cached_property
    def related(self) -> list[tuple[str, str, float]]:
        """Pairs of parameters that the data hardly tell apart, and their correlation; the closest first."""
        size = len(self.parameters)
        found = [
            (self.parameters[i].name, self.parameters[j].name, float(self.correlation[i, j]))
            for i in range(size)
            for j in range(i)
            if abs(self.correlation[i, j]) > RELATED
        ]
        return sorted(found, key=lambda one: -abs(one[2]))

    @property
    def undetermined(self) -> list[str]:
        """Names of the parameters that the data do not determine."""
        return [one.name for one in self.parameters if one.remark.startswith("not determined")]

    @property
    def differences(self) -> Array:
        """Of ln(1 + f cosθ_o), model less data (channels, n)."""
        return losses.log1p(self.values) - losses.log1p((self.data.values * self.data.wo[:, 2:]).T)

    def __getitem__(self, name: str) -> float:
        """The value of a parameter."""
        return next(one.value for one in self.parameters if one.name == name)

    def statements(self) -> list[str]:
        """What is to be said about the parameters, in words."""
        found = [f"{one.name} is {one.remark}." for one in self.parameters if one.remark]
        pairs = [f"{a} and {b} are hardly told apart: their correlation is {r:+.3f}." for a, b, r in self.related]
        found += pairs[:TOLD] + [f"{len(pairs) - TOLD} other pairs are hardly told apart."] * (len(pairs) > TOLD)
        return found if self.complete else [*found, "It was interrupted: this is the best until then."]

    def numbers(self) -> dict[str, Any]:
        """All of it but the values, as JSON has it."""
        errors = vars(self.errors) | {"bias": _finite(self.errors.bias), "worst": self.errors.worst._asdict()}
        rows = [one._asdict() | {"error": _finite(one.error)} for one in self.parameters]
        about = {"pairs": self.pairs, "of": len(self.data), "loss": self.loss, "seconds": round(self.seconds, 2)}
        related = [list(one) for one in self.related]
        found = {
            "parameters": rows,
            "related": related,
            "errors": errors,
            "aic": _finite(self.aic),
            "data": self.data.source,
        }
        return {"model": self.name, **found, **about, "complete": self.complete}

    def save(self, path: str | Path) -> None:
        """Write a material file in JSON, which all commands take, with the `numbers` as its ``fit``."""
        about = f"{self.name} fitted to {self.data.source}: log-cosine error {self.errors.log_cosine:.4f}."
        content = {"title": self.name, "source": self.data.source, "about": about, "material": self.material}
        with atomically(Path(path)) as part:
            part.write_text(json.dumps(content | {"fit": self.numbers()}, indent=2) + "\n", encoding="utf-8")

    def plot(self, previews: Previews | None = None) -> Figure:
        """A figure: data, model, and their difference over θ_h and θ_d; and ``previews`` of both, if there are."""
        with drawing.style.applied():
            return residuals.figure(self.name, self.data, self.values, previews)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def parameters(free: list[Free], units: list[Array], error: Array, channels: tuple[str, ...]) -> tuple[Parameter, ...]:
    """What is said of each number; ``error`` (numbers,) is in `Free.unit`."""
    rows, errors = [], np.split(error, np.cumsum([len(unit) for unit in units])[:-1])
    for one, unit, own in zip(free, units, errors):
        values = one.value(unit)
        ends = one.unit(np.array([one.low, one.high]))
        for k, (u, e) in enumerate(zip(unit, own)):
            name = f"{one.path}[{channels[k]}]" if one.colour and len(channels) > 1 else one.path
            remark = "at the end of its range" if np.abs(u - ends).min() < AT_END else ""
            remark = "not determined by the data" if not e < VAGUE else remark
            width = float(e * one.slope(values)[k])
            rows.append(Parameter(name, float(values[k]), width, one.low, one.high, remark))
    return tuple(rows)


def covariance(jacobian: Array, residuals: Array) -> Array:
    """Of the numbers (numbers, numbers): White's (1980), right also where noise differs from residual to residual.

    As MacKinnon and White 1985 have it (HC3), a residual counts as if it had no part in the fit: highlights are few,
    and rule. Numbers that change nothing have infinite variance.
    """
    size = np.sqrt(np.square(jacobian).sum(axis=0))
    moved = size > 1e-9 * max(size.max(), 1e-300)
    scaled = jacobian[:, moved] / size[moved]
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-10)
    leverage = np.einsum("ij,jk,ik->i", scaled, bread, scaled, optimize=True)
    meat = (scaled * np.square(residuals / np.maximum(1 - leverage, 1e-3))[:, None]).T @ scaled
    found = np.full((len(size), len(size)), 0.0)
    np.fill_diagonal(found, np.inf)
    found[np.ix_(moved, moved)] = bread @ meat @ bread / np.outer(size[moved], size[moved])
    return found


def profiled(
    residuals: Callable[[Array], Array], x: Array, jacobian: Array, error: Array, bounds: tuple[Array, Array]
) -> Array:
    """Standard errors of which three reach as far as the data allow, where the residuals are not linear.

    A number is moved by more than three of its errors, the others follow by the Jacobian (a profile of the likelihood),
    and where chi squared grows by less than 9, as it should by then, the error is too small.
    """
    wider, (low, high) = np.array(error), bounds
    for j in np.flatnonzero(np.isfinite(error) & (error > 0)):
        others = np.linalg.qr(np.delete(jacobian, j, axis=1))[0]

        def left(r: Array, others: Array = others) -> Array:
            return r - others @ (others.T @ r)

        least, scale = np.square(left(residuals(x))).sum(), np.square(left(jacobian[:, j])).sum() * error[j] ** 2
        sides = {1.0, -1.0}
        for factor in WIDER:
            for side in tuple(sides):
                moved = np.array(x)
                moved[j] = np.clip(x[j] + side * 3 * factor * error[j], low[j], high[j])
                if np.square(left(residuals(moved))).sum() - least < 9 * scale:
                    wider[j] = max(wider[j], abs(moved[j] - x[j]) / 3)
                else:
                    sides.discard(side)
    return wider


def correlation(covariance: Array) -> Array:
    """Of numbers with these covariances; 0 with those that are not determined."""
    deviation = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        found = covariance / np.outer(deviation, deviation)
    found = np.where(np.isfinite(found), found, 0.0)
    np.fill_diagonal(found, 1.0)
    return found


def errors(values: Array, data: BRDF, weights: Array) -> Errors:
    """Of f cosθ_o (channels, n) at all of the data."""
    cosine = data.wo[:, 2]
    measured = data.values.T * cosine
    difference = losses.log1p(values) - losses.log1p(measured)
    channel, n = np.unravel_index(int(np.abs(difference).argmax()), difference.shape)
    (theta_i, phi_i), (theta_o, phi_o) = data.incident[n], data.outgoing[n]
    worst = Worst(
        float(difference[channel, n]),
        data.channels[channel],
        (round(float(theta_i), 2), round(float(phi_i), 2)),
        (round(float(theta_o), 2), round(float(phi_o), 2)),
    )
    noise = None
    if data.errors is not None:
        noise = losses.rms(data.errors.T * cosine / (1 + np.maximum(measured, losses.LEAST)), weights)
    total = float(measured.mean(axis=0) @ weights)
    relative = losses.by_name("relative").scale(measured, cosine, None)
    return Errors(
        log_cosine=losses.rms(difference, weights),
        linear=losses.rms(values - measured, weights),
        relative=losses.rms((values - measured) * relative, weights),
        bias=float((values - measured).mean(axis=0) @ weights) / total if total > 0 else np.nan,
        worst=worst,
        noise=noise,
    )
