"""A reflection model as a sum of lobes over an optional base: all that is not physics, once.

A model names its lobes at a surface point, and how its base is seen there; `LobeModel` makes of them what Mitsuba asks
for: the choice among lobes, contexts and components, the end of ``sample``. What physics gets are unit vectors above
the surface, in the local frame; what it returns for others is never seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from .microfacet.numerics import ONE_BELOW, TINY
from .microfacet.sampling import cosine_hemisphere
from .parameters import Declared

ALL_COMPONENTS = 0xFFFFFFFF


def glossy(isotropic: bool = True) -> int:
    """Flags of a lobe around the mirror direction."""
    return _front(mi.BSDFFlags.GlossyReflection, isotropic)


def diffuse(isotropic: bool = True) -> int:
    """Flags of a lobe that is not around a direction."""
    return _front(mi.BSDFFlags.DiffuseReflection, isotropic)


def _front(kind: Any, isotropic: bool) -> int:
    return int(kind | mi.BSDFFlags.FrontSide | (0 if isotropic else mi.BSDFFlags.Anisotropic))


class Lobe:
    """One way to scatter light at a surface point; it holds the values of parameters there, never the model."""

    def share(self, wi: Any) -> Any:
        """Share of the light from ``wi``, by which ``sample`` chooses; need not add up to 1. All, if not defined."""
        return 1

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, solid-angle density of `draw`): a spectrum or number, and a number."""
        raise NotImplementedError

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """A direction from a number and a pair of numbers in [0, 1); one from below the surface is a rejected sample.

        Fewer are used than given, or more: then by `microfacet.sampling`.
        """
        raise NotImplementedError


class Opening:
    """How much of the base is seen at a surface point, through what lies on it; here, directions may be from below."""

    def share(self, wi: Any) -> Any:
        """Share of what is seen from ``wi`` that is base."""
        raise NotImplementedError

    def reach(self, wi: Any, wo: Any) -> Any:
        """Share of the base that both directions reach."""
        raise NotImplementedError


@dataclass
class ByCosine(Lobe):
    """A lobe that is drawn by cosine, and stands alone."""

    brdf: Callable[[Any, Any], Any]  # (wi, wo) -> f per steradian

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, cos_o / pi)."""
        return self.brdf(wi, wo) * wo.z, wo.z / dr.pi

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine."""
        return cosine_hemisphere(v.x, v.y)


@dataclass
class Lifted(Lobe):
    """A lobe that gets directions which ``lift`` keeps off the horizon, where its formulas break in float32."""

    lobe: Lobe
    lift: Callable[[Any], Any]

    def share(self, wi: Any) -> Any:
        """That of the lifted direction."""
        return self.lobe.share(self.lift(wi))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """Those of lifted directions, but for the cosine."""
        lifted = self.lift(wo)
        value, pdf = self.lobe.eval_pdf(self.lift(wi), lifted)
        return value * (wo.z / lifted.z), pdf

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """A direction for the lifted one."""
        return self.lobe.draw(self.lift(wi), u, v)


