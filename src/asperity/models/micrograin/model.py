"""The micrograin BSDF (Lucas et al. 2024, Eq. 20): parameters, and what lobes it is the sum of."""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr

from ...conductors import Conductor
from ...errors import ParameterError
from ...lobes import Lifted, Lobe, LobeModel, Opening, diffuse, glossy
from ...microfacet.albedo import upright_albedo
from ...microfacet.tables import Made
from ...parameters import BSDF, Axes, Choice, Colour, Flag, Ior, Texture, Usual, conflict, constant, varies
from .coat import FITTED, Coat, fit
from .compensation import LossTable, Returned
from .diffuse import Lambertian
from .grains import Grains, SecondColour
from .material import Material
from .microgeometry import ExplicitGrains
from .pores import Pores
from .shadows import Shadows
from .smith import SmithLambertian, SmithPores, SmithSpecular
from .specular import Specular

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
METAL = {name + suffix for name in ("material", "eta", "k", "reflectivity", "edge_tint") for suffix in ("", "_2")}
COAT = {"int_ior", "ext_ior"}
ALBEDO = {"diffuse_reflectance", "diffuse_reflectance_2"}
SHADED = {"correlated": Shadows.union, "height": Shadows.sum}
"""Area in shadow by the choice of masking."""


class Micrograin(LobeModel):
    """Half-ellipsoidal opaque grains, Poisson-distributed over a base of any BSDF.

    Grains are metal (the default), diffuse (``specular: false``), or diffuse under a dielectric coat (as soon as
    ``diffuse_reflectance`` or an index of refraction is given). For single scattering the model is exact for its
    geometry, with ``masking: correlated`` and without a coat, whose inner reflections are neglected.
    """

    citation = CITATION
    geometry = ExplicitGrains

    tau_0 = Texture("filling factor: share of the base that grains cover, seen from above", 0.3, high=1, steep=True)
    beta = Axes(
        "height of the grains over their radius: small is flat and shiny, large is rough",
        1.0,
        low=1e-4,
        high=100,
        suffixes=("_x", "_y"),
        usually=Usual(0.02, 5, logarithmic=True),
    )
    metal = Conductor("metal of the grains", "none", when=("grains", "metal"))
    specular = Flag("whether the grains reflect at their surface; false makes them Lambertian", True)
    diffuse_reflectance = Colour("albedo of diffuse or coated grains", 0.5, when=("grains", "coated", "diffuse"))
    int_ior = Ior("index of refraction of the grains' coat", "bk7", when=("grains", "coated"))
    ext_ior = Ior("index of refraction outside", "air", when=("grains", "coated"))
    variation = Choice("what the grains' second colour follows", options=("none", "height", "normal"))
    variation_azimuth = Texture(
        "azimuth of the normals with the second colour",
        0.0,
        low=-360,
        high=360,
        unit="degree",
        usually=Usual(-180, 180),
        when=("variation", "normal"),
    )
    diffuse_reflectance_2 = Colour(
        "second albedo: at the grains' top, or on their side at variation_azimuth",
        when=("variation", "height", "normal"),
    )
    metal_2 = Conductor("second metal of the grains", suffix="_2", when=("variation", "height", "normal"))
    masking = Choice(
        "shadows: by height and direction (Eq. 18), by height only (Eq. 17), or Smith's (2023)",
        options=("correlated", "height", "smith"),
    )
    scattering = Choice(
        "multiple returns what single scattering loses; beta is constant then", options=("single", "multiple")
    )
    base = BSDF("what the grains lie on; black if none")

    def configure(self, given: set[str]) -> None:
        """Settle what the grains are made of."""
        conflict(METAL & given, (COAT | ALBEDO) & given, "grains are metal, or diffuse, perhaps under a coat")
        if not self.specular:
            conflict({"specular"}, (METAL | COAT) & given, "specular: false makes Lambertian grains")
        self.grains = "metal" if self.specular else "diffuse"
        if (COAT | ALBEDO) & given and self.specular:
            self.grains = "coated"
        if self.variation != "none":
            self._check_second_colour()
        if self.masking == "smith" and (self.scattering != "single" or self.variation != "none"):
            raise ParameterError('masking = "smith": its grains scatter once and have no height; leave out the rest.')
        self.losses = Made()

    def _check_second_colour(self) -> None:
        metal = self.grains == "metal"
        if (self.metal_2 if metal else self.diffuse_reflectance_2) is None:
            needed = "material_2, or eta_2 and k_2, or reflectivity_2" if metal else "diffuse_reflectance_2"
            raise ParameterError(f"variation = {self.variation!r}: needs a second colour, {needed}.")
        if metal and (self.metal.mirror or self.metal_2.mirror):
            raise ParameterError(f'variation = {self.variation!r}: needs two metals; material "none" has no index.')

    def update(self) -> None:
        """Bring up to date what is made from parameters: the coat's fit, and the table of losses, from beta."""
        self.coat = self._constant_coat()
        if self.scattering == "multiple":
            make = partial(LossTable.made, self.grains != "metal", SHADED[self.masking])
            why = ': scattering = "multiple" makes a table from it; tau_0 may be a texture'
            self.losses.update(make, *(constant(name, texture, why) for name, texture in self.beta.textures.items()))

    def _constant_coat(self) -> Any:
        """The fit of the coat's transmittance if its index is the same everywhere and has no derivatives, else None."""
        if self.grains != "coated" or varies(self.int_ior) or varies(self.ext_ior):
            return None
        eta = constant("int_ior", self.int_ior) / constant("ext_ior", self.ext_ior)
        if dr.grad_enabled(eta) or dr.flag(dr.JitFlag.FreezingScope):  # replayed for other numbers
            return None
        return fit(eta) if FITTED[0] <= float(dr.slice(eta)) <= FITTED[1] else None

    def flags(self) -> list[int]:
        """A glossy lobe but for diffuse grains, a diffuse one but for metal, and that of ``multiple``."""
        isotropic, multiple = self.beta.isotropic, self.scattering == "multiple"
        lobes = {"metal": [glossy], "coated": [glossy, diffuse], "diffuse": [diffuse]}[self.grains]
        return [kind(isotropic) for kind in lobes + [diffuse] * multiple]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """In the order of `flags`."""
        grains, material, lobes = self._grains(si, active), self._material(si, active), list[Lobe]()
        if self.masking == "smith":
            lobes += [SmithSpecular(grains, material)] if self.specular else []
            lobes += [SmithLambertian(grains, material)] if self.grains != "metal" else []
        else:
            shaded = SHADED[self.masking]
            lobes += [Specular(grains, material, shaded)] if self.specular else []
            lobes += [Lambertian(grains, material, shaded, self.beta.isotropic)] if self.grains != "metal" else []
        if self.scattering == "multiple":
            base = 0 if self.base is None else upright_albedo(self.base, si, active)
            lobes += [Returned(grains, self.losses.result, material.mean_albedo(), base)]
        return [Lifted(lobe, grains.lift) for lobe in lobes]

    def opening(self, si: Any, active: Any) -> Opening:
        """The pores between grains."""
        grains = self._grains(si, active)
        return SmithPores(grains) if self.masking == "smith" else Pores(grains, SHADED[self.masking])

    def _grains(self, si: Any, active: Any) -> Grains:
        return Grains.of(self.at("tau_0", si, active), *self.at("beta", si, active))

    def _material(self, si: Any, active: Any) -> Material:
        def at(name: str) -> Any:
            return None if getattr(self, name) is None else self.at(name, si, active)

        second = None
        if self.variation == "height":
            second = SecondColour()
        if self.variation == "normal":
            sin, cos = dr.sincos(dr.deg2rad(at("variation_azimuth")))
            second = SecondColour(cos, sin)
        coat = None
        if self.grains == "coated":
            eta = at("int_ior") / at("ext_ior")
            coat = Coat(eta, None if dr.grad_enabled(eta) else self.coat)
        return Material(
            at("metal"), at("metal_2"), coat, at("diffuse_reflectance"), at("diffuse_reflectance_2"), second
        )
