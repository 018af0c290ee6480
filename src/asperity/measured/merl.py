"""MERL's ``.binary``: W. Matusik et al., A Data-Driven Reflectance Model, 2003. Isotropic, in RGB.

Three int32, the counts of θ_h, θ_d and φ_d; then float64, all of R, all of G, all of B, φ_d fastest, each to be
multiplied by its scale. Angles are those of S. Rusinkiewicz, A New Change of Variables for Efficient BRDF
Representation, 1998: the half vector is at θ_h, and the light at θ_d, φ_d from it; φ_d + π is the same by reciprocity.
Number i of θ_h is at (i / count)² π/2, the others are even: θ_d below π/2, φ_d below π.

The format does not say where in its bin a value belongs; here it is the lower end, as in the published reader, which
looks up the bin that a direction falls into. Pairs of which one is below the horizon have no value; in published files
these are negative, and so are some above it. At θ_d = 0 all φ_d are the same pair, wi = wo: their mean is taken.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..files import atomically
from .brdf import ABOVE, BRDF, Array
from .files import reading

FORMATS = (".binary",)
COUNTS = (90, 90, 180)
"""Of θ_h, θ_d, φ_d in published files; files of other counts are read as well."""
CHANNELS = ("R", "G", "B")
SCALES = np.array([1.0, 1.15, 1.66]) / 1500
NONE = -1.0
"""In files, where there is no value."""
LARGEST = 1e30
"""Of numbers in files: what is beyond is damage."""
NEAR = 1e-3
"""Steps of the grid within which a direction lies on a node."""


def load(path: str | Path) -> BRDF:
    """The values of a file at its nodes that have one; raises UnreadableFileError."""
    with reading(path, FORMATS) as path:
        table = read(path)
        wi, wo = nodes(table.shape[:3])  # type: ignore[arg-type]
        values = table.reshape(-1, 3)
        above = (wi[:, 2] > ABOVE) & (wo[:, 2] > ABOVE)
        negative = above & (values < 0).any(axis=1)
        repeated = np.zeros(table.shape[:3], dtype=bool)
        repeated[:, 0, 1:] = True
        kept = above & ~negative & ~repeated.ravel()
        left_out = {"below the horizon": int((~above).sum()), "negative": int(negative.sum())}
        source = f"MERL, {path.stem}"
        weights = solid_angles(table.shape[:3])[kept]  # type: ignore[arg-type]
        return BRDF(wi[kept], wo[kept], values[kept], CHANNELS, source=source, weights=weights, left_out=left_out)


def read(path: Path) -> Array:
    """All values of a file (θ_h, θ_d, φ_d, 3), in 1/sr; negative where it has none. Raises ParameterError."""
    size = path.stat().st_size
    header = np.fromfile(path, dtype="<i4", count=3)
    if len(header) < 3:
        raise ParameterError(f"it ends in its header, after {size} bytes")
    counts = tuple(header.tolist())
    if size != _bytes(counts):
        swapped = tuple(header.byteswap().tolist())
        wanted = (
            f"its dimensions are {' x '.join(map(str, counts))}, which takes {_bytes(counts)} bytes, and it has {size}"
        )
        raise ParameterError("its byte order is big-endian" if size == _bytes(swapped) else wanted)
    values = np.fromfile(path, dtype="<f8", offset=12).reshape(3, *counts)
    if len(wrong := np.flatnonzero(~np.isfinite(values))):
        channel = CHANNELS[wrong[0] // values[0].size]
        raise ParameterError(f"{len(wrong)} of its values are not finite, the first in {channel}")
    if np.abs(values).max() > LARGEST:
        raise ParameterError(f"it has values as large as {np.abs(values).max():.3g}")
    table = np.moveaxis(values, 0, -1) * SCALES
    table[:, 0] = _mean(table[:, 0])
    return table


def _mean(values: Array) -> Array:
    """(θ_h, 1, 3) of values (θ_h, φ_d, 3) at θ_d = 0, where all φ_d are the same pair; negative if none has one."""
    known = (values >= 0).all(axis=-1, keepdims=True)
    count = known.sum(axis=1, keepdims=True)
    return np.where(count > 0, np.where(known, values, 0).sum(axis=1, keepdims=True) / np.maximum(count, 1), NONE)


def _bytes(counts: tuple[int, ...]) -> int:
    """Of a file with these dimensions; 0 if there are none such."""
    return 12 + 24 * int(np.prod([int(n) for n in counts], dtype=object)) if min(counts) > 0 else 0


def write(table: Array, path: str | Path) -> None:
    """Write values (θ_h, θ_d, φ_d, 3), in 1/sr; those that are negative or NaN become "no value"."""
    values = np.moveaxis(np.where(np.nan_to_num(table, nan=-1.0) >= 0, table / SCALES, NONE), -1, 0)
    with atomically(Path(path)) as part, open(part, "wb") as file:
        np.array(table.shape[:3], dtype="<i4").tofile(file)
        np.ascontiguousarray(values, dtype="<f8").tofile(file)


def nodes(counts: tuple[int, int, int] = COUNTS) -> tuple[Array, Array]:
    """``wi`` and ``wo`` of all nodes (n, 3), of which some are below the horizon; the half vector is at φ = 0."""
    h, d, p = (np.arange(n) / n for n in counts)
    theta_h, theta_d, phi_d = np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")
    return directions(theta_h.ravel(), theta_d.ravel(), phi_d.ravel())


def solid_angles(counts: tuple[int, int, int] = COUNTS) -> Array:
    """dω_i dω_o of all nodes (n,), up to a factor: 4 cosθ_d dω_h dω_d, each over the step around the node.

    φ_d is even; at θ_d = 0, where all φ_d are the same pair, the first node gets the weight of all.
    """
    h = np.radians(90) * np.square(np.clip(np.arange(counts[0] + 1) - 0.5, 0, None) / counts[0])
    d = np.radians(90) * np.clip(np.arange(counts[1] + 1) - 0.5, 0, None) / counts[1]
    weights = -np.diff(np.cos(h))[:, None, None] * np.diff(np.square(np.sin(d)))[:, None] * np.ones(counts[2])
    weights[:, 0, 0] *= counts[2]
    return weights.ravel()


def directions(theta_h: Any, theta_d: Any, phi_d: Any) -> tuple[Array, Array]:
    """``wi`` and ``wo`` (n, 3) of Rusinkiewicz's angles, in radians, with the half vector at φ = 0."""
    across, along, depth = np.sin(theta_d) * np.sin(phi_d), np.sin(theta_d) * np.cos(phi_d), np.cos(theta_d)
    cos, sin = np.cos(theta_h), np.sin(theta_h)
    both = (np.stack([cos * s * along + sin * depth, s * across, cos * depth - sin * s * along], -1) for s in (1, -1))
    wi, wo = both
    return wi, wo


