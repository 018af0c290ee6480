"""The micrograin BSDF (Lucas et al. 2024, Eq. 20): parameters, and the sum of its lobes."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...errors import ParameterError
from ...microfacet.fresnel import conductor
from ...parameters import BSDF, Choice, Colour, Conductor, Declared, Flag, Ior, Texture
from . import smith
from .diffuse import lambertian
from .grains import density, exposure, normal_in_sphere_space, sample_visible_normal, visible_fraction
from .shadows import lift, shadow, to_sphere, union

CITATION = """\
@article{Lucas2024Micrograin,
  author  = {Lucas, Simon and Ribardi\\`ere, Micka\\"el and Pacanowski, Romain and Barla, Pascal},
  title   = {A Fully-correlated Anisotropic Micrograin {BSDF} Model},
  journal = {ACM Transactions on Graphics},
  volume  = {43},
  number  = {4},
  pages   = {111},
  year    = {2024},
  doi     = {10.1145/3658224}
}"""
TINY = 1e-20
ALL_COMPONENTS = 0xFFFFFFFF
METAL = {"material", "eta", "k", "reflectivity", "edge_tint"}
COAT = {"int_ior", "ext_ior"}
ALBEDO = {"diffuse_reflectance", "diffuse_reflectance_2"}


class Grains(NamedTuple):
    """The grains at a surface point."""

    r: Any  # density in sphere space
    beta_x: Any
    beta_y: Any

    def to_sphere(self, w):
        """A direction in sphere space."""
        return to_sphere(w, self.beta_x, self.beta_y)

    def lift(self, w):
        """A direction kept off the horizon; directions from below are meaningless then, and masked by the caller."""
        return lift(w, self.beta_x, self.beta_y)


class Chances(NamedTuple):
    """Probabilities with which `Micrograin.sample` chooses a lobe: they add up to one, or are all zero."""

    specular: Any
    diffuse: Any
    base: Any


class Micrograin(Declared):
    """Half-ellipsoidal opaque grains, Poisson-distributed over a base of any BSDF.

    Grains are metal (the default), diffuse (``specular: false``), or diffuse under a dielectric coat (as soon as
    ``diffuse_reflectance`` or an index of refraction is given). For single scattering the model is exact for its geometry.
    """

    citation = CITATION

    tau_0 = Texture("filling factor: share of the base that grains cover, seen from above", 0.3, high=1)
    beta = Texture(
        "height of the grains over their radius: small is flat and shiny, large is rough", 1.0, open_low=True
    )
    beta_x = Texture("beta along x, instead of beta", None, open_low=True)
    beta_y = Texture("beta along y, instead of beta", None, open_low=True)
    metal = Conductor("metal of the grains", "none")
    specular = Flag("whether the grains reflect at their surface; false makes them Lambertian", True)
    diffuse_reflectance = Colour("albedo of diffuse or coated grains", 0.5)
    int_ior = Ior("index of refraction of the grains' coat", "bk7")
    ext_ior = Ior("index of refraction outside", "air")
    variation = Choice("what the grains' second colour follows", options=("none", "height", "normal"))
    variation_azimuth = Texture("azimuth of the normals with the second colour", 0.0, low=-360, high=360, unit="degree")
    diffuse_reflectance_2 = Colour("second albedo: at the grains' top, or on their side at variation_azimuth")
    metal_2 = Conductor("second metal of the grains", suffix="_2")
    masking = Choice(
        "shadows: by height and direction (Eq. 18), by height only (Eq. 17), or Smith's (2023)",
        options=("correlated", "height", "smith"),
    )
    base = BSDF("what the grains lie on; black if none")

    def configure(self, given: set[str]) -> None:
        """Settle what the grains are made of, and their axes."""
        metal, metal_2 = METAL & given, {name + "_2" for name in METAL} & given
        conflict({"beta"} & given, {"beta_x", "beta_y"} & given)
        conflict(metal | metal_2, (COAT | ALBEDO) & given, "grains are metal, or diffuse, perhaps under a coat")
        if not self.specular:
            conflict({"specular"}, metal | metal_2 | COAT & given, "specular: false makes Lambertian grains")
        self.isotropic = not {"beta_x", "beta_y"} & given
        self.coated = self.specular and bool((COAT | ALBEDO) & given)
        self.diffuse = self.coated or not self.specular

        self.betas = (self.beta, self.beta) if self.isotropic else (self.beta_x or self.beta, self.beta_y or self.beta)
        second = self.diffuse_reflectance_2 if self.diffuse else self.metal_2
        if self.variation != "none" and second is None:
            needed = "diffuse_reflectance_2" if self.diffuse else "material_2, or eta_2 and k_2, or reflectivity_2"
            raise ParameterError(f"variation = {self.variation!r}: needs a second colour, {needed}.")
        if self.variation == "none" and (unused := sorted((metal_2 | ALBEDO - {"diffuse_reflectance"}) & given)):
            raise ParameterError(f'{unused[0]}: needs variation = "height" or "normal".')

    def components(self) -> list[int]:
        """Flags of the lobes: specular grains, diffuse grains, then the base's."""
        front = mi.BSDFFlags.FrontSide | (0 if self.isotropic else mi.BSDFFlags.Anisotropic)
        own = [mi.BSDFFlags.GlossyReflection | front] * self.specular + [
            mi.BSDFFlags.DiffuseReflection | front
        ] * self.diffuse
        self.own = [int(flags) for flags in own]
        return self.own + (
            [] if self.base is None else [self.base.flags(n) for n in range(self.base.component_count())]
        )

    def eval_pdf(self, ctx, si, wo, active):
        """(f |cos_o|, solid-angle density of `sample`): the sum of the lobes (Lucas 2024, Eq. 20)."""
        grains = self._grains(si, active)
        chances, visible = self._chances(ctx, si, grains, active)
        above = active & (si.wi.z > 0) & (wo.z > 0)
        wi, lifted = grains.lift(si.wi), grains.lift(wo)
        value, pdf = mi.UnpolarizedSpectrum(0), mi.Float(0)
        for enabled, lobe, chance in (
            (self._has_specular(ctx), self._specular, chances.specular),
            (self._has_diffuse(ctx), self._diffuse, chances.diffuse),
        ):
            if enabled:
                lobe_value, lobe_pdf = lobe(si, wi, lifted, grains, active)
                value, pdf = value + lobe_value, pdf + chance / visible * lobe_pdf
        value, pdf = dr.select(above, value * (wo.z / lifted.z), 0), dr.select(above, pdf, 0)
        if (base_ctx := self._base_context(ctx)) is not None:
            base_value, base_pdf = self.base.eval_pdf(base_ctx, si, wo, active)
            value = value + self._pores(si.wi, wo, grains) * mi.unpolarized_spectrum(base_value)
            pdf = pdf + chances.base * base_pdf
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Choose a lobe by how much of it is seen, sample it, and weight all lobes by the density of all."""
        grains = self._grains(si, active)
        chances, _ = self._chances(ctx, si, grains, active)
        on_base = active & (sample1 >= chances.specular + chances.diffuse)
        on_diffuse = ~on_base & (sample1 >= chances.specular)

        wi = grains.lift(si.wi)
        m = self._visible_normal(wi, grains, sample2)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.eta = mi.reflect(wi, m), 1
        if self._has_diffuse(ctx):
            rest = (sample1 - chances.specular) / dr.maximum(chances.diffuse, TINY)
            bs.wo = dr.select(on_diffuse, self._cosine_lobe(m, rest), bs.wo)
        bs.sampled_component = dr.select(on_diffuse, mi.UInt32(len(self.own) - 1), mi.UInt32(0))
        bs.sampled_type = dr.select(on_diffuse, mi.UInt32(self.own[-1]), mi.UInt32(self.own[0]))

        base_ctx = self._base_context(ctx)
        if base_ctx is not None:
            rest = (sample1 - chances.specular - chances.diffuse) / dr.maximum(chances.base, TINY)
            base, base_weight = self.base.sample(base_ctx, si, dr.clip(rest, 0, 1), sample2, on_base)
            base.sampled_component += len(self.own)
            bs = dr.select(on_base, base, bs)
        base_pdf = bs.pdf
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active & (on_base | (bs.wo.z > 0)))
        weight = value / dr.maximum(bs.pdf, TINY) & (bs.pdf > 0)
        if base_ctx is not None and mi.has_flag(self.base.flags(), mi.BSDFFlags.Delta):
            # A mirror, clear glass or a hole in the base: eval_pdf knows nothing of these directions.
            delta = on_base & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            pores = self._pores(si.wi, bs.wo, grains) / dr.maximum(chances.base, TINY)
            weight = dr.select(delta, mi.unpolarized_spectrum(base_weight) * pores, weight)
            bs.pdf = dr.select(delta, base_pdf * chances.base, bs.pdf)
        return bs, dr.select(active & (bs.pdf > 0), weight, 0)

    def _grains(self, si, active) -> Grains:
        beta_x, beta_y = (texture.eval_1(si, active) for texture in self.betas)
        return Grains(density(self.tau_0.eval_1(si, active)), beta_x, beta_y)

    def _has_specular(self, ctx) -> bool:
        return self.specular and ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)

    def _has_diffuse(self, ctx) -> bool:
        return self.diffuse and ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, len(self.own) - 1)

    def _base_context(self, ctx):
        """The context in the base's own counting of components, or None if the base is not wanted."""
        if self.base is None or ctx.component == ALL_COMPONENTS:
            return ctx if self.base is not None else None
        mine = ctx.component < len(self.own)
        return None if mine else mi.BSDFContext(ctx.mode, ctx.type_mask, ctx.component - len(self.own))

    def _chances(self, ctx, si, grains: Grains, active) -> tuple[Chances, Any]:
        """How `sample` chooses, and the visible fraction tau_i of the grains.

        Exact visibility of grains and pores; Lucas 2024, Eq. 26 overestimates the pores'. Within the grains, Eq. 27.
        """
        above = si.wi.z > 0
        visible = visible_fraction(grains.r, grains.to_sphere(grains.lift(si.wi)))
        part = mi.Float(0 if self.specular else 1)
        if self.coated:
            albedo = dr.mean(self.diffuse_reflectance.eval(si, active))
            part = albedo / (albedo + self._coat(si, active)(dr.abs(si.wi.z)))
        specular = dr.select(above, visible * (1 - part), 0) if self._has_specular(ctx) else mi.Float(0)
        diffuse = dr.select(above, visible * part, 0) if self._has_diffuse(ctx) else mi.Float(0)
        base = dr.select(above, 1 - visible, 1) if self._base_context(ctx) is not None else mi.Float(0)
        scale = dr.rcp(dr.maximum(specular + diffuse + base, TINY))
        return Chances(specular * scale, diffuse * scale, base * scale), dr.maximum(visible, TINY)

    def _visible_normal(self, wi, grains: Grains, sample2):
        i = grains.to_sphere(wi)
        if self.masking == "smith":
            m = smith.sample_visible_normal(i, sample2.x, sample2.y)
        else:
            m = sample_visible_normal(grains.r, i, sample2.x, sample2.y)
        return dr.normalize(mi.Normal3f(grains.beta_x * m.x, grains.beta_y * m.y, m.z))

    def _cosine_lobe(self, m, u):
        """A cosine-distributed direction about the visible normal; Smith's (2023) diffuse grains are flat instead."""
        frame = mi.Frame3f(mi.Normal3f(0, 0, 1) if self.masking == "smith" else m)
        # Mitsuba hands out three numbers and this takes four: the coarse and the fine half of one of them serve as two.
        coarse = u * 2048
        fine = coarse - dr.floor(coarse)
        return frame.to_world(
            mi.warp.square_to_cosine_hemisphere(mi.Point2f(dr.floor(coarse) / 2048 + fine / 2048, fine))
        )

    def _specular(self, si, wi, wo, grains: Grains, active):
        """tau_0 D G F / (4 cos_i) (Lucas 2024, Eq. 22), and the density of reflection at visible normals times tau_i."""
        m = dr.normalize(wi + wo)
        h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        i, o = grains.to_sphere(wi), grains.to_sphere(wo)
        fresnel = self._fresnel(si, dr.dot(wi, m), h, m, active)
        if self.masking == "smith":
            ndf = grains.r * exposure(grains.r, h, 0) / smith.filling_factor(grains.r)
            gaf = smith.masking(grains.r, i) * smith.masking(grains.r, o) * smith.grain_weight(grains.r, i, o)
            common = dr.pi * d_ggx / (4 * wi.z)
            return fresnel * common * ndf * gaf, common / dr.pi * smith.visible_masking(i) * visible_fraction(
                grains.r, i
            )
        shadow_i, shadow_o = shadow(i, h), shadow(o, h)
        common = dr.pi * grains.r * d_ggx / (4 * wi.z)
        value = common * exposure(grains.r, h, self._shaded(i, o, h, shadow_i, shadow_o))
        return fresnel * value, common * exposure(grains.r, h, shadow_i.area)

    def _diffuse(self, si, wi, wo, grains: Grains, active):
        """tau_0 f_d cos_o (Lucas 2024, Eq. 21), and the density of a cosine lobe about visible normals times tau_i."""
        coat = self._coat(si, active) if self.coated else None
        albedo = self.diffuse_reflectance.eval(si, active)
        if self.masking == "smith":
            i, o = grains.to_sphere(wi), grains.to_sphere(wo)
            through = (1 - coat(wi.z)) * (1 - coat(wo.z)) if coat else 1
            cosine = wo.z / dr.pi
            return albedo * smith.grain_weight(grains.r, i, o) * through * cosine, cosine * visible_fraction(
                grains.r, i
            )
        first, second, pdf = lambertian(
            *grains,
            wi,
            wo,
            self._shaded,
            closed=self.isotropic and coat is None and self.variation != "normal",
            share=self._share(si, active),
            transmittance=coat and (lambda cos_i, cos_o: (1 - coat(cos_i)) * (1 - coat(cos_o))),
        )
        value = albedo * first
        if self.variation != "none":
            value = value + self.diffuse_reflectance_2.eval(si, active) * second
        return value, pdf

    def _shaded(self, i, o, h, shadow_i, shadow_o):
        """Area of the two shadows by the choice of masking: Lucas 2024, Eq. 17 or 18."""
        if self.masking == "correlated":
            return union(i, o, h, shadow_i, shadow_o)
        return shadow_i.area + shadow_o.area

    def _pores(self, wi, wo, grains: Grains):
        """Share of the base that both directions reach, V_p (Lucas 2024, Eq. 23).

        Below the surface nothing casts shadows, but light meets the base through pores only, from either side.
        """
        i, o = (grains.to_sphere(grains.lift(w)) for w in (wi, wo))
        shadow_i, shadow_o = shadow(i, 0), shadow(o, 0)
        both = exposure(grains.r, 0, self._shaded(i, o, 0, shadow_i, shadow_o))
        if self.masking == "smith":
            both = smith.pore_weight(grains.r, i, o)
        one = exposure(grains.r, 0, dr.select(wi.z > 0, shadow_i.area, 0) + dr.select(wo.z > 0, shadow_o.area, 0))
        return dr.select((wi.z > 0) & (wo.z > 0), both, one)

    def _share(self, si, active):
        """Function (h, m) for the second colour's share at a point of the grain, or None."""
        if self.variation == "height":
            return lambda h, m: h
        if self.variation == "normal":
            sin, cos = dr.sincos(dr.deg2rad(self.variation_azimuth.eval_1(si, active)))
            return lambda h, m: (1 + m.x * cos + m.y * sin) / 2
        return None

    def _coat(self, si, active):
        """Function from the local cosine to the Fresnel reflectance of the grains' dielectric coat."""
        eta = self.int_ior.eval_1(si, active) / self.ext_ior.eval_1(si, active)
        return lambda cos: mi.fresnel(cos, eta)[0]

    def _fresnel(self, si, cos, h, m, active):
        """Reflectance of the grain at height ``h`` with normal ``m``."""
        if self.coated:
            return self._coat(si, active)(cos)
        if self.metal.mirror and self.variation == "none":
            return mi.UnpolarizedSpectrum(1)
        eta, k = self.metal.eval(si, active)
        if self.variation != "none":
            share = self._share(si, active)(h, m)
            eta_2, k_2 = self.metal_2.eval(si, active)
            eta, k = dr.lerp(eta, eta_2, share), dr.lerp(k, k_2, share)
        return conductor(cos, eta, k)


def conflict(first: set[str], second: set[str], why: str = "give one or the other") -> None:
    """Raise ParameterError if both sets have members."""
    if first and second:
        raise ParameterError(f"{min(first)} and {min(second)} exclude each other: {why}.")
