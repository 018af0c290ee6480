"""A model to data, and all of them: what to fit, by which pairs, and what to say of the result."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import variants
from ..errors import ParameterError, UnknownNameError, whole
from ..materials import changed
from ..measured import BRDF
from . import candidates, losses, result
from . import free as parameters
from .candidates import CANDIDATES
from .free import described
from .residuals import Lanes, Model
from .result import Fit
from .search import Problem, bounds, search

Array = NDArray[np.float64]
PAIRS = 4096
"""That are fitted, of all: more would cost time, and tell little."""
FEW = 1024
"""Of these, that starts are compared by."""
GRAZING = 85.0
"""Degrees: beyond, goniometers light or see more than the sample, and f grows without bound."""
AT_ONCE = 2**18
"""Pairs that a model is evaluated at."""
ROBUST = ("linear", "soft_l1", "huber", "cauchy")


def _quiet(task: str, done: int, total: int) -> None:
    pass


@dataclass(frozen=True)
class Chosen:
    """Data to fit, and how much each pair counts."""

    data: BRDF
    weights: Array  # (n,), of mean 1


def fit(
    data: BRDF,
    model: Any,
    *,
    free: Collection[str] | None = None,
    fix: Mapping[str, Any] | None = None,
    plus: str | None = None,
    loss: str = "log",
    robust: str = "linear",
    grazing: float = GRAZING,
    saturation: float | None = None,
    pairs: int = PAIRS,
    seed: int = 0,
    progress: Callable[[str, int, int], None] = _quiet,
) -> Fit:
    """Fit a model to measured values, by weighted least squares from many starts.

    Parameters
    ----------
    data : in RGB, one channel, or wavelengths; they decide Mitsuba's variant
    model : the name of one of `CANDIDATES`, or a material, whose numbers are one of the starts
    free : the parameters to fit, by their paths (``base.reflectance``); by default all that the model declares
    fix : parameters with the values that they keep
    plus : ``diffuse`` adds a Lambertian
    loss : what is made small, one of `losses.LOSSES`
    robust : a loss of `scipy.optimize.least_squares` that outliers count less in
    grazing : pairs with θ beyond, in degrees, are left out
    saturation : values of f from this on are left out
    pairs : how many are fitted, drawn by their solid angle and evenly, in equal parts; errors are those of all
    seed : of the drawing, and of Sobol's starts

    Raises ParameterError, UnknownNameError. The same seed gives the same result.
    """
    began = time.monotonic()
    function = _checked(data, loss, robust)
    whole("seed", seed, 0)
    kept = _kept(data, grazing, saturation)
    name, description = candidates.description(model, plus)
    description = changed(description, dict(fix or {}))
    with variants.switched(variants.with_channels(variants.of_arrays(), data.mode)), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # models say of unusual values what they cost, and a search tries all
        chosen = parameters.chosen(parameters.parameters(description, data.isotropic), free, fix or ())
        target = Model(description, chosen, data.channels)
        small = drawn(kept, whole("pairs", pairs, 16), seed)
        problem = _problem(target, small, function)
        complete = search(_problem(target, drawn(small, FEW, seed), function), problem, seed, robust, progress)
        found = _result(name, problem, kept, small)
        return replace(found, loss=loss, complete=complete, seconds=time.monotonic() - began)


def rank(
    data: BRDF,
    models: Sequence[Any] = tuple(CANDIDATES),
    *,
    progress: Callable[[str, int, int], None] = _quiet,
    **options: Any,
) -> list[Fit]:
    """Fit each of the ``models``, and sort them by Akaike's criterion, the best first; ``options`` are those of `fit`.

    If it is interrupted with Ctrl-C, those that were done are returned.
    """
    found: list[Fit] = []
    for k, model in enumerate(models):

        def told(task: str, done: int, total: int, k: int = k, model: Any = model) -> None:
            progress(str(model), k * total + done, len(models) * total)

        found.append(fit(data, model, progress=told, **options))
        if not found[-1].complete:
            break
    return sorted(found, key=lambda one: one.aic)


def drawn(data: Chosen, count: int, seed: int) -> Chosen:
    """So many pairs, with weights that make up for the drawing: half by solid angle, half evenly.

    Evenly, since tables are dense where values change; by solid angle, since that is what counts. They are drawn
    systematically, in the order of the data, so that they spread over a table.
    """
    if count >= len(data.data):
        return data
    share = (data.weights / data.weights.sum() + 1 / len(data.data)) / 2
    places = (np.arange(count) + np.random.default_rng(seed).random()) / count
    index, repeated = np.unique(np.searchsorted(np.cumsum(share), places).clip(max=len(share) - 1), return_counts=True)
    weights = data.weights[index] / share[index] * repeated
    return Chosen(data.data.subset(index), weights / weights.mean())


def _checked(data: BRDF, loss: str, robust: str) -> losses.Loss:
    """The loss; raises ParameterError if it does not go with the data."""
    if robust not in ROBUST:
        raise UnknownNameError("robust loss", robust, ROBUST)
    if loss == "errors" and (data.errors is None or not data.errors.min() > 0):
        raise ParameterError("loss = 'errors': the data have no standard errors, or some that are 0.")
    return losses.by_name(loss)


def _kept(data: BRDF, grazing: float, saturation: float | None) -> Chosen:
    """The pairs that count, and how much."""
    if not 0 < grazing <= 90:
        raise ParameterError(f"grazing = {grazing:g}: expected an angle within (0, 90] degrees.")
    least = np.cos(np.radians(grazing)) - 1e-9
    kept = (data.wi[:, 2] >= least) & (data.wo[:, 2] >= least)
    if saturation is not None:
        kept &= (data.values < saturation).all(axis=1)
    if kept.sum() < 16:
        raise ParameterError(f"{kept.sum()} pairs are left within {grazing:g} degrees: expected at least 16.")
    chosen = data if kept.all() else data.subset(np.flatnonzero(kept))
    weights = np.ones(len(chosen)) if chosen.weights is None else chosen.weights
    return Chosen(chosen, weights / weights.mean())


def _problem(model: Model, chosen: Chosen, loss: losses.Loss) -> Problem:
    cosine = chosen.data.wo[:, 2]
    measured = chosen.data.values.T * cosine
    errors = None if chosen.data.errors is None else chosen.data.errors.T
    scale = loss.scale(measured, cosine, errors) * np.sqrt(chosen.weights)
    return Problem(model, Lanes.of(chosen.data), measured, scale, loss)


def _result(name: str, problem: Problem, kept: Chosen, small: Chosen) -> Fit:
    """What `search` left in the problem, with its errors at all that was kept."""
    model, x = problem.model, problem.best
    assert x is not None
    residuals = problem.residuals(x)
    jacobian = problem.jacobian(x)
    covariance = result.covariance(jacobian, residuals)
    pieces = [
        kept.data.subset(np.arange(a, min(a + AT_ONCE, len(kept.data)))) for a in range(0, len(kept.data), AT_ONCE)
    ]
    values = np.concatenate([model(x, Lanes.of(piece)) for piece in pieces], axis=1)
    # Weights that differ make fewer pairs of it (Kish 1965).
    count = small.weights.sum() ** 2 / np.square(small.weights).sum() * len(model.channels)
    error = result.profiled(problem.residuals, x, jacobian, np.sqrt(np.diag(covariance)), bounds(model))
    return Fit(
        name=name,
        material=described(model.description, model.values(x), model.channels),
        parameters=result.parameters(model.free, model.split(x), error, model.channels),
        correlation=result.correlation(covariance),
        errors=result.errors(values, kept.data, kept.weights),
        data=kept.data,
        values=values,
        aic=float(count * np.log(max(np.square(residuals).mean(), 1e-300)) + 2 * len(x)),
        pairs=len(small.data),
    )
