"""How much of the microfacets neighbours hide: masking of one direction, masking and shadowing of two.

All functions are for directions above the horizon; ``cos`` is w_z, ``cos_m`` is m_z, ``facing`` is the dot product w.m,
which is negative of facets that are turned away. Arguments are Dr.Jit arrays of any precision, or plain floats.
"""

from __future__ import annotations

from typing import Any

import drjit as dr

from .distributions import Distribution
from .numerics import SHORTEST
from .sampling import choose


def cavity_visible(facing: Any, cos: Any, cos_m: Any) -> Any:
    """<w.m> G1(w, m): what is seen of a facet of a V-cavity, G1 = min(1, 2 m_z w_z / w.m) (Torrance and Sparrow 1967).

    The other facet is m' = (-m_x, -m_y, m_z); the two fill the opening: their sum is 2 m_z w_z.
    """
    return dr.maximum(dr.minimum(facing, 2 * cos_m * cos), 0)


def cavity_visible_and_lit(facing_i: Any, facing_o: Any, cos_i: Any, cos_o: Any, cos_m: Any) -> Any:
    """<i.m> <o.m> G(i, o, m) with G = min(1, 2 m_z i_z / i.m, 2 m_z o_z / o.m), of the same cavity, without division.

    For m = h, f cos_o = D F G / (4 cos_i) (Cook and Torrance 1982).
    """
    facing_i, facing_o = dr.maximum(facing_i, 0), dr.maximum(facing_o, 0)
    narrower = dr.minimum(cos_i * facing_o, cos_o * facing_i)
    return dr.minimum(facing_i * facing_o, 2 * cos_m * narrower)


def cavity_visible_density(distribution: Distribution, w: Any, m: Any) -> Any:
    """Density per steradian of the normals of `sample_cavity_visible_normal`: D <w.m> G1(w, m) / w_z.

    The Gaussian's is that of how it is sampled, in place of D.
    """
    return distribution.sample_density(m) * cavity_visible(dr.dot(w, m), w.z, m.z) / (m.z * w.z)


def sample_cavity_visible_normal(distribution: Distribution, w: Any, u: Any, v: Any, choice: Any) -> tuple[Any, Any]:
    """(normal, random number) of a facet seen along ``w``, for three numbers in [0, 1) (Heitz and d'Eon 2014).

    A cavity is met by its opening, with density D m_z, and each of its facets by what is seen of it. ``choice``, which
    decides between the two, is as good as new after that, and returned.
    """
    m = distribution.sample(u, v)
    other = type(m)(-m.x, -m.y, m.z)
    seen, of_other = (dr.maximum(dr.dot(w, facet), 0) for facet in (m, other))
    first, left = choose(choice, seen / (seen + of_other))
    return dr.select(first, m, other), left


def smith_masking(lambda_w: Any) -> Any:
    """G1(w) of facets that face ``w``, whatever their normals."""
    return dr.rcp(1 + lambda_w)


def smith_separable(lambda_i: Any, lambda_o: Any) -> Any:
    """G = G1(i) G1(o), from Smith's Lambda along both directions: neither knows of the other."""
    return smith_masking(lambda_i) * smith_masking(lambda_o)


def smith_height_correlated(lambda_i: Any, lambda_o: Any) -> Any:
    """G for directions that meet facets at the same height (Ross et al. 2005; Heitz 2014, Eq. 99)."""
    return dr.rcp(1 + lambda_i + lambda_o)


def smith_direction_correlated(lambda_i: Any, lambda_o: Any, azimuth: Any) -> Any:
    """The same, and where the ``azimuth`` between them in [0, pi] is 0, who sees less sees what is lit.

    van Ginneken et al. 1998 with the constant of Heitz et al. 2013; see Heitz 2014, Eq. 101.
    """
    apart = 4.41 * azimuth / (4.41 * azimuth + 1)
    return dr.rcp(1 + dr.maximum(lambda_i, lambda_o) + apart * dr.minimum(lambda_i, lambda_o))


def azimuth_between(i: Any, o: Any) -> Any:
    """The angle in [0, pi] between two directions seen from above; 0 if one of them is the normal."""
    across, along = i.x * o.y - i.y * o.x, i.x * o.x + i.y * o.y
    defined = dr.square(across) + dr.square(along) > SHORTEST**2
    return dr.atan2(dr.abs(across), dr.select(defined, along, 1))
