"""Derivatives by the parameters of a BSDF: automatic ones, called as a render calls or not, and finite differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .samples import draw_samples, random_incident

GRADIENT_ERROR = 1e-2
STEPS = 1e-2 / 2.0 ** np.arange(4)
"""Of finite differences, relative to the parameter's magnitude."""

ROUNDING = 16 * np.finfo(np.float32).eps
"""Relative errors of values."""

Values = Mapping[str, np.ndarray]


class FiniteDifference(NamedTuple):
    """A derivative, lane by lane; by how much those of two steps disagree; and what rounding errors may do to it."""

    derivative: np.ndarray
    doubt: np.ndarray
    noise: np.ndarray


class Quantity(Protocol):
    """What is differentiated."""

    def value(self) -> Any:
        """Values, a lane each."""

    def derivative(self) -> np.ndarray:
        """Forward derivatives along the directions that the parameters' gradients are set to."""


class Calls(NamedTuple):
    """``eval`` of a BSDF, or of a pointer to one, at pairs of directions, summed over channels."""

    target: Any
    wi: mi.Vector3f
    wo: mi.Vector3f

    def value(self) -> mi.Float:
        """Values, a lane each."""
        return dr.sum(evaluate.eval(self.target, self.wi, self.wo)) + dr.zeros(mi.Float, dr.width(self.wo.x))

    def derivative(self) -> np.ndarray:
        """Differentiate forward, lane by lane."""
        value = self.value()
        if not dr.grad_enabled(value):
            return np.zeros(dr.width(value))
        return np.broadcast_to(np.array(dr.forward_to(value), dtype=np.float64), dr.width(value))


def pointer(bsdf: mi.BSDF) -> mi.BSDFPtr:
    """Return a pointer to the BSDF that Dr.Jit takes for one to any, as in a scene: it records a virtual call."""
    found = mi.BSDFPtr(bsdf)
    dr.make_opaque(found)
    return found


class Parameters:
    """The continuous parameters of a BSDF: numbers, colours and texels, but not transforms or wavelengths."""

    def __init__(self, bsdf: mi.BSDF):
        self.scene = mi.traverse(bsdf)
        kinds = (mi.Float, mi.Color1f, mi.Color3f, mi.UnpolarizedSpectrum, mi.TensorXf)
        fixed = int(mi.ParamFlags.NonDifferentiable)
        moving = [key for key in self.scene.keys() if not self.scene.flags(key) & fixed]  # noqa: SIM118
        # Mitsuba shows unused parameters as None, and fails to return them.
        shown = {key: self.scene[key] for key in moving if self.scene.properties[key][0] is not None}
        shown = {k: v for k, v in shown.items() if isinstance(v, kinds) and not k.endswith("wavelengths")}
        self.kinds = {key: type(value) for key, value in shown.items()}
        self.initial = {key: np.array(value, dtype=np.float32) for key, value in shown.items()}

    def path(self, key: str) -> Iterator[tuple[Any, str]]:
        """From the inside out, the objects that hold a parameter, each with its name there."""
        node, names = self.scene.properties[key][2], key.split(".")
        while node is not None:
            parent, depth = self.scene.hierarchy[node]
            yield node, names[depth]
            node = parent

    @contextmanager
    def restored(self) -> Iterator[None]:
        """Give the parameters back as they were."""
        try:
            yield
        finally:
            self.place(self.initial)

    def place(self, values: Values, directions: Values | None = None) -> dict[str, Any]:
        """Set all parameters, and their gradients if there are ``directions``; return them.

        Every number is data to Dr.Jit: all values and directions share their kernels.
        """
        leaves = {key: kind(values[key].astype(np.float32)) for key, kind in self.kinds.items()}
        for key, leaf in leaves.items():
            if directions is not None:
                dr.enable_grad(leaf)
                dr.set_grad(leaf, self.kinds[key](directions[key].astype(np.float32)))
            self.scene[key] = leaf
        self.scene.update()
        return leaves

    def forward(self, quantity: Quantity, values: Values, directions: Values) -> np.ndarray:
        """Differentiate along ``directions``."""
        leaves = self.place(values, directions)
        # To what objects make of their parameters when these change: loops of integrators cannot ask back for it.
        dr.enqueue(dr.ADMode.Forward, leaves)
        dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearEdges)
        return quantity.derivative()

    def backward(self, calls: Calls, values: Values, directions: Values, weight: np.ndarray) -> np.ndarray:
        """Differentiate the weighted sum of all lanes along ``directions``, backwards: one number a parameter."""
        leaves = self.place(values, {key: 0 * value for key, value in values.items()})
        if dr.grad_enabled(total := dr.sum(calls.value() * mi.Float(weight))):
            dr.backward(total)
        slopes = {key: np.array(dr.grad(leaf), dtype=np.float64) for key, leaf in leaves.items()}
        return np.array([np.sum(slopes[key] * directions[key]) for key in leaves])

    def differences(self, quantity: Quantity, values: Values, directions: Values) -> list[FiniteDifference]:
        """Finite differences along ``directions``, extrapolated from each pair of `STEPS` (Richardson).

        Central ones; then those of either side, which differ where a parameter is at the node of a table: any will do.
        """

        def at(step: float) -> np.ndarray:
            self.place({key: value + step * directions[key] for key, value in values.items()})
            return np.array(quantity.value(), dtype=np.float64)

        middle, estimates = at(0), []
        rights, lefts = zip(*(((at(h) - middle) / h, (middle - at(-h)) / h) for h in STEPS))
        for h, *sides in zip(STEPS, pairwise(rights), pairwise(lefts)):
            noise = ROUNDING * np.abs(middle) / h
            coarse, fine = (sum(slopes) / 2 for slopes in zip(*sides))
            estimates.append(FiniteDifference(fine + (fine - coarse) / 3, np.abs(fine - coarse), noise))
            doubt = np.max([np.abs(near - far) for far, near in sides], axis=0)
            estimates += [FiniteDifference(2 * near - far, doubt, noise) for far, near in sides]
        return estimates


