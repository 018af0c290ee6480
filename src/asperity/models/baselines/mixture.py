"""What the baselines have in common: GGX metal and a base, each weighted by the share of it that directions see."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...errors import ParameterError
from ...microfacet.fresnel import conductor
from ...microfacet.ggx import lift, normal_in_sphere_space, sample_visible_normal, smith_lambda, to_sphere
from ...microfacet.numerics import keep, log1p
from ...parameters import Declared, conflict
from ..micrograin.model import ALL_COMPONENTS, ONE_BELOW, TINY


def equivalent_roughness(tau_0, beta):
    """GGX alpha whose NDF is as high at the normal as that of grains: beta sqrt(-tau_0 / log(1 - tau_0)).

    Lucas 2024, Eq. 28 with its sign mended, for tau_0 in [0, 1] and beta > 0; within [0.27 beta, beta].
    """
    tau_0 = keep(tau_0, 1e-6, 1 - 1e-6)
    return beta * dr.sqrt(-tau_0 / log1p(-tau_0))


class Layer(NamedTuple):
    """The porous layer at a surface point."""

    tau_0: Any  # share of the metal seen from above
    alpha_x: Any
    alpha_y: Any

    def lift(self, w):
        """``w``, kept off the horizon; directions from below are masked by the caller."""
        return lift(w, self.alpha_x, self.alpha_y)

    def smith_lambda(self, w):
        """Lambda of the metal along ``w``."""
        return smith_lambda(to_sphere(w, self.alpha_x, self.alpha_y))


class Mixture(Declared):
    """GGX metal and an opaque base; the model says how much of each two directions reach, in ``shares``.

    With w_M and w_B from ``shares``, f cos_o = w_M(i, o) D F / (4 cos_i) + w_B(i, o) f_B cos_o, and what is seen along
    i is what i and the normal both reach, since the normal reaches everything: it weights the lobes in `sample`.
    A model declares these parameters, as micrograin does.
    """

    tau_0: Any
    beta: Any
    beta_x: Any
    beta_y: Any
    metal: Any
    base: Any

    def shares(self, si, active, layer: Layer, i, o) -> tuple[Any, Any]:
        """Shares (w_M, w_B) of the metal, with its masking and shadowing, and of the base, that i and o both reach."""
        raise NotImplementedError

    def configure(self, given: set[str]) -> None:
        """Settle the axes; refuse a base that light passes through or that is a perfect mirror."""
        conflict({"beta"} & given, {"beta_x", "beta_y"} & given)
        self.isotropic = not {"beta_x", "beta_y"} & given
        self.axes = ["beta" if getattr(self, name) is None else name for name in ("beta_x", "beta_y")]
        for name in ("beta", "beta_x", "beta_y"):
            if name not in self.axes:
                setattr(self, name, None)
        if self.base is not None and self.base.flags() & int(mi.BSDFFlags.Delta | mi.BSDFFlags.Transmission):
            raise ParameterError(
                f"base = {self.base.class_name()}: a smooth mirror, or light passes through it; "
                "expected an opaque BSDF without such lobes, such as diffuse or roughconductor."
            )

    def components(self) -> list[int]:
        """Flags of the metal, then of the base, which is out of sight from below."""
        metal = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        base = [] if self.base is None else [self.base.flags(n) for n in range(self.base.component_count())]
        return [
            int(metal | (0 if self.isotropic else mi.BSDFFlags.Anisotropic)),
            *(flags & ~int(mi.BSDFFlags.BackSide) for flags in base),
        ]

    def eval_pdf(self, ctx, si, wo, active):
        """(f |cos_o|, solid-angle density of `sample`)."""
        layer, metal_chance, base_chance = self._choose(ctx, si, active)
        active = active & (si.wi.z > 0) & (wo.z > 0)
        wi, lifted = layer.lift(si.wi), layer.lift(wo)
        metal, base = self.shares(si, active, layer, wi, lifted)
        value, pdf = mi.UnpolarizedSpectrum(0), mi.Float(0)
        if metal_chance is not None:
            m = dr.normalize(wi + lifted)
            _, ndf = normal_in_sphere_space(m, layer.alpha_x, layer.alpha_y)
            reflected = ndf / (4 * wi.z)
            value = self._fresnel(si, active, dr.dot(wi, m)) * (reflected * metal * (wo.z / lifted.z))
            pdf = metal_chance * reflected / (1 + layer.smith_lambda(wi))
        if base_chance is not None:
            base_value, base_pdf = self.base.eval_pdf(self._base_context(ctx), si, wo, active)
            value = value + base * mi.unpolarized_spectrum(base_value)
            pdf = pdf + base_chance * base_pdf
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Metal by its visible normals, the base by its own `sample`; both weighted by the density of both.

        Directions and densities carry no gradient: derivatives are those of the value at a fixed direction.
        """
        layer, _, base_chance = self._choose(ctx, si, active)
        wi, bs = layer.lift(si.wi), dr.zeros(mi.BSDFSample3f)
        m = sample_visible_normal(to_sphere(wi, layer.alpha_x, layer.alpha_y), sample2.x, sample2.y)
        bs.wo = mi.reflect(wi, dr.normalize(mi.Normal3f(layer.alpha_x * m.x, layer.alpha_y * m.y, m.z)))
        bs.eta, bs.sampled_type = 1, mi.UInt32(self.components()[0])
        if base_chance is not None:
            on_base = active & (sample1 < base_chance)
            u = dr.minimum(sample1 / dr.maximum(base_chance, TINY), ONE_BELOW)
            base, _ = self.base.sample(self._base_context(ctx), si, u, sample2, on_base)
            base.sampled_component += 1
            bs = dr.select(on_base, base, bs)
        bs = dr.detach(bs)
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active)
        bs.pdf = dr.detach(pdf)
        return bs, value / dr.maximum(bs.pdf, TINY) & (bs.pdf > 0)

    def _choose(self, ctx, si, active) -> tuple[Layer, Any, Any]:
        """The layer here, and the chances of the metal and of the base; None for what is not there or not wanted."""
        tau_0 = self.number("tau_0", si, active)
        layer = Layer(tau_0, *(equivalent_roughness(tau_0, self.number(name, si, active)) for name in self.axes))
        wi = layer.lift(si.wi)
        metal, base = self.shares(si, active, layer, wi, mi.Vector3f(0, 0, 1))
        metal = metal * (1 + layer.smith_lambda(wi))  # without the masking, which visible normals bring along
        wants_metal, wants_base = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0), self._base_context(ctx) is not None
        scale = dr.rcp(dr.maximum((metal if wants_metal else 0) + (base if wants_base else 0), TINY))
        return layer, metal * scale if wants_metal else None, base * scale if wants_base else None

    def _base_context(self, ctx):
        """The context as the base counts components, or None if the base is not there or not wanted."""
        if self.base is None or ctx.component == ALL_COMPONENTS:
            return ctx if self.base is not None else None
        return mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component - 1) if ctx.component > 0 else None

    def _fresnel(self, si, active, cos):
        if self.metal.mirror:
            return mi.UnpolarizedSpectrum(1)
        return conductor(cos, *self.metal.eval(si, active))
