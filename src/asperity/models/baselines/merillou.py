"""Cylindrical pores, drilled into a rough surface (Mérillou et al. 2000)."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ...microfacet.masking import smith_height_correlated
from ...microfacet.numerics import ONE_BELOW, keep
from ...parameters import BSDF, Texture, Usual
from .mixture import Layer, Mixture, Share

CITATION = """\
@article{Merillou2000Porosity,
  author  = {M\\'erillou, St\\'ephane and Dischler, Jean-Michel and Ghazanfarpour, Djamchid},
  title   = {A {BRDF} Postprocess to Integrate Porosity on Rendered Surfaces},
  journal = {IEEE Transactions on Visualization and Computer Graphics},
  volume  = {6},
  number  = {4},
  year    = {2000},
  doi     = {10.1109/2945.895876}
}"""
SHALLOW = 1e-5
"""Depth of the pores which they have at least: shifts of nothing have no direction, and no derivative."""


class Merillou(Mixture):
    """Mérillou et al. 2000: GGX metal with cylindrical pores; the base lies at their bottom, and their walls absorb.

    Single scattering, with Smith's height-correlated masking and shadowing of the metal. The metal keeps its share
    tau_0 in all directions, since the pores open in the surface's plane. Reconstructed: the publication's text was not
    at hand, only its description in Lucas 2024, Sec. 2 and 5.2. By that, the authors mix with an empirical weight of
    masking and porosity, and approximate multiple scattering between Lambertian walls; here the lit and visible part
    of the bottom is exact instead, and interreflections are left out. Roughness follows from beta by Lucas 2024,
    Eq. 28.
    """

    citation = CITATION

    depth = Texture("depth of the pores over their radius", 1.0, high=1000, usually=Usual(0.1, 10, logarithmic=True))
    base = BSDF("what lies at the bottom of the pores; black if none")

    def shares(self, si: Any, active: Any, layer: Layer) -> tuple[Share, Share]:
        """See `lit_and_visible`; the metal's share is tau_0 / (1 + Lambda_i + Lambda_o)."""
        depth = keep(self.at("depth", si, active), SHALLOW, dr.inf)

        def metal(i: Any, o: Any) -> Any:
            return layer.tau_0 * smith_height_correlated(layer.smith_lambda(i), layer.smith_lambda(o))

        def bottom(i: Any, o: Any) -> Any:
            shift_i, shift_o = (mi.Vector2f(w.x, w.y) * (depth / w.z) for w in (i, o))
            return (1 - layer.tau_0) * lit_and_visible(shift_i, shift_o)

        return metal, bottom


def lit_and_visible(a: Any, b: Any) -> Any:
    """Part in [0, 1] of a pore's bottom that is both lit and visible: what three unit discs have in common, over pi.

    They are the bottom itself, about the origin, and the opening's outlines, cast on the bottom along the directions i
    and o by a = depth i_xy / i_z and b alike. Exact, by Green's theorem: an arc of each circle bounds the area.
    """
    to_a, to_b, between = (_apart(x) for x in (a, b, b - a))
    arcs = _arc(0 * a, to_a, to_b) + (_arc(a, -to_a, between) + _arc(b, -to_b, -between))
    return dr.maximum(arcs / (2 * dr.pi), 0)


def _apart(x: Any) -> Any:
    """``x``, or a short vector if that has no direction: any will do for two discs that coincide.

    But for two that nearly do, only their own: the three directions make a triangle.
    """
    return dr.select(dr.squared_norm(x) < 1e-30, type(x)(1e-6, 0), x)


def _arc(centre: Any, first: Any, second: Any) -> Any:
    """int x dy - y dx along the arc of the unit circle about ``centre`` that lies in two more unit discs.

    Their centres are ``first`` and ``second`` away, and each cuts out an arc of half-width acos(distance / 2).
    """
    to, distances = first / dr.norm(first), (dr.norm(first), dr.norm(second))
    across = type(to)(-to.y, to.x)
    turn = dr.atan2(dr.dot(across, second), dr.dot(to, second))
    v, w = (dr.select(d < 2, dr.acos(dr.minimum(d / 2, ONE_BELOW)), -dr.two_pi) for d in distances)
    start = dr.maximum(-v, turn - w)
    end = dr.maximum(dr.minimum(v, turn + w), start)
    (sin_start, cos_start), (sin_end, cos_end) = dr.sincos(start), dr.sincos(end)
    chord = (cos_end - cos_start) * to + (sin_end - sin_start) * across
    return end - start + centre.x * chord.y - centre.y * chord.x
