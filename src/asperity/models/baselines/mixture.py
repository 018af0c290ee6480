"""What the baselines have in common: GGX metal and a base, each weighted by the share of it that directions see."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ...conductors import Conductor
from ...errors import ParameterError
from ...lobes import Lifted, Lobe, LobeModel, Opening, above, glossy
from ...microfacet.ggx import lift, normal_in_sphere_space, sample_visible_normal, smith_lambda, to_sphere
from ...microfacet.numerics import keep, log1p
from ...microfacet.sampling import reflect
from ..micrograin import Micrograin


def equivalent_roughness(tau_0: Any, beta: Any) -> Any:
    """GGX alpha whose NDF is as high at the normal as that of grains: beta sqrt(-tau_0 / log(1 - tau_0)).

    Lucas 2024, Eq. 28 with its sign mended, for tau_0 in [0, 1] and beta > 0; within [0.27 beta, beta].
    """
    tau_0 = keep(tau_0, 1e-6, 1 - 1e-6)
    return beta * dr.sqrt(-tau_0 / log1p(-tau_0))


@dataclass
class Layer:
    """The porous layer at a surface point."""

    tau_0: Any  # share of the metal seen from above
    alpha_x: Any
    alpha_y: Any

    def lift(self, w: Any) -> Any:
        """``w``, kept off the horizon."""
        return lift(w, self.alpha_x, self.alpha_y)

    def smith_lambda(self, w: Any) -> Any:
        """Lambda of the metal along ``w``."""
        return smith_lambda(to_sphere(w, self.alpha_x, self.alpha_y))


METAL = Conductor("metal of the grains", "none")
Share = Callable[[Any, Any], Any]
"""Of two directions, kept off the horizon: the share of something that both reach."""


class Mixture(LobeModel):
    """GGX metal and an opaque base; the model says how much of each two directions reach, in ``shares``.

    With w_M and w_B from ``shares``, f cos_o = w_M(i, o) D F / (4 cos_i) + w_B(i, o) f_B cos_o, and what is seen along
    i is what i and the normal both reach, since the normal reaches everything: it weights the lobes in `sample`.
    """

    tau_0, beta, metal, base = Micrograin.tau_0, Micrograin.beta, METAL, Micrograin.base

    def shares(self, si: Any, active: Any, layer: Layer) -> tuple[Share, Share]:
        """w_M, of the metal, with its masking and shadowing; and w_B, of the base."""
        raise NotImplementedError

    def configure(self, given: set[str]) -> None:
        """Refuse a base that light passes through or that is a perfect mirror."""
        if self.base is not None and self.base.flags() & int(mi.BSDFFlags.Delta | mi.BSDFFlags.Transmission):
            raise ParameterError(
                f"base = {self.base.class_name()}: a smooth mirror, or light passes through it; "
                "expected an opaque BSDF without such lobes, such as diffuse or roughconductor."
            )

    def flags(self) -> list[int]:
        """The metal's lobe."""
        return [glossy(self.beta.isotropic)]

    def components(self) -> list[int]:
        """Flags of the metal, then of the base, which is out of sight from below."""
        return [flags & ~int(mi.BSDFFlags.BackSide) for flags in super().components()]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """The metal."""
        layer = self._layer(si, active)
        metal = GGXMetal(layer, self.at("metal", si, active), self.shares(si, active, layer)[0])
        return [Lifted(metal, layer.lift)]

    def opening(self, si: Any, active: Any) -> Opening:
        """The base, as far as the metal is not there."""
        layer = self._layer(si, active)
        return Rest(layer, self.shares(si, active, layer)[1])

    def _layer(self, si: Any, active: Any) -> Layer:
        tau_0 = self.at("tau_0", si, active)
        return Layer(tau_0, *(equivalent_roughness(tau_0, beta) for beta in self.at("beta", si, active)))


@dataclass
class GGXMetal(Lobe):
    """The lobe of GGX metal that covers a share of the surface."""

    layer: Layer
    reflectance: Callable[[Any], Any]
    reach: Share

    def share(self, wi: Any) -> Any:
        """What is seen of the metal: without the masking, which visible normals bring along."""
        return self.reach(wi, type(wi)(0, 0, 1)) * (1 + self.layer.smith_lambda(wi))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """w_M D F / (4 cos_i), and the density of visible normals over 4 i.m."""
        layer, m = self.layer, dr.normalize(wi + wo)
        _, ndf = normal_in_sphere_space(m, layer.alpha_x, layer.alpha_y)
        reflected = ndf / (4 * wi.z)
        value = self.reflectance(dr.dot(wi, m)) * (reflected * self.reach(wi, wo))
        return value, reflected / (1 + layer.smith_lambda(wi))

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Mirrored in a visible normal."""
        layer = self.layer
        m = sample_visible_normal(to_sphere(wi, layer.alpha_x, layer.alpha_y), v.x, v.y)
        return reflect(wi, dr.normalize(type(wi)(layer.alpha_x * m.x, layer.alpha_y * m.y, m.z)))


@dataclass
class Rest(Opening):
    """The base where the metal is not; out of sight from below."""

    layer: Layer
    both: Share

    def share(self, wi: Any) -> Any:
        """What the normal and ``wi`` both reach."""
        return self.reach(wi, type(wi)(0, 0, 1))

    def reach(self, wi: Any, wo: Any) -> Any:
        """What both directions reach."""
        return dr.select((wi.z > 0) & (wo.z > 0), self.both(*(self.layer.lift(above(w)) for w in (wi, wo))), 0)
