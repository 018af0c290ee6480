"""Least squares from many starts: Sobol's points, of which the best are followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from .losses import Loss
from .residuals import Lanes, Model

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
SOBOL = 64
"""Points that are looked at."""
FOLLOWED = 4
"""The best of them, which are followed for some steps."""
STEPS, LAST = 12, 60
"""Evaluations that each of these may take, and the best of them to the end."""
TOLERANCE = 1e-7
"""Of cost and step: single precision has no more."""


@dataclass
class Problem:
    """Residuals of a model at data, weighted: what `least_squares` takes; it keeps the best that it has seen."""

    model: Model
    pairs: Lanes
    measured: Array  # f cosθ_o (channels, n)
    scale: Array  # (channels, n): root of the weight, and what the loss scales by
    loss: Loss
    best: Array | None = None
    least: float = np.inf

    def residuals(self, x: Array) -> Array:
        """Of all channels and pairs, in a row."""
        found = self.scale * (self.loss.of(self.model(x, self.pairs)) - self.loss.of(self.measured))
        flat = np.where(np.isfinite(found), found, 1e3).ravel()
        cost = float(flat @ flat)
        if cost < self.least:
            self.best, self.least = np.array(x), cost
        return flat

    def jacobian(self, x: Array) -> Array:
        """Of the residuals (residuals, numbers)."""
        value, derivatives = self.model.derivatives(x, self.pairs)
        rows = self.model.jacobian(derivatives) * self.scale * self.loss.slope(value)
        return np.nan_to_num(rows.reshape(len(rows), -1).T, nan=0.0, posinf=0.0, neginf=0.0)


def bounds(model: Model) -> tuple[Array, Array]:
    """Least and greatest of the numbers, in `Free.unit`."""
    ends = ([float(one.unit(end)) for one, end in zip(model.free, side)] for side in _sides(model))
    low, high = (np.repeat(end, model.sizes) for end in ends)
    return low, high


def _sides(model: Model) -> tuple[list[float], list[float]]:
    return [one.low for one in model.free], [one.high for one in model.free]


def starts(model: Model, seed: int) -> Array:
    """Points to begin at (points, numbers): what the description says, and Sobol's, in which colours are grey."""
    points = qmc.Sobol(len(model.free), seed=seed).random(SOBOL)
    points = 0.02 + 0.96 * points
    said = [
        np.nan if one.start is None else float(one.unit(np.clip(one.start, one.low, one.high))) for one in model.free
    ]
    first = np.where(np.isnan(said), 0.5, said)
    low, high = bounds(model)
    return np.clip(np.repeat(np.vstack([first, points]), model.sizes, axis=1), low, high)


def search(few: Problem, whole: Problem, seed: int, robust: str, progress: Progress) -> bool:
    """Leave the best in ``whole``: starts are compared and followed with ``few`` pairs, which the model shares.

    True if nobody interrupted it with Ctrl-C, which keeps what was found.
    """
    first = starts(few.model, seed)
    total, done = len(first) + FOLLOWED * STEPS + LAST, 0

    def follow(problem: Problem, x: Array, most: int) -> Any:
        low, high = bounds(problem.model)
        margin = 1e-9 * (high - low)
        return least_squares(
            lambda x: counted(problem, x),
            np.clip(x, low + margin, high - margin),
            problem.jacobian,
            bounds=(low, high),
            loss=robust,
            f_scale=_width(problem, x, robust),
            max_nfev=most,
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
        )

    def counted(problem: Problem, x: Array) -> Array:
        nonlocal done
        done += 1
        progress("fitting", min(done, total - 1), total)
        return problem.residuals(x)

    try:
        costs = [float(np.square(counted(few, x)).sum()) for x in first]
        found = []
        for k in np.argsort(costs)[:FOLLOWED]:
            found.append(follow(few, first[k], STEPS))
            done = max(done, len(first) + STEPS * len(found))
        best = min(found, key=lambda one: one.cost)
        whole.best = follow(whole, best.x, LAST).x
    except KeyboardInterrupt:
        whole.best = few.best if whole.best is None else whole.best
        if whole.best is None:
            raise
        return False
    progress("fitting", total, total)
    return True


def _width(problem: Problem, x: Array, robust: str) -> float:
    """Beyond which residuals count less: 1.5 standard deviations, by their median."""
    return 1.0 if robust == "linear" else max(1e-12, 1.5 * 1.4826 * float(np.median(np.abs(problem.residuals(x)))))
