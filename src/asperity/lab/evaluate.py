"""Calls any ``mi.BSDF`` on arrays of directions, without a scene.

Directions are local: z is the surface normal, and all of them point away from the surface. In polarised variants the
values are those for unpolarised light.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.stats import qmc

from asperity import loading
from asperity.errors import ParameterError

SHORTEST, LONGEST = 400.0, 700.0
"""nm. Spectral variants evaluate at wavelengths between these."""
ALL = 0xFFFFFFFF
"""Components of a BSDF."""


def active_variant() -> str:
    """Return the variant in use; raise ParameterError if none is."""
    if mi.variant() is None:
        raise ParameterError('no Mitsuba variant is set: call mitsuba.set_variant("llvm_ad_rgb"), say, first')
    return str(mi.variant())


def require_arrays(what: str) -> None:
    """Raise ParameterError if the variant in use computes one number at a time, with which ``what`` cannot be done."""
    variant = active_variant()
    if not dr.is_jit_v(mi.Float):
        raise ParameterError(f"variant {variant}: {what} needs one that computes on arrays, such as llvm_ad_rgb.")


def load(description: dict[str, Any] | mi.BSDF) -> mi.BSDF:
    """Return the BSDF that a dictionary describes, or the BSDF itself if it is one already; raise ParameterError."""
    variant = active_variant()
    bsdf = loading.load(description) if isinstance(description, dict) else description
    if not isinstance(bsdf, mi.BSDF):
        raise ParameterError(f"expected a BSDF of variant {variant} or the dictionary of one, got {bsdf!r:.200}")
    return bsdf


def interaction(wi: mi.Vector3f, lanes: int = 1, wavelengths: Any = None) -> mi.SurfaceInteraction3f:
    """Return a point seen from ``wi``, in a frame equal to the world's, at the middle of the texture.

    In spectral variants it has the ``wavelengths`` given, in nm, one a channel. If none are given, every lane gets
    wavelengths of its own, always the same ones for the same lane: channel k is
    uniform in the k-th part of the visible range, so that two calls can be compared.
    """
    lanes = max(lanes, dr.width(wi.x))
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = wi
    si.t = 1
    si.uv = [0.5, 0.5]
    si.n = [0, 0, 1]
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    si.dp_du = [1, 0, 0]
    si.dp_dv = [0, 1, 0]
    if mi.is_spectral and wavelengths is not None:
        si.wavelengths = list(map(float, wavelengths))
    elif mi.is_spectral:
        lane = dr.arange(mi.UInt32, lanes) if dr.is_jit_v(mi.Float) else 0
        channels = len(si.wavelengths)
        width = (LONGEST - SHORTEST) / channels
        si.wavelengths = [SHORTEST + width * (k + mi.sample_tea_float32(lane, k)) for k in range(channels)]
    return si


def _lanes(*directions: mi.Vector3f) -> int:
    return max(dr.width(w.x) for w in directions)


def eval(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.UnpolarizedSpectrum:
    """Return f(wi, wo) |cos θo|, in 1/sr."""
    return mi.unpolarized_spectrum(bsdf.eval(mi.BSDFContext(), interaction(wi, _lanes(wi, wo)), wo))


def pdf(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Float:
    """Return the density with which ``bsdf`` samples ``wo``, in 1/sr."""
    return bsdf.pdf(mi.BSDFContext(), interaction(wi, _lanes(wi, wo)), wo)


def eval_pdf(bsdf: mi.BSDF, wi: mi.Vector3f, wo: mi.Vector3f) -> tuple[mi.UnpolarizedSpectrum, mi.Float]:
    """Return what ``eval`` and ``pdf`` return, from one call."""
    value, density = bsdf.eval_pdf(mi.BSDFContext(), interaction(wi, _lanes(wi, wo)), wo)
    return mi.unpolarized_spectrum(value), density


def sample(
    bsdf: mi.BSDF, wi: mi.Vector3f, sample1: mi.Float, sample2: mi.Point2f
) -> tuple[mi.BSDFSample3f, mi.UnpolarizedSpectrum]:
    """Return a sampled direction and its weight f |cos θo| / pdf."""
    lanes = max(dr.width(sample1), _lanes(wi))
    drawn, weight = bsdf.sample(mi.BSDFContext(), interaction(wi, lanes), sample1, sample2)
    return drawn, mi.unpolarized_spectrum(weight)


def variates(n: int, seed: int) -> tuple[mi.Float, mi.Point2f]:
    """Return the ``n`` random numbers and points of the unit square that ``sample`` takes."""
    # Streams numbered 0, 1, 2, ... are correlated: scramble the numbers first.
    state, stream = mi.sample_tea_32(dr.arange(mi.UInt32, n), seed)
    rng = mi.PCG32(initstate=state, initseq=stream)
    return mi.Float(rng.next_float32()), mi.Point2f(rng.next_float32(), rng.next_float32())


def direction(theta: float, phi: float) -> mi.Vector3f:
    """Return the direction at ``theta`` from the normal and azimuth ``phi``, in degrees.

    It is opaque to Dr.Jit: all directions share one compiled kernel.
    """
    t, p = np.radians([theta, phi])
    xyz = (np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t))
    return mi.Vector3f(*(dr.opaque(mi.Float, float(x)) for x in xyz))


def uniform_sphere(n: int, seed: int) -> mi.Vector3f:
    """Return ``n`` directions, uniform over the sphere."""
    return mi.warp.square_to_uniform_sphere(variates(n, seed)[1])


def uniform_hemisphere(n: int, seed: int) -> mi.Vector3f:
    """Return ``n`` directions, uniform over the upper hemisphere."""
    return mi.warp.square_to_uniform_hemisphere(variates(n, seed)[1])


def hard_directions() -> np.ndarray:
    """Return directions (n, 3) that formulas divide by zero at: grazing, horizontal, normal; on both sides."""
    cosines = np.array([1, 0.7, 0.3, *10.0 ** -np.arange(1, 7), 0])
    z, phi = (a.ravel() for a in np.meshgrid(np.concatenate([cosines, -cosines]), [0, 1.1, 2.5]))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def hard_pairs(seed: int = 0) -> tuple[mi.Vector3f, mi.Vector3f]:
    """Return pairs wi, wo of hard directions; also wo = wi, mirrored, opposite and normal, exactly and nearly so."""
    rng = np.random.default_rng(seed)
    hard = hard_directions()
    normal = np.broadcast_to([0.0, 0.0, 1.0], hard.shape)
    wi, wo = [np.repeat(hard, len(hard), axis=0)], [np.tile(hard, (len(hard), 1))]
    for special in (hard, hard * [-1, -1, 1], -hard, normal, -normal):
        for shift in (0, *10.0 ** -np.arange(2, 8), *10.0 ** -np.arange(2, 8)):
            moved = special + shift * rng.normal(size=special.shape)
            wi.append(hard)
            wo.append(moved / np.linalg.norm(moved, axis=1, keepdims=True))
    return vectors(np.concatenate(wi)), vectors(np.concatenate(wo))


def special_pairs(both_sides: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs wi, wo (n, 3) that formulas treat apart, exactly so in float32; the horizon is not among them.

    Either is normal, or lies on an axis; or both are coplanar, at right angles, equal, mirrored by the normal or by an
    axis; and all of that straight through the surface. With ``both_sides``, wi may come from below.
    """
    cosines = np.cos(np.radians([7, 23, 45, 60, 77.1, 89.9]))
    axes = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], *np.array([[0.8, 0.6], [-0.28, 0.96]])])
    generic = np.array([[0.48, 0.6, 0.64], [-0.36, 0.48, 0.8], [0.64, -0.768, 0.024]])
    turns = ((1, 0), (-1, 0), (0, 1), (0, -1))  # cosine and sine of 0, 180, 90 and 270 degrees
    special = [(axis, z) for axis in axes for z in cosines]
    normal = np.array([0.0, 0.0, 1.0])
    wi, wo = [normal], [normal]
    for axis, z in special:
        w = raised(axis, z)
        others = [normal, *generic, w * [1, -1, 1], w * [-1, 1, 1]]
        others += [raised((c * axis[0] - s * axis[1], s * axis[0] + c * axis[1]), y) for c, s in turns for y in cosines]
        wi += [w] * len(others)
        wo += others
    i, o = (np.array(pairs, dtype=np.float32) for pairs in (wi + wo, wo + wi))
    i, o = np.concatenate([i, i]), np.concatenate([o, o * [1, 1, -1]])
    return (np.concatenate([i, i * [1, 1, -1]]), np.concatenate([o, o * [1, 1, -1]])) if both_sides else (i, o)


