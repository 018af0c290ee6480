"""What several test files need."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np

from asperity.lab import evaluate
from asperity.models.lambertsphere.transport import Directions

N = 1 << 17


def use(variant):
    """Set the variant; the name of what then is active, since `--variant` may put another in its place."""
    mi.set_variant(variant)
    return mi.variant()


def directions(rng, n, lowest=0.01):
    """Evenly over the hemisphere, in double precision (3, n)."""
    z, azimuth = rng.uniform(lowest, 1, n), rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), z])


def unit(w):
    """Directions (3, n) of length 1."""
    return w / np.linalg.norm(w, axis=0)


def towards(theta, phi=0.3):
    """The direction at these angles, in degrees."""
    theta, phi = np.radians([theta, phi])
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def draw(bsdf, w, n=N):
    """(sample, weight) of ``n`` random numbers, from the direction ``w``."""
    rng = mi.PCG32(size=n)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    return bsdf.sample(mi.BSDFContext(), evaluate.interaction(evaluate.vectors(w[None]), n), *numbers)


def albedo(description, theta, phi=0.3):
    """(mean weight, its standard error, largest weight) of 2^17 samples at the angles in degrees."""
    weight = np.asarray(draw(mi.load_dict(description), towards(theta, phi))[1].x, dtype=float)
    return weight.mean(), weight.std() / N**0.5, weight.max()


def cosine_directions(rng, n):
    """Cosine-distributed, the horizon left out."""
    radius, azimuth = np.sqrt(rng.uniform(0, 0.999, n)), rng.uniform(0, 2 * np.pi, n)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(1 - radius**2)])


def values(bsdf, wi, wo, component=0xFFFFFFFF):
    """f cos_o of a description's component, or of all."""
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), component)
    return np.array(evaluate.load(bsdf).eval(context, evaluate.interaction(wi), wo))


def float64(values):
    """In double precision, whatever the variant."""
    return llvm.Float64(np.asarray(values, dtype=float))


def root(c):
    """sqrt(1 - c) of albedos of particles."""
    return float64(np.sqrt(1 - np.asarray(c, dtype=float)))


def pair(u, v, phi):
    """Pairs of directions of these cosines, apart by these azimuths."""
    u, v, phi = (np.asarray(x, dtype=float).ravel() for x in np.broadcast_arrays(u, v, phi))
    sin = np.sqrt((1 - u * u) * (1 - v * v))
    return Directions(*map(float64, (u, v, sin * np.cos(phi), sin * sin)))


def gauss(n):
    """Nodes and weights in [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (x + 1) / 2, w / 2