def angles(wi: Array, wo: Array) -> Array:
    """θ_h, θ_d and φ_d (..., 3) in radians, φ_d from [0, 2π); φ_d is 0 where it has no meaning."""
    half = wi + wo
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-30)
    flat = np.hypot(half[..., 0], half[..., 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        cos, sin = (np.where(flat > 0, half[..., k] / flat, 1.0 - k) for k in (0, 1))
    # wi in the frame of the half vector: turned about z, then about y.
    x, y = cos * wi[..., 0] + sin * wi[..., 1], cos * wi[..., 1] - sin * wi[..., 0]
    along, depth = half[..., 2] * x - flat * wi[..., 2], flat * x + half[..., 2] * wi[..., 2]
    theta_d = np.arctan2(np.hypot(along, y), depth)
    return np.stack([np.arctan2(flat, half[..., 2]), theta_d, np.arctan2(y, along) % (2 * np.pi)], axis=-1)


def coordinates(wi: Array, wo: Array, counts: tuple[int, ...]) -> Array:
    """Where pairs of directions lie on the grid (..., 3), in steps; φ_d within its half circle."""
    theta_h, theta_d, phi_d = np.moveaxis(angles(wi, wo), -1, 0)
    places = (np.sqrt(theta_h * 2 / np.pi), theta_d * 2 / np.pi, phi_d / np.pi % 1)
    return np.stack([place * n for place, n in zip(places, counts)], axis=-1)


def interpolate(table: Array, wi: Array, wo: Array) -> Array:
    """f (n, channels) between the nodes of a table (θ_h, θ_d, φ_d, channels); 0 where none around has a value.

    It is linear in all three coordinates, from the nodes that have a value. Beyond the last node of θ_h and θ_d it
    keeps its values, and φ_d goes around.
    """
    counts = np.array(table.shape[:3])
    place = coordinates(wi, wo, table.shape[:3])
    first = np.floor(place).astype(int)
    part = place - first
    total, weights = np.zeros((len(wi), table.shape[3])), np.zeros((len(wi), 1))
    for corner in np.ndindex(2, 2, 2):
        at = first + corner
        i, j = (np.minimum(at[:, k], counts[k] - 1) for k in (0, 1))
        values = table[i, j, at[:, 2] % counts[2]]
        weight = np.prod(np.where(corner, part, 1 - part), axis=1, keepdims=True) * (values >= 0).all(axis=1)[:, None]
        total, weights = total + weight * np.where(weight > 0, values, 0), weights + weight
    return total / np.where(weights > 0, weights, 1)


def counts(brdf: BRDF) -> tuple[int, int, int] | None:
    """The counts of the grid that pairs seem to be nodes of, by the last ones; None if they are of none.

    The last θ_h is that of a pair wi = wo, the others those of pairs about the normal, all of them above the surface.
    """
    theta_h, theta_d, phi_d = np.moveaxis(coordinates(brdf.wi, brdf.wo, (1, 1, 1)), -1, 0)
    tilted = (theta_d > NEAR) & (theta_h > NEAR)  # elsewhere φ_d has no meaning
    if not brdf.isotropic or not tilted.any():
        return None
    last = np.array([theta_h.max(), theta_d.max(), phi_d[tilted & (phi_d < 1 - NEAR**2)].max(initial=0)])
    found = np.round(1 / np.maximum(1 - last, NEAR**2))
    if np.abs(found * (1 - last) - 1).max() > NEAR or np.prod(found) > 2 * np.prod(COUNTS):
        return None
    return tuple(int(n) for n in found)  # type: ignore[return-value]


def table(brdf: BRDF, counts: tuple[int, int, int] = COUNTS) -> Array | None:
    """The values on the grid (θ_h, θ_d, φ_d, channels), NaN where there are none; None unless all are its nodes."""
    if not brdf.isotropic or len(brdf) > np.prod(counts):
        return None
    place = coordinates(brdf.wi, brdf.wo, counts)
    index = np.round(place).astype(int)
    off = np.abs(place - index)
    index[:, 2] %= counts[2]
    off[(index[:, :2] == 0).any(axis=1), 2] = 0  # there φ_d has no meaning
    if off.max() > NEAR or (index[:, :2] >= counts[:2]).any():
        return None
    found = np.full((*counts, len(brdf.channels)), np.nan)
    found[tuple(index.T)] = brdf.values
    same = index[:, 1] == 0
    found[index[same, 0], 0] = brdf.values[same, None]
    straight, known = found[0], np.isfinite(found[0])
    mean = np.where(known, straight, 0).sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    found[0] = np.where(~known & known.any(axis=1, keepdims=True), mean, straight)
    return found