class LobeModel(Declared):
    """A model that is the sum of lobes, and of its base if it declares one."""

    base: Any = None

    def flags(self) -> list[int]:
        """Flags of each lobe: `glossy`, `diffuse`."""
        raise NotImplementedError

    def lobes(self, si: Any, active: Any) -> Sequence[Lobe]:
        """The lobes at a surface point."""
        raise NotImplementedError

    def opening(self, si: Any, active: Any) -> Opening:
        """How the base is seen at a surface point, if there is a base."""
        raise NotImplementedError

    def components(self) -> list[int]:
        """Flags of the lobes and then of the base's."""
        base = [] if self.base is None else [self.base.flags(n) for n in range(self.base.component_count())]
        return self.flags() + base

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        """(f |cos_o|, solid-angle density of `sample`)."""
        lobes, chances, base_chance = self._choose(ctx, si, active)
        lit = active & (si.wi.z > 0) & (wo.z > 0)
        wi, upper = above(si.wi), above(wo)
        value, pdf = mi.UnpolarizedSpectrum(0), mi.Float(0)
        for n, chance in chances.items():
            lobe_value, lobe_pdf = lobes[n].eval_pdf(wi, upper)
            value, pdf = value + mi.UnpolarizedSpectrum(lobe_value), pdf + chance * lobe_pdf
        value, pdf = dr.select(lit, value, 0), dr.select(lit, pdf, 0)
        if base_chance is None:
            return value, pdf
        base_value, base_pdf = self.base.eval_pdf(self._base_context(ctx), si, wo, active)
        value = value + self.opening(si, active).reach(si.wi, wo) * mi.unpolarized_spectrum(base_value)
        return dr.select(active, value, 0), dr.select(active, pdf + base_chance * base_pdf, 0)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        """Choose a lobe by how much of it is seen, draw from it, and weight all lobes by the density of all.

        Directions and densities carry no gradient: derivatives are those of the value at a fixed direction.
        """
        lobes, chances, base_chance = self._choose(ctx, si, active)
        wi, bs, start = above(si.wi), dr.zeros(mi.BSDFSample3f), mi.Float(0)
        bs.eta = 1
        for n, chance in chances.items():
            chosen = sample1 >= start
            wo = mi.Vector3f(lobes[n].draw(wi, _rescale(sample1, start, chance), sample2))
            bs.wo = dr.select(chosen, wo, bs.wo)
            bs.sampled_component = dr.select(chosen, mi.UInt32(n), bs.sampled_component)
            bs.sampled_type = dr.select(chosen, mi.UInt32(self.flags()[n]), bs.sampled_type)
            start = start + chance
        bs = dr.detach(bs)
        if base_chance is not None:
            return self._sample_base(ctx, si, sample1, sample2, active, bs, start, dr.detach(base_chance))
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active)
        bs.pdf = dr.detach(pdf)
        return bs, _weight(value, bs.pdf)

    def _sample_base(
        self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any, bs: Any, start: Any, chance: Any
    ) -> tuple[Any, Any]:
        """The end of `sample`: the base, where it is chosen (beyond ``start``), or else ``bs``; and the weight."""
        on_base = active & (sample1 >= start)
        context, u = self._base_context(ctx), _rescale(sample1, start, chance)
        base, base_weight = self.base.sample(context, si, u, sample2, on_base)
        base_weight = mi.unpolarized_spectrum(base_weight)
        base.sampled_component += len(self.flags())
        bs = dr.detach(dr.select(on_base, base, bs))
        # Lobes end at the horizon, where a transmitting base may well have a density.
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active & (on_base | (bs.wo.z > 0)))
        rejected = on_base & dr.all(base_weight == 0) & self._stale(context, si, bs, on_base)
        pdf = dr.detach(dr.select(rejected, 0, pdf))
        # A mirror, clear glass, or a hole in the base: no other lobe reaches its direction, and eval_pdf is zero there.
        delta = on_base & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        single = base_weight * self.opening(si, active).reach(si.wi, bs.wo) / dr.maximum(chance, TINY)
        bs.pdf = dr.select(delta, bs.pdf * chance, pdf)
        return bs, dr.select(delta, single, _weight(value, pdf)) & active

    def _stale(self, context: Any, si: Any, bs: Any, active: Any) -> Any:
        """Whether the base, which gave a weight of 0, rejected the sample and left the rest of it as it was.

        Mitsuba's samplers do. A black base is no rejection.
        """
        value, pdf = self.base.eval_pdf(context, si, bs.wo, active)
        return dr.any(mi.unpolarized_spectrum(value) > 0) | (dr.abs(pdf - bs.pdf) > 0.01 * bs.pdf)

    def _choose(self, ctx: Any, si: Any, active: Any) -> tuple[Sequence[Lobe], dict[int, Any], Any]:
        """The lobes here, the chance of each that is enabled, and that of the base (None if not wanted)."""
        lobes, wi, seen = self.lobes(si, active), above(si.wi), si.wi.z > 0
        smooth = int(mi.BSDFFlags.Smooth)
        enabled = [n for n, flags in enumerate(self.flags()) if ctx.is_enabled(mi.BSDFFlags(flags & smooth), n)]
        wants_base = self._base_context(ctx) is not None
        if len(enabled) == 1 and not wants_base:
            return lobes, {enabled[0]: 1}, None
        shares = {n: dr.select(seen, lobes[n].share(wi), 0) for n in enabled}
        base = self.opening(si, active).share(si.wi) if wants_base else None
        scale = dr.rcp(dr.maximum(sum(shares.values()) + (base if wants_base else 0), TINY))
        return lobes, {n: share * scale for n, share in shares.items()}, base * scale if wants_base else None

    def _base_context(self, ctx: Any) -> Any:
        """The context as the base counts components, or None if the base is not there or not wanted."""
        if self.base is None or ctx.component == ALL_COMPONENTS:
            return ctx if self.base is not None else None
        component = ctx.component - len(self.flags())
        return mi.BSDFContext(ctx.mode, ctx.type_mask, component) if component >= 0 else None


def above(w: Any) -> Any:
    """``w``, or the normal if ``w`` is not above the surface: what lobes get."""
    return dr.select(w.z > 0, w, mi.Vector3f(0, 0, 1))


def _rescale(u: Any, start: Any, chance: Any) -> Any:
    """Stretch what is left of a random number after a choice to [0, 1)."""
    return dr.clip((u - start) / dr.maximum(chance, TINY), 0, ONE_BELOW)


def _weight(value: Any, pdf: Any) -> Any:
    return value / dr.maximum(pdf, TINY) & (pdf > 0)