def along(directions: Values, chosen: str) -> Values:
    """Return the directions with all but the ``chosen`` parameter's zero."""
    return {key: direction if key == chosen else 0 * direction for key, direction in directions.items()}


def mean_relative(error: np.ndarray, size: np.ndarray, weight: np.ndarray) -> float:
    """Return the mean of errors over that of magnitudes, of those whose weight is not 0."""
    used = weight > 0
    return float((weight * error)[used].sum() / max((weight * size)[used].sum(), 1e-30))


def difference_error(
    automatic: np.ndarray,
    estimates: list[FiniteDifference],
    weight: np.ndarray,
    if_rough: float = np.inf,
) -> float:
    """Return the mean relative error of ``automatic`` against estimates of several steps.

    Rounding errors grow with 1/h, truncation errors with powers of h over the lobe's width, which is not known: a
    right derivative agrees with the differences of one of the steps, a wrong one with none. Lanes whose differences
    depend on the step straddle a jump or a kink, and are left out; if they are most of all, the error is ``if_rough``.
    """
    errors = []
    for numeric, doubt, noise in estimates:
        smooth = doubt <= 0.1 * np.abs(numeric) + noise
        allowed = np.abs(numeric) + noise / GRADIENT_ERROR
        error = mean_relative(np.abs(automatic - numeric), allowed, np.where(smooth, weight, 0))
        seen = ((noise > 0) | (numeric != 0)) & (weight > 0)
        errors.append(error if smooth[seen].sum() >= 0.5 * seen.sum() else if_rough)
    return float(np.min(errors))


def weighted_pairs(bsdf: mi.BSDF, n: int) -> tuple[mi.Vector3f, mi.Vector3f, np.ndarray]:
    """Return ``n`` random pairs of directions and their weights, then the hard pairs, with weights of 0.

    Half of wo are the BSDF's own samples, and weights fall with their density, so that a narrow lobe counts as much as
    it reflects. At hard pairs only NaN counts; in the same arrays, they need no kernels of their own.
    """
    wi = random_incident(bsdf, n, 18)
    own = draw_samples(bsdf, wi, n, seed=19)
    use_own = mi.Bool(own.smooth) & (dr.arange(mi.UInt32, n) % 2 == 0)
    wo = dr.select(use_own, own.drawn.wo, evaluate.uniform_sphere(n, 20))
    weight = 1 / (evaluate.to_numpy(evaluate.pdf(bsdf, wi, wo), n)[0] + 1 / (4 * np.pi))
    both = [np.concatenate([np.array(w).T, np.array(hard).T]) for w, hard in zip((wi, wo), evaluate.hard_pairs())]
    wi, wo = map(evaluate.vectors, both)
    dr.eval(wi, wo)
    return wi, wo, np.append(weight, np.zeros(len(both[0]) - n))
