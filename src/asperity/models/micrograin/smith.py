"""Grains with Smith's masking: heights independent of normals, and of each other (Lucas et al. 2023).

The published baseline of the micrograin model, as Lucas 2024 recalls it in Eq. 1 to 6. Two pieces are not printed there
and were filled in: the masking function follows from Smith's condition that the visible normals project to the whole
surface, and the transmission T of a coated grain is taken for the macroscopic angles.
"""

from __future__ import annotations

import drjit as dr

from ...microfacet.ggx import inclination
from ...microfacet.ggx import sample_visible_normal as sample_visible_normal
from ...microfacet.numerics import one_minus_exp
from ...microfacet.quadrature import integrate
from .grains import exposure
from .shadows import silhouette

HEIGHTS = 12


def masking(r, w):
    """G1(w) = cos / int D(m) (w.m)+ dm, for ``w`` in sphere space."""
    sin, cos = inclination(w)

    def width(h, captured):  # int (w.m')+ over the azimuth, of what is exposed at height h
        r, sin, cos = captured
        _, sin_alpha, gamma = silhouette(sin, cos, h)
        return (2 * (cos * h * (dr.pi - gamma) + sin * sin_alpha) * exposure(r, h, 0),)

    (projected,) = integrate(width, HEIGHTS, (r, sin, cos), r * cos)
    return dr.minimum(cos * filling_factor(r) / (r * projected), 1)


def masking_shadowing(r, i, o):
    """G1(i) G1(o) w+(i, o) / tau_0: the filling factor of Lucas 2024, Eq. 20 was w+ before."""
    return masking(r, i) * masking(r, o) * grain_weight(r, i, o) / filling_factor(r)


def filling_factor(r):
    """tau_0."""
    return one_minus_exp(dr.pi * r)


def grain_weight(r, i, o):
    """w+(i, o), the share of the grains among what both directions see (Lucas 2023; 2024, Eq. 4)."""
    return one_minus_exp(_pore_depth(r, i, o))


def pore_weight(r, i, o):
    """1 - w+(i, o) = (1 - tau_i) (1 - tau_o) / (1 - tau_0)."""
    return dr.exp(-_pore_depth(r, i, o))


def _pore_depth(r, i, o):
    """All three factors are exponentials."""
    return r * (dr.pi / 2) * (1 / inclination(i)[1] + 1 / inclination(o)[1])


def visible_masking(w):
    """G1 of GGX for ``w`` in sphere space."""
    _, cos = inclination(w)
    return 2 / (1 + 1 / cos)
