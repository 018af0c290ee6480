"""Quadrature over normals, in double precision, that takes nothing from the package."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import numpy as np

RINGS, AZIMUTHS = 2000, 256


def hemisphere(alpha_u, alpha_v):
    """(normals, solid angles): evenly in azimuth, and in t of the slope alpha t^2 / (1 - t)^2, stretched."""
    t, psi = (np.arange(RINGS) + 0.5) / RINGS, (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * 2 * np.pi
    t, psi = (x.ravel() for x in np.meshgrid(t, psi))
    r, jacobian = (t / (1 - t)) ** 2, 2 * t / (1 - t) ** 3
    slopes = np.stack([alpha_u * r * np.cos(psi), alpha_v * r * np.sin(psi), np.ones_like(r)])
    m = slopes / np.linalg.norm(slopes, axis=0)
    angle = alpha_u * alpha_v * r * jacobian * m[2] ** 3 * (2 * np.pi / t.size)
    return llvm.Array3f64(m), angle


def mean(values, angle):
    """Integral of values at the nodes."""
    return (np.asarray(values) * angle).sum()
