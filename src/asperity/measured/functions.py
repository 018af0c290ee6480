"""BRDFs as functions of two directions: what measured pairs are interpolated to, and what a BSDF is.

- Pairs on a grid of Rusinkiewicz's angles, as in MERL's files, are linear in between (`merl.interpolate`).
- Other pairs, in no order, are interpolated from the nearest ones: a linear function is fitted to asinh(f / median),
  by weights that are infinite at the pairs themselves, and held within their values. Near means in coordinates that
  reciprocal pairs share, and in isotropic BRDFs those that are turned about the normal, or mirrored (`places`). Beyond
  the measured pairs this goes on with the last values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError
from . import merl
from .brdf import BRDF, Array

NEIGHBOURS = 16
"""From which a value is interpolated."""
STIFFNESS = 1e-4
"""How slopes that the neighbours do not determine are held at 0."""
SAME = 1e-6
"""Distance of places within which pairs are the same."""
CHUNK = 2**15
"""Pairs at a time, which bounds the memory."""
TESTED = 2000
"""Pairs of which `cross_validation` makes sure."""
LIKE = 1e-3
"""ln(1 + f cosθ_o) by which an isotropic BRDF may change when it is turned: single precision, and interpolation."""


@dataclass(frozen=True)
class Function:
    """f (n, channels), in 1/sr and without the cosine, of ``wi`` and ``wo`` (n, 3) above the surface."""

    f: Callable[[Array, Array], Array]
    channels: tuple[str, ...]
    isotropic: bool = True
    source: str = ""

    def __call__(self, wi: Array, wo: Array) -> Array:
        """In pieces of bounded memory."""
        pieces = [self.f(wi[k : k + CHUNK], wo[k : k + CHUNK]) for k in range(0, len(wi), CHUNK)]
        return np.concatenate(pieces) if pieces else np.zeros((0, len(self.channels)))


def of_brdf(brdf: BRDF) -> Function:
    """The function that goes through the pairs of a container."""
    counts = merl.counts(brdf)
    table = None if counts is None else merl.table(brdf, counts)
    f = Scattered(brdf) if table is None else lambda wi, wo: merl.interpolate(table, wi, wo)
    return Function(f, brdf.channels, brdf.isotropic, brdf.source)


def of_bsdf(bsdf: Any, wavelengths: Sequence[float] | None = None, source: str = "") -> Function:
    """What a BSDF of the active variant reflects; mirrors and clear glass in it have no values.

    ``wavelengths``, in nm, are for spectral variants. Raises ParameterError if it has no values, or not finite ones.
    """
    import mitsuba as mi

    from ..lab import evaluate

    evaluate.require_arrays("tabulating a BSDF")
    if not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth):
        raise ParameterError(f"{source or 'the BSDF'} is all mirror, or clear glass: it has no values to tabulate.")
    if mi.is_spectral and not wavelengths:
        raise ParameterError(f"variant {mi.variant()}: name the wavelengths to tabulate the BSDF at.")
    if mi.is_spectral:
        channels = tuple(f"{nm:g} nm" for nm in wavelengths or ())
    else:
        channels = ("Y",) if mi.is_monochromatic else ("R", "G", "B")

    def f(wi: Array, wo: Array) -> Array:
        values = evaluate.spectra(bsdf, wi, wo, wavelengths if mi.is_spectral else None).T / wo[:, 2:]
        if not np.isfinite(values).all():
            wrong = int((~np.isfinite(values)).any(axis=1).sum())
            raise ParameterError(f"{source or 'the BSDF'} is not finite at {wrong} of {len(wi)} pairs of directions.")
        return np.asarray(values)

    return Function(f, channels, is_isotropic(f), source)


def is_isotropic(f: Callable[[Array, Array], Array], n: int = 1000) -> bool:
    """Whether f stays the same when random pairs are turned about the normal."""
    wi, wo = random_pairs(n, seed=1)
    angle = np.random.default_rng(2).uniform(0, 2 * np.pi, n)
    moved = (turned(w, angle) for w in (wi, wo))
    logs = (np.log1p(np.maximum(x, 0) * wo[:, 2:]) for x in (f(wi, wo), f(*moved)))
    return bool(np.quantile(np.abs(np.subtract(*logs)), 0.99) < LIKE)


def random_pairs(n: int, seed: int = 0, highest: float = 85.0) -> tuple[Array, Array]:
    """``wi`` and ``wo`` (n, 3) at most ``highest`` degrees from the normal.

    √θ_h, θ_d, φ_d and the azimuth of the half vector are uniform: there are as many near the mirrored direction as in
    MERL's files.
    """
    random = np.random.default_rng(seed)
    found: list[Array] = []
    while sum(len(pair) for pair in found) < n:
        u = random.random((4, 2 * n))
        both = merl.directions(u[0] ** 2 * np.pi / 2, u[1] * np.pi / 2, u[2] * 2 * np.pi)
        pair = np.stack([turned(w, 2 * np.pi * u[3]) for w in both], axis=1)
        found.append(pair[pair[..., 2].min(axis=1) > np.cos(np.radians(highest))])
    pairs = np.concatenate(found)[:n]
    return pairs[:, 0], pairs[:, 1]


def turned(w: Array, angle: Array) -> Array:
    """Directions (n, 3), each turned about the normal by its angle (n,)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * w[:, 0] - sin * w[:, 1], sin * w[:, 0] + cos * w[:, 1], w[:, 2]], axis=-1)


