"""Automatic derivatives of ``eval`` by every parameter, against finite differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .results import Curves, Result, violations
from .samples import draw_samples, random_incident

GRADIENT_ERROR = 1e-2
LONGEST_STEP = 1e-2  # of finite differences, relative to the parameter


def differentiable(params: mi.SceneParameters) -> list[str]:
    """Return the names of the continuous parameters: numbers, colours and texels, but not transforms or wavelengths."""
    kinds = (mi.Float, mi.Color1f, mi.Color3f, mi.UnpolarizedSpectrum, mi.TensorXf)
    fixed = int(mi.ParamFlags.NonDifferentiable)
    return [
        key
        for key in params.keys()  # noqa: SIM118  (SceneParameters iterates over pairs)
        if isinstance(params[key], kinds) and not params.flags(key) & fixed and not key.endswith("wavelengths")
    ]


def perturbation(value: Any) -> tuple[Any, Any]:
    """Return where to differentiate a parameter, and the magnitude of its elements, in which steps are counted.

    0 and 1 often end a range: such elements are moved off, so that both neighbours are inside it.
    """
    numbers = np.array(value, dtype=np.float32)
    size = np.where(numbers == 0, np.abs(numbers).mean() or 1, np.abs(numbers)).astype(np.float32)
    inside = np.where(numbers == 0, 2 * LONGEST_STEP * size, np.where(numbers == 1, 1 - 2 * LONGEST_STEP, numbers))
    return type(value)(inside.astype(np.float32)), type(value)(size)


@contextmanager
def restored(params: mi.SceneParameters, keys: Sequence[str]) -> Iterator[None]:
    """Give the parameters back as they were."""
    before = {key: type(params[key])(params[key]) for key in keys}
    try:
        yield
    finally:
        for key, value in before.items():
            params[key] = value
        params.update()


def shifted_eval(
    bsdf: mi.BSDF,
    params: mi.SceneParameters,
    values: dict[str, tuple[Any, Any]],
    pair: tuple[mi.Vector3f, mi.Vector3f],
    shift: Any,
) -> mi.Float:
    """Evaluate, summed over channels, with all ``values`` shifted by ``shift`` times their magnitudes."""
    for key, (value, size) in values.items():
        params[key] = value + shift * size
    params.update()
    return dr.sum(evaluate.eval(bsdf, *pair)) + dr.zeros(mi.Float, dr.width(pair[1].x))


def derivative(evaluate_at: Callable[[Any], mi.Float]) -> tuple[np.ndarray, bool]:
    """Differentiate at 0, forward, lane by lane; also tell if the backward derivative is finite."""
    shift = dr.opaque(mi.Float, 0)
    dr.enable_grad(shift)
    dr.set_grad(shift, 1)
    value = evaluate_at(shift)
    if not dr.grad_enabled(value):
        return np.zeros(dr.width(value)), True
    forward = np.array(dr.forward_to(value), dtype=np.float64)
    shift = dr.opaque(mi.Float, 0)
    dr.enable_grad(shift)
    dr.backward(dr.sum(evaluate_at(shift)))
    return np.broadcast_to(forward, dr.width(value)), bool(np.isfinite(np.array(dr.grad(shift))).all())


def finite_difference(evaluate_at: Callable[[Any], mi.Float], h: float) -> tuple[np.ndarray, np.ndarray]:
    """Differentiate at 0 by central differences of steps h and h/2, extrapolated (Richardson): the error is O(h⁴).

    Also return by how much the two steps disagree.
    """

    def central(step: float) -> np.ndarray:
        up, down = (np.array(evaluate_at(dr.opaque(mi.Float, s)), dtype=np.float64) for s in (step, -step))
        return np.asarray((up - down) / (2 * step))

    coarse, fine = central(h), central(h / 2)
    return (4 * fine - coarse) / 3, np.abs(fine - coarse)


def difference_error(evaluate_at: Callable[[Any], mi.Float], automatic: np.ndarray, weight: np.ndarray) -> float:
    """Return the mean relative error of ``automatic`` against finite differences.

    Rounding errors grow with 1/h, truncation errors with h⁴ over the fourth power of the lobe's width, which is not
    known: a right derivative agrees with the differences of one of the steps, a wrong one with none. Lanes whose
    differences depend on the step straddle a jump or a kink, and are left out, unless they are most of all.
    """
    value = np.abs(np.array(evaluate_at(0.0), dtype=np.float64))
    errors = []
    for h in (LONGEST_STEP, LONGEST_STEP / 3, LONGEST_STEP / 10):
        numeric, spread = finite_difference(evaluate_at, h)
        noise = 16 * np.finfo(np.float32).eps / h * value
        smooth = spread <= 0.1 * np.abs(numeric) + noise
        w = np.where(smooth, weight, 0)
        allowed = (w * (np.abs(numeric) + noise / GRADIENT_ERROR)).sum()
        error = (w * np.abs(automatic - numeric)).sum() / max(allowed, 1e-30)
        errors.append(error if smooth[value > 0].mean() > 0.5 else np.inf)
    return float(np.min(errors))


def weighted_pairs(bsdf: mi.BSDF, n: int) -> tuple[mi.Vector3f, mi.Vector3f, np.ndarray]:
    """Return pairs of directions and their weights.

    Half of wo are the BSDF's own samples, and weights fall with their density, so that a narrow lobe counts as much as
    it reflects.
    """
    wi = random_incident(bsdf, n, 18)
    own = draw_samples(bsdf, wi, n, seed=19)
    use_own = mi.Bool(own.smooth) & (dr.arange(mi.UInt32, n) % 2 == 0)
    wo = dr.select(use_own, own.drawn.wo, evaluate.uniform_sphere(n, 20))
    dr.eval(wi, wo)
    return wi, wo, 1 / (evaluate.to_numpy(evaluate.pdf(bsdf, wi, wo), n)[0] + 1 / (4 * np.pi))


def gradients(bsdf: mi.BSDF) -> Result:
    """Compare automatic with finite differences, a parameter at a time, and look for NaN at hard directions.

    Directions are compared one by one: the sum over a lobe barely depends on its width.
    """
    params = mi.traverse(bsdf)
    keys = differentiable(params)
    if not keys or not dr.is_diff_v(mi.Float):
        return Result("gradients", None, "has no differentiable parameter")
    wi, wo, weight = weighted_pairs(bsdf, 10_000)
    if not evaluate.to_numpy(evaluate.eval(bsdf, wi, wo), weight.size).any():
        return Result("gradients", None, "has only delta lobes: eval is 0")
    errors, finite = {}, True
    for key in keys:
        with restored(params, [key]):
            at = partial(shifted_eval, bsdf, params, {key: perturbation(params[key])}, (wi, wo))
            automatic, backward = derivative(at)
            finite &= backward and bool(np.isfinite(automatic).all())
            errors[key] = difference_error(at, automatic, weight)
    hard = evaluate.hard_pairs()
    with restored(params, keys):
        every = {key: (params[key], 1.0) for key in keys}
        automatic, backward = derivative(partial(shifted_eval, bsdf, params, every, hard))
    bad = ~np.isfinite(automatic)
    worst = max(errors, key=lambda key: np.nan_to_num(errors[key], nan=np.inf))
    trouble = "" if finite and backward else "; backward derivatives are not finite"
    found = Curves(list(errors), {"automatic": np.array(list(errors.values()))}, "mean relative error", GRADIENT_ERROR)
    return Result(
        "gradients",
        bool(errors[worst] < GRADIENT_ERROR and finite and backward and not bad.any()),
        f"{errors[worst]:.2g} mean relative error for {worst}, the worst of {len(keys)} parameters; "
        f"{bad.sum()} not finite at hard directions{trouble}",
        f"< {GRADIENT_ERROR} against extrapolated central differences, which float32 leaves good to about 0.001",
        violations(*hard, bad, "gradient") if bad.any() else found,
    )
