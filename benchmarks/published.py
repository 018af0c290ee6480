"""Fits to MERL's materials that others have published, by the formulas of their papers: f in 1/sr, in NumPy.

A fit is what `published_fits.json` has of a material: lobes, of which one is Lambertian. The numbers are those of the
papers' supplements, as the library BBM (github.com/bsdfbenchmark/bbm) has them. The papers are not clear about what a
lobe is divided by: it is what BBM takes, and what brings the fits nearest to the materials, as
`python benchmarks/published.py` shows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Lobe = dict[str, Any]


class Pairs:
    """Cosines and slopes (n, 1) of pairs of directions."""

    def __init__(self, wi: Array, wo: Array):
        half = wi + wo
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        self.i, self.o, self.h = wi[:, 2:], wo[:, 2:], half[:, 2:]
        self.d = np.clip((wi * half).sum(axis=1, keepdims=True), 0, 1)
        self.slope2 = 1 / self.h**2 - 1

    @property
    def grooves(self) -> Array:
        """Masking and shadowing of V-cavities."""
        return np.minimum(1, 2 * self.h * np.minimum(self.i, self.o) / self.d)


def schlick(normal: Any, cosine: Array) -> Array:
    """Fresnel's reflectance by that at normal incidence."""
    return np.asarray(normal + (1 - normal) * (1 - cosine) ** 5)


def dielectric(eta: float, cosine: Array) -> Array:
    """Fresnel's reflectance by the index of refraction, as Cook and Torrance write it."""
    g = np.sqrt(eta**2 + cosine**2 - 1)
    return (
        0.5
        * ((g - cosine) / (g + cosine)) ** 2
        * (1 + ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)) ** 2)
    )


def lambertian(lobe: Lobe, pairs: Pairs) -> Array:
    """Of an albedo."""
    return np.asarray(lobe["albedo"]) / np.pi * np.ones_like(pairs.i)


def ngan(lobe: Lobe, pairs: Pairs) -> Array:
    """Cook and Torrance's model as A. Ngan et al. 2005 have it: Beckmann's distribution, ``eta`` is F at the normal."""
    m2 = lobe["roughness"] ** 2
    distribution = np.exp(-pairs.slope2 / m2) / (np.pi * m2 * pairs.h**4)
    fresnel = schlick(lobe["eta"], pairs.d)
    return np.asarray(lobe["albedo"]) * distribution * pairs.grooves * fresnel / (np.pi * pairs.i * pairs.o)


def low(lobe: Lobe, pairs: Pairs) -> Array:
    """The microfacet model of J. Löw et al. 2012, with the ABC distribution."""
    distribution = np.asarray(lobe["A"]) * (1 + lobe["B"] * (1 - pairs.h)) ** -lobe["C"]
    return distribution * pairs.grooves * dielectric(lobe["eta"], pairs.d) / (np.pi * pairs.i * pairs.o)


def bagher(lobe: Lobe, pairs: Pairs) -> Array:
    """The shifted gamma distribution of M. Bagher et al. 2012, with masking and Fresnel terms of each channel."""
    names = ("albedo", "alpha", "p", "K", "Lambda", "c", "k", "theta0")
    albedo, alpha, p, scale, most, c, k, first = (np.asarray(lobe[name]) for name in names)
    shifted = alpha + pairs.slope2 / alpha
    distribution = scale * np.exp(-shifted) / (shifted**p * np.pi * pairs.h**4)

    def masking(cosine: Array) -> Array:
        beyond = np.maximum(np.arccos(cosine) - first, 0)
        with np.errstate(over="ignore"):
            return np.clip(1 + most * (1 - np.exp(c * beyond**k)), 0, 1)

    normal, tilt = (np.asarray(one) for one in lobe["eta"])
    fresnel = np.maximum(schlick(normal, pairs.d) - tilt * pairs.d, 0)
    return albedo * distribution * masking(pairs.i) * masking(pairs.o) * fresnel / (np.pi * pairs.i * pairs.o)


LOBES: dict[str, Callable[[Lobe, Pairs], Array]] = {
    "Lambertian": lambertian,
    "NganCookTorrance": ngan,
    "LowMicrofacetFit": low,
    "Bagher": bagher,
}
FITS = {
    "Ngan 2005": "ngan_cooktorrance",
    "Löw 2012": "low_lowmicrofacet_E2",
    "Bagher 2012": "bagher_sgd",
}
"""What the tables call them, and the file."""


def evaluate(fit: dict[str, Any], wi: Array, wo: Array) -> Array:
    """f (n, 3) of a fit."""
    pairs = Pairs(wi, wo)
    return np.sum([LOBES[lobe["type"]](lobe, pairs) for lobe in fit["lobes"]], axis=0)


def factors(list_: str) -> Array:
    """By what the specular lobes of all materials would have to be multiplied, to be nearest (materials,)."""
    import materials
    from scipy.optimize import minimize_scalar

    found = []
    for name in materials.names("merl"):
        fit = materials.published()[list_].get(name.partition("/")[2])
        if fit is None:
            continue
        data = materials.within(materials.network(name.partition("/")[2], every=127))
        directions = Pairs(data.wi, data.wo)
        body, shine = (LOBES[lobe["type"]](lobe, directions) for lobe in fit["lobes"])
        measured = np.log1p(data.values * directions.o)

        def error(x: float, body=body, shine=shine, o=directions.o, measured=measured, data=data) -> float:
            squared = np.square(np.log1p((body + np.exp(x) * shine) * o) - measured)
            return float(squared.mean(axis=1) @ data.weights)

        found.append(np.exp(minimize_scalar(error, bounds=(-4, 4), method="bounded").x))
    return np.array(found)


if __name__ == "__main__":
    for name, list_ in FITS.items():
        quartiles = ", ".join(f"{q:.2f}" for q in np.percentile(factors(list_), (25, 50, 75)))
        print(f"{name}: quartiles of the factor that its specular lobes lack: {quartiles}")