class Scattered:
    """Interpolates the values of pairs of directions that lie anywhere."""

    def __init__(self, brdf: BRDF):
        from scipy.spatial import cKDTree

        self.brdf = brdf
        self.scale = np.maximum(np.median(np.abs(brdf.values), axis=0), 1e-12)
        self.values = np.arcsinh(brdf.values / self.scale)
        self.tree = cKDTree(places(brdf.wi, brdf.wo, brdf.isotropic))

    def __call__(self, wi: Array, wo: Array) -> Array:
        """f (n, channels)."""
        return self._at(places(wi, wo, self.brdf.isotropic), NEIGHBOURS)

    def _at(self, place: Array, count: int, least: float = 0.0) -> Array:
        """At places (n, axes), from pairs that are farther than ``least``."""
        count = min(count, len(self.values))
        distance, index = self.tree.query(place, count)
        distance, index = distance.reshape(-1, count), index.reshape(-1, count)
        radius = distance[:, -1:] * (1 + SAME) + SAME
        near = np.maximum(distance, SAME * radius)
        weight = np.square((radius - near) / (radius * near)) * (distance >= least)  # R. Franke and G. Nielson, 1980
        weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
        offset = (self.tree.data[index] - place[:, None]) / radius[..., None]
        design = np.concatenate([np.ones((*index.shape, 1)), offset], axis=-1)
        weighted = design * weight[..., None]
        normal = np.einsum("nka,nkb->nab", weighted, design)
        normal += np.diag([0.0] + [STIFFNESS] * (design.shape[-1] - 1))
        values = self.values[index]
        found = np.linalg.solve(normal, np.einsum("nka,nkc->nac", weighted, values))[:, 0]
        held = np.where((weight > 0)[..., None], values, np.nan)
        return np.sinh(np.clip(found, np.nanmin(held, axis=1), np.nanmax(held, axis=1))) * self.scale

    def cross_validation(self, seed: int = 0) -> tuple[Array, Array]:
        """Numbers of some pairs, and f (n, channels) there from the others: how far interpolation is to be trusted."""
        chosen = np.random.default_rng(seed).permutation(len(self.values))[:TESTED]
        count = min(NEIGHBOURS + 1, len(self.values))
        chosen = chosen[self.tree.query(self.tree.data[chosen], [count])[0][:, 0] > 2 * SAME]  # it has others
        return chosen, self._at(self.tree.data[chosen], count, least=SAME)


def places(wi: Array, wo: Array, isotropic: bool) -> Array:
    """Coordinates (n, 3 or 5) in which alike pairs are near: of the half vector, and of the angles from it.

    √θ_h spreads out highlights. By reciprocity φ_d and φ_d + π are the same; by symmetry, φ_d and -φ_d, of an isotropic
    BRDF: it comes as cos 2φ_d, times sinθ_h sinθ_d, which vanishes where φ_d has no meaning.
    """
    theta_h, theta_d, phi_d = np.moveaxis(merl.angles(wi, wo), -1, 0)
    out, apart = np.sqrt(theta_h * 2 / np.pi), theta_d * 2 / np.pi
    if isotropic:
        return np.stack([out, apart, np.sin(theta_h) * np.sin(theta_d) * np.cos(2 * phi_d) / 2], axis=-1)
    phi_h = np.arctan2(*(wi + wo)[:, 1::-1].T)
    twice = 2 * (phi_d + phi_h)
    across = np.stack([np.cos(twice), np.sin(twice)], axis=-1) * np.sin(theta_d)[:, None] / 2
    return np.concatenate([np.stack([out * np.cos(phi_h), out * np.sin(phi_h), apart], axis=-1), across], axis=-1)
