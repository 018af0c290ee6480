"""The BSDF of facets that also diffract (Holzschuch and Pacanowski 2017): parameters, and its two lobes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from ...conductors import Conductor
from ...errors import ParameterError
from ...lobes import Lifted, Lobe, LobeModel, glossy
from ...microfacet.distributions import EPD
from ...microfacet.tables import Made
from ...parameters import Choice, Constant, ConstantAxes, Parameter, Texture, Usual, constant
from .lobes import MASKING, Diffracted, Mirrored, Surface, lift
from .tables import Bands, Known

CITATION = """\
@article{Holzschuch2017TwoScale,
  author  = {Holzschuch, Nicolas and Pacanowski, Romain},
  title   = {A Two-Scale Microfacet Reflectance Model Combining Reflection and Diffraction},
  journal = {ACM Transactions on Graphics},
  volume  = {36},
  number  = {4},
  pages   = {66},
  year    = {2017},
  doi     = {10.1145/3072959.3073621}
}"""
STRETCH = 5
"""Ratio of both roughnesses up to which the table of the convolution is good, to 1.1 % (99 % of all)."""


@dataclass(frozen=True)
class Wavelengths(Parameter):
    """Three wavelengths in micrometres."""

    low: float = 0.1
    high: float = 20.0
    kind: ClassVar[str] = "three numbers"
    unit: ClassVar[str] = "µm"

    def allowed(self) -> str:
        """The range as an interval."""
        return f"[{self.low:g}, {self.high:g}]"

    def parse(self, props: mi.Properties) -> tuple[float, ...]:
        """The numbers, each within the range."""
        given, expected = props.get(self.name, self.default), f"expected three numbers in {self.allowed()} µm"
        try:
            red, green, blue = (round(float(one), 7) for one in given)  # which Mitsuba made float32
        except (TypeError, ValueError) as error:
            raise ParameterError(f"{self.name} = {given!r}: {expected}.") from error
        for one in (red, green, blue):
            if not self.low <= one <= self.high:
                nanometres = f"; {one:g} nm are {one / 1e3:g} µm" if self.low <= one / 1e3 <= self.high else ""
                raise ParameterError(f"{self.name} = {one:g} µm: {expected}{nanometres}.")
        return red, green, blue


class TwoScale(LobeModel):
    """Metal of facets with a finer roughness, below the wavelength, that diffracts light around the mirror direction.

    Polished, brushed or coated metals, and in a blend the coat of a plastic, whose highlights have a bright core and a
    wide, coloured haze. The finer roughness has the rms height sigma_s and a power spectrum of the correlation length b
    and the exponent c; facets follow the exponential power distribution, which is Beckmann's if p = 1. In spectral
    variants every wavelength is diffracted as it should.
    """

    citation = CITATION

    metal = Conductor("metal", "none")
    alpha = ConstantAxes(
        "width of the distribution of facets, which is the roughness if p = 1; never squared",
        0.1,
        low=1e-3,
        high=1.0,
        usually=Usual(0.01, 0.3, logarithmic=True),
    )
    p = Constant(
        "exponent of the distribution of facets: 1 is Beckmann's, less has longer tails",
        0.7,
        low=0.2,
        high=5.0,
        usually=Usual(0.3, 1.5, logarithmic=True),
    )
    sigma_s = Texture(
        "rms height of the finer roughness",
        0.02,
        high=10.0,
        unit="µm",
        usually=Usual(0.005, 0.08, logarithmic=True),
    )
    b = Constant(
        "correlation length of the finer roughness",
        1.2,
        low=0.02,
        high=30.0,
        unit="µm",
        usually=Usual(0.3, 5, logarithmic=True),
    )
    c = Constant("exponent of its power spectrum, above 1", 2.3, low=1.02, high=5.0, usually=Usual(1.5, 3))
    wavelengths = Wavelengths("of the colours in RGB; the second one in mono", (0.653, 0.546, 0.444))
    masking = Choice("how Smith's masking of both directions is correlated", options=tuple(MASKING))
    energy = Choice("what is mirrored: as published, or what is not diffracted", options=("published", "conserving"))

    def configure(self, given: set[str]) -> None:
        """Settle the wavelengths."""
        self.bands, self.known = Bands.of(self.wavelengths), Made()

    def update(self) -> None:
        """Make the tables."""
        numbers = [self.at(name, None, True) for name in ("p", "b", "c")]
        alphas = [type(self).alpha.clamp(constant(*item)) for item in self.alpha.textures.items()]
        self._warn_of_stretch(alphas)
        self.known.update(partial(Known.made, self.bands, self.energy == "conserving"), *numbers, *alphas)

    @staticmethod
    def _warn_of_stretch(alphas: list[Any]) -> None:
        least, most = (f([float(np.asarray(dr.detach(alpha)).item()) for alpha in alphas]) for f in (min, max))
        if most > STRETCH * least * 1.001:
            ratio = f"alpha_u : alpha_v = {most / least:.3g} : 1"
            warnings.warn(f"{ratio}: beyond {STRETCH} : 1 the haze is off by factors in places.", stacklevel=3)

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Heights from a nanometre on: of what grows with their square, no derivative at 0 sees that it would."""
        return super().ranges() | {"sigma_s": (1e-3, type(self).sigma_s.high)}

    def flags(self) -> list[int]:
        """Two glossy lobes."""
        return [glossy(self.alpha.isotropic)] * 2

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """What is mirrored, and what is diffracted."""
        known = self.known.result
        sigma, b, c = (self.at(name, si, active) for name in ("sigma_s", "b", "c"))
        along_x, along_y = self.at("alpha", si, active)
        facets = EPD(along_x, along_y, known.power)
        surface = Surface(facets, self.masking, sigma, b, c, self.bands.at(si), known)
        fresnel = self.at("metal", si, active)
        return [Lifted(lobe, lift) for lobe in (Mirrored(surface, fresnel), Diffracted(surface, fresnel))]
