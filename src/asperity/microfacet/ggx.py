"""The GGX distribution in the space that its roughness E = diag(alpha_x, alpha_y, 1) stretches to a hemisphere.

Arguments are Dr.Jit arrays of any precision, or plain floats; a direction ``w`` is E w / |E w| already, above the
horizon.
"""

from __future__ import annotations

import drjit as dr


def smith_lambda(w):
    """Lambda(w) >= 0 of Smith's masking G1 = 1 / (1 + Lambda) (Walter et al. 2007; Heitz 2014, Eq. 72)."""
    return (1 / w.z - 1) / 2


def sample_visible_normal(w, u, v):
    """Visible normal along ``w`` for ``u``, ``v`` in [0, 1): the sphere's cap, reflected (Dupuy and Benyoub 2023)."""
    z = dr.fma(1 - u, 1 + w.z, -w.z)
    radius = dr.safe_sqrt((1 - z) * (1 + z))
    sin, cos = dr.sincos(2 * dr.pi * v)
    m = type(w)(radius * cos + w.x, radius * sin + w.y, dr.maximum(z + w.z, 1e-6))
    return m * dr.rsqrt(dr.squared_norm(m))
