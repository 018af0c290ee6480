"""The GGX distribution in the space that its roughness E = diag(alpha_x, alpha_y, 1) stretches to a hemisphere.

Arguments are Dr.Jit arrays of any precision, or plain floats; a direction ``w`` is E w / |E w| already, above the
horizon.
"""

from __future__ import annotations

from typing import Any

import drjit as dr

from .numerics import SHORTEST

GRAZING = 1e-3
"""Smallest cosine in sphere space: shadows grow as its inverse, beyond what float32 resolves."""


def to_sphere(w: Any, beta_x: Any, beta_y: Any) -> Any:
    """Direction ``w`` in sphere space: E w / |E w| (Lucas 2024, Sec. 4.2, "Anisotropic GAF")."""
    stretched = type(w)(beta_x * w.x, beta_y * w.y, w.z)
    return stretched * dr.rsqrt(dr.squared_norm(stretched))


def lift(w: Any, beta_x: Any, beta_y: Any) -> Any:
    """``w`` raised where it needs to be, so that its cosine in sphere space is at least `GRAZING`."""
    tangent = dr.sqrt(dr.square(beta_x * w.x) + dr.square(beta_y * w.y) + SHORTEST)
    raised = type(w)(w.x, w.y, dr.maximum(w.z, GRAZING * tangent))
    return raised * dr.rsqrt(dr.squared_norm(raised))


def inclination(w: Any) -> tuple[Any, Any]:
    """(sine, cosine) of the angle between ``w`` and the normal, safe at normal and at grazing incidence."""
    return dr.sqrt(w.x * w.x + w.y * w.y + SHORTEST), w.z


def normal_in_sphere_space(m: Any, beta_x: Any, beta_y: Any) -> tuple[Any, Any]:
    """(height h' = m'_z, D_ggx(m)) of a unit normal ``m``; h' is the height on the grain whose normal is m.

    With D_ggx of roughness (beta_x, beta_y), the micrograin NDF of Lucas 2024, Eq. 12 is
    tau_0 D(m) = pi r exp(-r pi (1 - h'^2)) D_ggx(m); it is used in this product only, which has no 0/0 at tau_0 = 0.
    """
    stretch = dr.square(m.x / beta_x) + dr.square(m.y / beta_y) + dr.square(m.z)
    return m.z * dr.rsqrt(stretch), density(stretch, beta_x, beta_y)


def density(stretch: Any, beta_x: Any, beta_y: Any) -> Any:
    """D_ggx(m) of a unit normal ``m``, from its ``stretch`` = |E^-1 m|^2 (Walter et al. 2007)."""
    return dr.rcp(dr.pi * beta_x * beta_y * dr.square(stretch))


def smith_lambda(w: Any) -> Any:
    """Lambda(w) >= 0 of Smith's masking G1 = 1 / (1 + Lambda) (Walter et al. 2007; Heitz 2014, Eq. 72)."""
    return (1 / w.z - 1) / 2


def sample_visible_normal(w: Any, u: Any, v: Any) -> Any:
    """Visible normal along ``w`` for ``u``, ``v`` in [0, 1): the sphere's cap, reflected (Dupuy and Benyoub 2023)."""
    z = dr.fma(1 - u, 1 + w.z, -w.z)
    radius = dr.safe_sqrt((1 - z) * (1 + z))
    sin, cos = dr.sincos(2 * dr.pi * v)
    m = type(w)(radius * cos + w.x, radius * sin + w.y, dr.maximum(z + w.z, 1e-6))
    return m * dr.rsqrt(dr.squared_norm(m))