def raised(azimuth: Any, z: float) -> np.ndarray:
    """Return the direction of cosine ``z`` over a horizontal unit vector."""
    return np.array([*(np.sqrt(1 - z * z) * np.asarray(azimuth)), z])


def at_pairs(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, wavelengths: Any = None) -> np.ndarray:
    """Return f |cos θo| of every channel and the pdf (channels + 1, n), for pairs of directions (n, 3)."""
    si, out = interaction(vectors(wi), len(wi), wavelengths), vectors(wo)
    value = mi.unpolarized_spectrum(bsdf.eval(mi.BSDFContext(), si, out))
    density = bsdf.pdf(mi.BSDFContext(), si, out)
    return np.concatenate([to_numpy(value, len(wi)), to_numpy(density, len(wi))])


def spectra(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, wavelengths: Any = None) -> np.ndarray:
    """Return f |cos θo| (channels, n) for pairs of directions (n, 3), at any number of wavelengths.

    It is asked for as many at a time as the variant has.
    """
    if wavelengths is None:
        return at_pairs(bsdf, wi, wo)[:-1]
    count = dr.size_v(mi.UnpolarizedSpectrum)
    groups = np.pad(wavelengths, (0, -len(wavelengths) % count), mode="edge").reshape(-1, count)
    return np.concatenate([at_pairs(bsdf, wi, wo, group)[:-1] for group in groups])[: len(wavelengths)]


