"""The micrograin BSDF (Lucas et al. 2024, Eq. 20): parameters, and the sum of its lobes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...conductors import Conductor
from ...errors import ParameterError
from ...loading import load
from ...microfacet.albedo import directional_albedo
from ...microfacet.fresnel import Dielectric, conductor
from ...microfacet.ggx import lift, normal_in_sphere_space, to_sphere
from ...microfacet.numerics import clamp
from ...microfacet.quadrature import gauss_legendre
from ...microfacet.tables import Made
from ...parameters import BSDF, Choice, Colour, Declared, Flag, Ior, Texture, conflict, varies
from . import smith
from .compensation import SPARSEST, LossTable, returned
from .diffuse import lambertian
from .grains import Share, density, exposure, sample_visible_normal, visible_fraction
from .microgeometry import ExplicitGrains
from .shadows import Shadows, shadow

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
ONE_BELOW = 1 - 2**-24
ALL_COMPONENTS = 0xFFFFFFFF
METAL = {"material", "eta", "k", "reflectivity", "edge_tint"}
COAT = {"int_ior", "ext_ior"}
ALBEDO = {"diffuse_reflectance", "diffuse_reflectance_2"}


class Grains(NamedTuple):
    """The grains at a surface point."""

    tau_0: Any
    r: Any  # density in sphere space
    beta_x: Any
    beta_y: Any

    def to_sphere(self, w):
        """A direction in sphere space."""
        return to_sphere(w, self.beta_x, self.beta_y)

    def lift(self, w):
        """A direction kept off the horizon; those from below are meaningless then, and masked by the caller."""
        return lift(w, self.beta_x, self.beta_y)

    def visible(self, w):
        """Visible fraction tau_i along ``w``, kept off zero for those who divide by it."""
        return dr.maximum(visible_fraction(self.r, self.to_sphere(w)), TINY)


class Lobe(NamedTuple):
    """One of the grains' own lobes; the arguments of its functions begin with (model, si, active, grains, wi).

    Functions, not bound methods: a model must not refer to itself. Python's collector would free it at any moment, and
    Mitsuba crashes if that is while it traces a call to all BSDFs there are.
    """

    flags: int
    weigh: Callable  # () -> share of the incident light, by which `sample` chooses
    evaluate: Callable  # (wo) -> (f cos_o, density of draw)
    draw: Callable  # (one number, a pair of numbers) -> wo


class Micrograin(Declared):
    """Half-ellipsoidal opaque grains, Poisson-distributed over a base of any BSDF.

    Grains are metal (the default), diffuse (``specular: false``), or diffuse under a dielectric coat (as soon as
    ``diffuse_reflectance`` or an index of refraction is given). For single scattering the model is exact for its
    geometry, with ``masking: correlated`` and without a coat, whose inner reflections are neglected.
    """

    citation = CITATION

    tau_0 = Texture("filling factor: share of the base that grains cover, seen from above", 0.3, high=1, steep=True)
    beta = Texture(
        "height of the grains over their radius: small is flat and shiny, large is rough", 1.0, low=1e-4, high=100
    )
    beta_x = Texture("beta along x, instead of beta", None, low=1e-4, high=100)
    beta_y = Texture("beta along y, instead of beta", None, low=1e-4, high=100)
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
    scattering = Choice(
        "multiple returns what single scattering loses; beta is constant then", options=("single", "multiple")
    )
    base = BSDF("what the grains lie on; black if none")

    @classmethod
    def microgeometry(cls, description: dict[str, Any]) -> ExplicitGrains:
        """The explicit grains that a scene's description of this BSDF stands for."""
        load(description)  # complains of what is wrong with it
        return ExplicitGrains.of(cls.defaults() | description, set(description))

    def configure(self, given: set[str]) -> None:
        """Settle what the grains are made of, and their axes; forget what is not used."""
        metal, metal_2 = METAL & given, {name + "_2" for name in METAL} & given
        conflict({"beta"} & given, {"beta_x", "beta_y"} & given)
        conflict(metal | metal_2, (COAT | ALBEDO) & given, "grains are metal, or diffuse, perhaps under a coat")
        if not self.specular:
            conflict({"specular"}, metal | metal_2 | COAT & given, "specular: false makes Lambertian grains")
        self.isotropic = not {"beta_x", "beta_y"} & given
        self.coated = self.specular and bool((COAT | ALBEDO) & given)
        self.diffuse = self.coated or not self.specular
        self.axes = ["beta" if getattr(self, name) is None else name for name in ("beta_x", "beta_y")]

        second = self.diffuse_reflectance_2 if self.diffuse else self.metal_2
        if self.variation != "none" and second is None:
            needed = "diffuse_reflectance_2" if self.diffuse else "material_2, or eta_2 and k_2, or reflectivity_2"
            raise ParameterError(f"variation = {self.variation!r}: needs a second colour, {needed}.")
        if self.variation != "none" and not self.diffuse and (self.metal.mirror or self.metal_2.mirror):
            raise ParameterError(f'variation = {self.variation!r}: needs two metals; material "none" has no index.')
        if self.variation == "none" and (
            unused := sorted((metal_2 | {"diffuse_reflectance_2", "variation_azimuth"}) & given)
        ):
            raise ParameterError(f'{unused[0]}: needs variation = "height" or "normal".')
        if self.masking == "smith" and (self.scattering != "single" or self.variation != "none"):
            raise ParameterError('masking = "smith": its grains scatter once and have no height; leave out the rest.')

        unused = [] if self.diffuse else ["diffuse_reflectance", "diffuse_reflectance_2"]
        unused += ["metal", "metal_2"] if self.diffuse else []
        unused += [] if self.coated else ["int_ior", "ext_ior"]
        unused += [] if self.variation == "normal" else ["variation_azimuth"]
        unused += [name for name in ("beta", "beta_x", "beta_y") if name not in self.axes]
        for name in unused:
            setattr(self, name, None)
        self.lobes = self._lobes()
        self.losses = Made()

    def _lobes(self) -> list[Lobe]:
        front = mi.BSDFFlags.FrontSide | (0 if self.isotropic else mi.BSDFFlags.Anisotropic)
        glossy, diffuse = (
            int(flag | front) for flag in (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.DiffuseReflection)
        )
        cls = type(self)
        lobes = []
        if self.specular:
            lobes += [Lobe(glossy, cls._weigh_specular, cls._specular, cls._draw_specular)]
        if self.diffuse:
            lobes += [Lobe(diffuse, cls._weigh_diffuse, cls._diffuse, cls._draw_diffuse)]
        if self.scattering == "multiple":
            lobes += [Lobe(diffuse, cls._weigh_multiple, cls._multiple, cls._draw_multiple)]
        return lobes

    def components(self) -> list[int]:
        """Flags of the grains' lobes and then of the base's."""
        base = [] if self.base is None else [self.base.flags(n) for n in range(self.base.component_count())]
        return [lobe.flags for lobe in self.lobes] + base

    def update(self) -> None:
        """Bring up to date what is made from the parameters."""
        if self.scattering == "multiple":
            shaded = Shadows.union if self.masking == "correlated" else Shadows.sum
            beta = [self._constant(getattr(self, name)) for name in dict.fromkeys(self.axes)]
            self.losses.update(partial(LossTable.made, self.diffuse, shaded), *beta)

    def eval_pdf(self, ctx, si, wo, active):
        """(f |cos_o|, solid-angle density of `sample`): the sum of the lobes (Lucas 2024, Eq. 20)."""
        grains, chances, base_chance = self._choose(ctx, si, active)
        above = active & (si.wi.z > 0) & (wo.z > 0)
        wi, lifted = grains.lift(si.wi), grains.lift(wo)
        value, pdf = mi.UnpolarizedSpectrum(0), mi.Float(0)
        for n, chance in chances.items():
            lobe_value, lobe_pdf = self.lobes[n].evaluate(self, si, active, grains, wi, lifted)
            value, pdf = value + lobe_value, pdf + chance * lobe_pdf
        value, pdf = dr.select(above, value * (wo.z / lifted.z), 0), dr.select(above, pdf, 0)
        if base_chance is not None:
            base_value, base_pdf = self.base.eval_pdf(self._base_context(ctx), si, wo, active)
            value = value + self._pores(si.wi, wo, grains) * mi.unpolarized_spectrum(base_value)
            pdf = pdf + base_chance * base_pdf
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def sample(self, ctx, si, sample1, sample2, active):
        """Choose a lobe by how much of it is seen, draw from it, and weight all lobes by the density of all.

        Directions and densities carry no gradient: derivatives are those of the value at a fixed direction.
        """
        grains, chances, base_chance = self._choose(ctx, si, active)
        wi, bs, start = grains.lift(si.wi), dr.zeros(mi.BSDFSample3f), mi.Float(0)
        bs.eta = 1
        for n, chance in chances.items():
            chosen = sample1 >= start
            wo = self.lobes[n].draw(self, si, active, grains, wi, _rescale(sample1, start, chance), sample2)
            bs.wo = dr.select(chosen, wo, bs.wo)
            bs.sampled_component = dr.select(chosen, mi.UInt32(n), bs.sampled_component)
            bs.sampled_type = dr.select(chosen, mi.UInt32(self.lobes[n].flags), bs.sampled_type)
            start = start + chance
        bs.wo = dr.detach(bs.wo)
        if base_chance is None:
            value, pdf = self.eval_pdf(ctx, si, bs.wo, active)
            bs.pdf = dr.detach(pdf)
            return bs, value / dr.maximum(bs.pdf, TINY) & (bs.pdf > 0)

        on_base = active & (sample1 >= start)
        u = _rescale(sample1, start, base_chance)
        base, base_weight = self.base.sample(self._base_context(ctx), si, u, sample2, on_base)
        base.sampled_component += len(self.lobes)
        bs = dr.detach(dr.select(on_base, base, bs))
        base_chance = dr.detach(base_chance)
        # The grains' lobes end at the horizon, where a transmitting base may well have a density.
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active & (on_base | (bs.wo.z > 0)))
        # Mitsuba's samplers reject by a weight of zero and leave the rest as it was. A black base is not a rejection.
        there, there_pdf = self.base.eval_pdf(self._base_context(ctx), si, bs.wo, on_base)
        stale = dr.any(mi.unpolarized_spectrum(there) > 0) | (dr.abs(there_pdf - bs.pdf) > 0.01 * bs.pdf)
        rejected = on_base & dr.all(mi.unpolarized_spectrum(base_weight) == 0) & stale
        pdf = dr.detach(dr.select(rejected, 0, pdf))
        weight = value / dr.maximum(pdf, TINY) & (pdf > 0)
        # A mirror, clear glass, or a hole in the base: no other lobe reaches its direction, and eval_pdf is zero there.
        delta = on_base & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        single = (
            mi.unpolarized_spectrum(base_weight) * self._pores(si.wi, bs.wo, grains) / dr.maximum(base_chance, TINY)
        )
        bs.pdf = dr.select(delta, bs.pdf * base_chance, pdf)
        return bs, dr.select(delta, single, weight) & active

    def _choose(self, ctx, si, active) -> tuple[Grains, dict[int, Any], Any]:
        """The grains here, the chance of each enabled lobe of theirs, and that of the base (None if not wanted)."""
        tau_0 = self.number("tau_0", si, active)
        beta_x, beta_y = (self.number(name, si, active) for name in self.axes)
        grains = Grains(tau_0, density(tau_0), beta_x, beta_y)
        wi, above = grains.lift(si.wi), si.wi.z > 0
        shares = {
            n: dr.select(above, lobe.weigh(self, si, active, grains, wi), 0)
            for n, lobe in enumerate(self.lobes)
            if ctx.is_enabled(mi.BSDFFlags(lobe.flags & int(mi.BSDFFlags.Smooth)), n)
        }
        if self.base is None and len(shares) == 1:
            return grains, dict.fromkeys(shares, 1), None
        # Exact visibility: Lucas 2024, Eq. 26 gives the pores too much.
        base = None if self._base_context(ctx) is None else dr.select(above, 1 - grains.visible(wi), 1)
        scale = dr.rcp(dr.maximum(sum(shares.values()) + (0 if base is None else base), TINY))
        return grains, {n: share * scale for n, share in shares.items()}, None if base is None else base * scale

    def _base_context(self, ctx):
        """The context as the base counts components, or None if the base is not there or not wanted."""
        if self.base is None or ctx.component == ALL_COMPONENTS:
            return ctx if self.base is not None else None
        component = ctx.component - len(self.lobes)
        return mi.BSDFContext(ctx.mode, ctx.type_mask, component) if component >= 0 else None

    def _pores(self, wi, wo, grains: Grains):
        """Share of the base that both directions reach, V_p (Lucas 2024, Eq. 23).

        Beyond the paper, below the surface: nothing casts shadows there, but light meets the base through pores only,
        from either side. What arrives from below under a grain is absorbed, total internal reflection included.
        """
        i, o = (grains.to_sphere(grains.lift(w)) for w in (wi, wo))
        if self.masking == "smith":
            both = smith.pore_weight(grains.r, i, o)
        else:
            both = exposure(grains.r, 0, self._shaded(Shadows(i, o), 0))
        one = exposure(grains.r, 0, dr.select(wi.z > 0, shadow(i, 0), 0) + dr.select(wo.z > 0, shadow(o, 0), 0))
        return dr.select((wi.z > 0) & (wo.z > 0), both, one)

    def _shaded(self, shadows: Shadows, h):
        """Area in shadow at height ``h`` by the choice of masking: Lucas 2024, Eq. 17 or 18."""
        return shadows.union(h) if self.masking == "correlated" else shadows.sum(h)

    def _weigh_specular(self, si, active, grains, wi):
        return grains.visible(wi) * (1 - self._diffuse_part(si, active, wi))

    def _draw_specular(self, si, active, grains, wi, u, sample2):
        return mi.reflect(wi, self._visible_normal(grains, wi, sample2))

    def _specular(self, si, active, grains: Grains, wi, wo):
        """tau_0 D G F / (4 cos_i) (Lucas 2024, Eq. 22), by exact visible normals.

        NDF and GAF share an exponential: tau_0 D G = pi r D_ggx exp(-r (pi (1 - h'^2) + U)) by Eq. 12 and 19, where U
        is the area in shadow on the plane at height h'. With the shadow along i alone, G becomes G1: the density.
        """
        m = dr.normalize(wi + wo)
        h, d_ggx = normal_in_sphere_space(m, grains.beta_x, grains.beta_y)
        i, o = grains.to_sphere(wi), grains.to_sphere(wo)
        fresnel = self._fresnel(si, active, dr.dot(wi, m), h, m)
        reflected = dr.pi * grains.r * d_ggx / (4 * wi.z)
        if self.masking == "smith":
            value = reflected * exposure(grains.r, h, 0) * smith.masking_shadowing(grains.r, i, o)
            return fresnel * value, d_ggx * smith.visible_masking(i) / (4 * wi.z)
        value = reflected * exposure(grains.r, h, self._shaded(Shadows(i, o), h))
        return fresnel * value, reflected * exposure(grains.r, h, shadow(i, h)) / grains.visible(wi)

    def _weigh_diffuse(self, si, active, grains, wi):
        return grains.visible(wi) * self._diffuse_part(si, active, wi)

    def _draw_diffuse(self, si, active, grains, wi, u, sample2):
        """A cosine lobe about a visible normal; Smith's (2023) grains are flat instead.

        Mitsuba hands out three numbers where this takes four: the coarse and the fine part of one of them serve as two.
        """
        if self.masking == "smith":
            return mi.warp.square_to_cosine_hemisphere(sample2)
        coarse = dr.floor(u * 2048)
        cosine = mi.warp.square_to_cosine_hemisphere(mi.Point2f((coarse + 0.5) / 2048, u * 2048 - coarse))
        return mi.Frame3f(self._visible_normal(grains, wi, sample2)).to_world(cosine)

    def _diffuse(self, si, active, grains: Grains, wi, wo):
        """tau_0 f_d cos_o (Lucas 2024, Eq. 21), by cosine lobes about visible normals."""
        coat = self._coat(si, active) if self.coated else None
        albedo = self.diffuse_reflectance.eval(si, active)
        if self.masking == "smith":
            through = (1 - coat(wi.z)) * (1 - coat(wo.z)) if coat else 1
            cosine = wo.z / dr.pi
            return albedo * smith.grain_weight(
                grains.r, grains.to_sphere(wi), grains.to_sphere(wo)
            ) * through * cosine, cosine
        first, second, pdf = lambertian(
            *grains[1:],
            wi,
            wo,
            self._shaded,
            closed=self.isotropic and coat is None and self.variation != "normal",
            share=self._share(si, active),
            coat=coat,
        )
        value = albedo * first
        if self.variation != "none":
            value = value + self.diffuse_reflectance_2.eval(si, active) * second
        return value, pdf / grains.visible(wi)

    def _weigh_multiple(self, si, active, grains, wi):
        return sum(self.losses.result.along(grains.tau_0, grains.to_sphere(wi)))

    def _draw_multiple(self, si, active, grains, wi, u, sample2):
        return mi.warp.square_to_cosine_hemisphere(sample2)

    def _multiple(self, si, active, grains: Grains, wi, wo):
        """Light that single scattering loses (`compensation`), by cosine."""
        # Few grains do not pass light to each other: what they return is proportional to their number.
        tau_0 = dr.maximum(grains.tau_0, SPARSEST)
        losses = self.losses.result
        lost_i, lost_o = (losses.along(tau_0, grains.to_sphere(w)) for w in (wi, wo))
        base = mi.UnpolarizedSpectrum(0)
        if self.base is not None:
            base = clamp(self._base_albedo(si, active), 0, 1)
        value = returned(tau_0, losses.at(tau_0), lost_i, lost_o, self._mean_albedo(si, active), base)
        return value * (wo.z * grains.tau_0 / tau_0), wo.z / dr.pi

    def _visible_normal(self, grains: Grains, wi, sample2):
        i = grains.to_sphere(wi)
        if self.masking == "smith":
            m = smith.sample_visible_normal(i, sample2.x, sample2.y)
        else:
            m = sample_visible_normal(grains.r, i, sample2.x, sample2.y)
        return dr.normalize(mi.Normal3f(grains.beta_x * m.x, grains.beta_y * m.y, m.z))

    def _diffuse_part(self, si, active, wi):
        """Probability of the diffuse lobe among the grains' (Lucas 2024, Eq. 27)."""
        if not self.coated:
            return 0 if self.specular else 1
        albedo = dr.mean(self._diffuse_albedo(si, active))
        return albedo / dr.maximum(albedo + self._coat(si, active)(wi.z), TINY)

    def _diffuse_albedo(self, si, active):
        """Mean of the two albedos, or the only one."""
        albedo = self.diffuse_reflectance.eval(si, active)
        return albedo if self.variation == "none" else (albedo + self.diffuse_reflectance_2.eval(si, active)) / 2

    def _share(self, si, active):
        """The second colour's share at a point of the grain, or None."""
        if self.variation == "normal":
            sin, cos = dr.sincos(dr.deg2rad(self.number("variation_azimuth", si, active)))
            return Share(cos, sin)
        return Share() if self.variation == "height" else None

    def _coat(self, si, active):
        """The grains' dielectric coat: from the local cosine to its reflectance."""
        return Dielectric(self.number("int_ior", si, active) / self.number("ext_ior", si, active))

    def _mean_albedo(self, si, active):
        """Hemispherical mean of what a facet of the grain reflects, at half height and upright."""
        mean = mi.UnpolarizedSpectrum(0)
        if self.specular:
            for cos, weight in zip(*gauss_legendre(4)):
                mean = mean + 2 * cos * weight * self._fresnel(si, active, mi.Float(cos), 0.5, mi.Vector3f(0, 0, 1))
        if self.diffuse:
            mean = mean + dr.square(1 - mean) * self._diffuse_albedo(si, active)
        return mean

    def _base_albedo(self, si, active):
        """Albedo at normal incidence: Mitsuba's diffuse reflectance where that is right. The same for i and o."""
        upright = mi.SurfaceInteraction3f(si)
        upright.wi = mi.Vector3f(0, 0, 1)
        beyond_diffuse = int(mi.BSDFFlags.Glossy | mi.BSDFFlags.Delta | mi.BSDFFlags.Transmission)
        if not self.base.flags() & beyond_diffuse:
            return mi.unpolarized_spectrum(self.base.eval_diffuse_reflectance(upright, active))

        def reflected(ctx, si, sample1, sample2, active):
            bs, weight = self.base.sample(ctx, si, sample1, sample2, active)
            return bs, mi.unpolarized_spectrum(weight) & (bs.wo.z > 0)

        return directional_albedo(reflected, upright, active, 16, copies=True)

    def _constant(self, beta: Any) -> Any:
        if varies(beta):
            raise ParameterError('beta: a texture, which scattering = "multiple" does not allow; tau_0 may be one.')
        return beta.mean()

    def _fresnel(self, si, active, cos, h, m):
        """Reflectance of the grain at height ``h`` with normal ``m``."""
        if self.coated:
            return mi.UnpolarizedSpectrum(self._coat(si, active)(cos))
        if self.metal.mirror and self.variation == "none":
            return mi.UnpolarizedSpectrum(1)
        eta, k = self.metal.eval(si, active)
        if self.variation != "none":
            share = self._share(si, active)(h, m)
            eta_2, k_2 = self.metal_2.eval(si, active)
            eta, k = dr.lerp(eta, eta_2, share), dr.lerp(k, k_2, share)
        return conductor(cos, eta, k)


def _rescale(u, start, chance):
    """Stretch what is left of a random number after a choice to [0, 1)."""
    return dr.clip((u - start) / dr.maximum(chance, TINY), 0, ONE_BELOW)
