"""How `diffuse.HEIGHTS` is made: ``python -m asperity.models.micrograin.fit``.

Prints a rule, ready to paste, with its errors and with those of the digits in diffuse.py, of round grains over the
whole range of parameters. Needs five minutes; nothing imports this module when rendering.

The digits in diffuse.py are of an earlier script, whose inputs were drawn a little otherwise. Of 24 000 inputs that
neither has seen, half of the directions grazing, the values' errors are .044 % in the median, .39 % at 99.5 % and 1.7 %
at worst; those of diffuse.py .031, .42 and 2.9 %; the densities' .049, .47 and 1.7 %, against .036, .48 and 2.8 %.
FRONT and BACK in diffuse.py are not made here.
"""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
from scipy.optimize import minimize

from ...microfacet.quadrature import Rule, gauss_legendre
from .diffuse import HEIGHTS, Rings
from .grains import Grains, exposure
from .material import Facet
from .shadows import Shadows, shadow

INPUTS, GRID, EXACT = 24_000, 800, 200
LEAST = 1e-3
"""Integrals below this count by their absolute errors."""
NORMS = 2, 4, 8, 12
"""Exponents of the mean of errors that is made small, one after the other: the worst count more and more."""
SHARES = 50, 99, 99.5, 99.9, 100
"""Of the inputs, in per cent, whose largest error is printed."""


class Integrands:
    """Value and density of random inputs as integrals over t, with h = 1 - t^3: over what they are, and should be 1."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.integrand = lit_heights(rng, INPUTS)
        t, weight = map(np.array, gauss_legendre(EXACT))
        exact = sum(w * self.integrand(x) for x, w in zip(t, weight))
        self.scale = 1 / np.maximum(exact, LEAST)
        self.exact = self.scale * exact
        ends = np.clip(np.linspace(0, 1, GRID + 1), 1e-5, 1 - 1e-9)
        self.values = np.array([(self.scale * self.integrand(x)).astype(np.float32) for x in ends])

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrands (nodes, inputs) and their slopes, by cubics between the grid's nodes."""
        k = np.clip((t * GRID).astype(int), 1, GRID - 2)
        powers = (t * GRID - k)[:, None] ** np.arange(4)
        slopes = np.arange(1, 4) * powers[:, :3] * GRID
        around = np.stack([self.values[k + n] for n in (-1, 0, 1, 2)], axis=1)
        return (
            np.einsum("np,pm,nmi->ni", powers, CUBIC, around, optimize=True),
            np.einsum("np,pm,nmi->ni", slopes, CUBIC[1:], around, optimize=True),
        )

    def errors(self, t: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Relative ones of a rule in t."""
        return np.abs(sum(w * self.scale * self.integrand(x) for x, w in zip(t, weight)) - self.exact)


CUBIC = np.linalg.inv(np.arange(-1.0, 3)[:, None] ** np.arange(4))
"""From values at -1, 0, 1, 2 to the coefficients of their cubic."""


def lit_heights(rng: np.random.Generator, n: int) -> Callable[[float], np.ndarray]:
    """The function t -> (2 n): integrands of `diffuse.lambertian` for albedo 1, value and density, on [0, 1].

    A third of the directions are spread by the cosine, a third is grazing; of all, some are near each other's mirror
    direction or alike.
    """
    wi, wo = directions(rng, n), directions(rng, n)
    near, sign = rng.random(n) < 0.25, np.where(rng.random(n) < 0.4, 1, -1)
    close = wi * [sign, sign, 1 + 0 * sign] + rng.normal(size=(3, n)) * 10 ** rng.uniform(-6, -1, n)
    wo = np.where(near, close, wo)
    wo[2] = np.maximum(np.abs(wo[2]), 1e-5)
    tau_0 = np.clip(rng.uniform(-0.05, 1.05, n), 0, 1)
    beta = llvm.Float64(np.exp(rng.uniform(np.log(0.05), np.log(10), n)))
    grains = Grains.of(llvm.Float64(tau_0), beta, beta)
    raw = llvm.Array3f64(wo / np.linalg.norm(wo, axis=0))
    wi, wo = grains.lift(llvm.Array3f64(wi)), grains.lift(raw)
    shadows = Shadows(grains.to_sphere(wi), grains.to_sphere(wo))
    rings = Rings(grains, Facet(), True, shadows, None, None)
    scale = grains.r * grains.stretch(wo) / (dr.pi * shadows.i.z)
    scales = scale * (raw.z / wo.z), scale / grains.visible(wi)
    dr.eval(shadows, rings.axis, rings.turn, scales)

    def integrand(t: float) -> np.ndarray:
        h = dr.opaque(llvm.Float64, 1 - t**3)
        lit = 3 * t * t * rings.at(h)[2]
        seen = shadows.union(h), shadow(shadows.i, h)
        return np.concatenate([lit * s * exposure(grains.r, h, area) for s, area in zip(scales, seen)])

    return integrand


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Upward unit vectors, (3, n)."""
    cos = np.where(rng.random(n) < 0.5, np.sqrt(rng.random(n)), 10 ** rng.uniform(-4, -0.5, n))
    sin, azimuth = np.sqrt(1 - cos * cos), 2 * np.pi * rng.random(n)
    return np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), cos])


def fitted(integrands: Integrands, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """(nodes, weights) in t, from Gauss-Legendre on; unknown are logarithms: of gaps between nodes, and of weights."""

    def rule(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        gaps = np.exp(x[: nodes + 1])
        gaps = gaps / gaps.sum()
        return np.cumsum(gaps)[:nodes], np.exp(x[nodes + 1 :]), gaps

    def norm(x: np.ndarray, exponent: int) -> tuple[float, np.ndarray]:  # its logarithm, and the gradient
        t, weight, gaps = rule(x)
        values, slopes = integrands.at(t)
        rest = weight @ values - integrands.exact
        size = np.abs(rest) + 1e-12
        shares = (size / size.max()) ** exponent
        by_rest = shares / size * np.sign(rest) / shares.sum()
        by_t = weight * (slopes @ by_rest)
        by_gap = np.append(np.cumsum(by_t[::-1])[::-1], 0)  # which moves all later nodes
        gradient = np.append(gaps * (by_gap - gaps @ by_gap), weight * (values @ by_rest))
        return np.log(size.max()) + np.log(shares.mean()) / exponent, gradient

    t, weight = map(np.array, gauss_legendre(nodes))
    x = np.log(np.concatenate([np.diff(t, prepend=0, append=1), weight]))
    for exponent in NORMS:
        x = minimize(norm, x, args=(exponent,), jac=True, method="L-BFGS-B", options={"maxiter": 250, "maxcor": 30}).x
    return rule(x)[:2]


def main() -> None:
    """Print the rule and the errors."""
    t, weight = fitted(Integrands(np.random.default_rng(1)), len(HEIGHTS[0]))
    found: Rule = tuple(1 - t**3), tuple(weight * 3 * t**2)
    print("HEIGHTS: Rule = (")
    for row in found:
        print(f"    ({', '.join(f'{x:.8g}' for x in row)}),")
    print(")")
    others = Integrands(np.random.default_rng(2))
    for name, (h, weights) in {"this rule": found, "diffuse.py": HEIGHTS}.items():
        t = (1 - np.array(h)) ** (1 / 3)
        errors = others.errors(t, np.array(weights) / (3 * t * t)).reshape(2, -1)
        for part, error in zip(("value", "density"), errors):
            of = ", ".join(f"{share:g} %: {np.percentile(error, share):.2g}" for share in SHARES)
            print(f"# errors of {name}, {part}, of other inputs: {of}")


if __name__ == "__main__":
    main()