def vectors(directions: np.ndarray) -> mi.Vector3f:
    """Return an array (n, 3) as ``n`` Mitsuba vectors."""
    return mi.Vector3f(np.ascontiguousarray(directions.T, dtype=np.float32))


def to_numpy(value: Any, lanes: int) -> np.ndarray:
    """Return a Dr.Jit array as float64 (components, lanes): values that are the same in all lanes come as one lane."""
    rows = np.array(dr.detach(value), dtype=np.float64)
    rows = np.atleast_2d(rows) if dr.is_jit_v(mi.Float) else rows.reshape(-1, 1)
    return np.broadcast_to(rows, (len(rows), lanes))


def cell_means(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, wavelengths: Any = None) -> np.ndarray:
    """Mean of f |cos θo| over cells (channels, *cells), each covered by the directions ``wo`` (*cells, n, 3)."""
    lanes = wo.size // 3
    si = interaction(vectors(np.atleast_2d(wi)), lanes, wavelengths)
    value = mi.unpolarized_spectrum(bsdf.eval(mi.BSDFContext(), si, vectors(wo.reshape(-1, 3))))
    return to_numpy(value, lanes).reshape(-1, *wo.shape[:-1]).mean(axis=-1)


def albedo(
    bsdf: mi.BSDF,
    wi: np.ndarray,
    samples: int = 2**18,
    wavelengths: Any = None,
    *,
    component: int = ALL,
    below: bool = False,
) -> np.ndarray:
    """Directional albedo, the share that is reflected upwards, for directions (n, 3): (channels, n).

    The mean weight of ``samples`` points of Sobol's sequence, a power of two. Of one ``component`` of the BSDF, if it
    is given; with ``below``, the share that leaves downwards instead.
    """
    points = qmc.Sobol(3, seed=1).random(samples)
    u = np.tile(points, (len(wi), 1)).T
    si = interaction(vectors(np.repeat(wi, samples, axis=0)), u.shape[1], wavelengths)
    # Power, not radiance, which is scaled where it enters glass.
    context = mi.BSDFContext(mi.TransportMode.Importance, int(mi.BSDFFlags.All), component)
    bs, weight = bsdf.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))
    leaves = bs.wo.z < 0 if below else bs.wo.z > 0
    found = dr.select(leaves, mi.unpolarized_spectrum(weight), 0)
    return to_numpy(found, u.shape[1]).reshape(-1, len(wi), samples).mean(axis=-1)
