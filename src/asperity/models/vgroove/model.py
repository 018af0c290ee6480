"""The V-groove BSDF (Lee et al. 2018): parameters, and the lobe of its grooves."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...conductors import Conductor
from ...errors import ParameterError
from ...lobes import Lobe, LobeModel, glossy
from ...microfacet.distributions import DISTRIBUTIONS, Distribution
from ...microfacet.numerics import clamp
from ...microfacet.sampling import direction, more_numbers
from ...microfacet.tables import Made, tables_work
from ...parameters import Axes, Choice, Flag, Integer, Texture, Usual, conflict, numbers, settled
from .bounces import MOST, needed_bounces, needed_bounces_nonsymmetric
from .fresnel import Reflectance, fit, fit_constant
from .kaleidoscope import Pair, polar, symmetric_way
from .microgeometry import ExplicitGrooves
from .nonsymmetric import nonsymmetric, nonsymmetric_way
from .symmetric import WRITTEN, symmetric
from .table import ROUGHEST as TABULATED
from .table import Tabulated
from .terms import ROUGHEST, by_terms
from .tilts import Tilts

CITATION = """\
@article{Lee2018Practical,
  author  = {Lee, Joo Ho and Jarabo, Adrian and Jeon, Daniel S. and Gutierrez, Diego and Kim, Min H.},
  title   = {Practical Multiple Scattering for Rough Surfaces},
  journal = {ACM Transactions on Graphics},
  volume  = {37},
  number  = {6},
  pages   = {275},
  year    = {2018},
  doi     = {10.1145/3272127.3275016}
}"""
SMOOTHEST = 1e-3


class VGroove(LobeModel):
    """Metal whose microfacets pair up to V-shaped grooves, in which light is reflected as often as it takes.

    Without noise, and exact for its geometry but for some .1 %, 1 % at worst. Facets of equal tilt (``symmetric``,
    fast) leave a sharp glint in the mirror direction, whatever the roughness; facets of independent tilts soften it, by
    a table, or by quadrature.
    """

    citation = CITATION
    geometry = ExplicitGrooves

    distribution = Choice("distribution of the facets' normals", options=tuple(DISTRIBUTIONS))
    alpha = Axes(
        "roughness, never squared; at most 1 for Phong",
        0.3,
        low=SMOOTHEST,
        high=1e3,
        usually=Usual(0.02, 1, logarithmic=True),
    )
    exponent = Texture(
        "Phong's exponent, instead of alpha: 2 / alpha² - 2",
        None,
        high=1e6,
        usually=Usual(1, 1e4, logarithmic=True),
        when=("distribution", "phong"),
    )
    metal = Conductor("metal of the facets", "none")
    symmetric = Flag("whether both facets of a groove have the same tilt, or independent ones", True)
    max_bounces = Integer("more often bounced light is lost; by default 0.1 % of it, or less", None, low=1, high=MOST)

    def configure(self, given: set[str]) -> None:
        """Settle which of the roughnesses is used."""
        conflict({"alpha", "alpha_u", "alpha_v"} & given, {"exponent"} & given)
        self.isotropic, self.fits, self.table = self.alpha.isotropic, Made(), Made()
        if "exponent" in given:
            self.alpha = None
        self.check()

    def check(self) -> None:
        """Ranges, and Phong's own."""
        super().check()
        for name, alpha in type(self).alpha.children(self.alpha).items():
            high = max((shown.max() for _, shown in numbers(alpha)), default=0)
            if high > self.kind.largest:
                raise ParameterError(
                    f"{name} = {high:g}: expected a number or texture in [{SMOOTHEST:g}, 1] for Phong."
                )

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Phong's roughness ends at 1."""
        found, largest = super().ranges(), self.kind.largest
        return found | {name: (low, min(high, largest)) for name, (low, high) in found.items() if "alpha" in name}

    @property
    def kind(self) -> type[Distribution]:
        """The distribution of normals."""
        return DISTRIBUTIONS[self.distribution]

    def update(self) -> None:
        """Bring up to date what is made from the parameters."""
        needed, alpha = needed_bounces if self.symmetric else needed_bounces_nonsymmetric, self._roughest()
        if dr.flag(dr.JitFlag.FreezingScope):
            alpha = None  # what is recorded has to be right for other numbers, too
        most = self.max_bounces or (MOST if alpha is None else needed(self.kind, alpha))
        if alpha is not None and not self.max_bounces and most == MOST:
            lost = f"alpha = {alpha:g}: more than 0.1 % of the light bounces over {MOST} times, and is lost."
            warnings.warn(lost, stacklevel=2)
        self.most = dr.opaque(mi.UInt32, most) if dr.is_jit_v(mi.Float) else most
        self.few = min(most, WRITTEN + 1)
        self.rough = alpha is None or alpha > ROUGHEST
        # Of a model, dr.freeze sees the arrays alone: as many of them as there are forms of the sum tell these apart.
        self.form = [self.most] * (WRITTEN + 2 if self.rough else self.few)
        self.metal.remake(self.fits, fit_constant)
        self._tabulate(most)

    def flags(self) -> list[int]:
        """One glossy lobe."""
        return [glossy(self.isotropic)]

    def lobes(self, si: Any, active: Any) -> list[Lobe]:
        """All numbers of bounces."""
        reflectance = None
        if not self.metal.mirror:
            once = self.at("metal", si, active)
            known = None if dr.grad_enabled(once) else self.fits.result
            reflectance = Reflectance(once, *(known or (fit(once), None)))
        distribution = self.kind(*self._alphas(si, active))
        differentiated = dr.grad_enabled(distribution) or dr.grad_enabled(reflectance)
        brdf = nonsymmetric if self.table.result is None or differentiated else self.table.result
        if self.symmetric:
            brdf = by_terms if self.rough else partial(symmetric, few=self.few)
        return [GrooveLobe(distribution, brdf, self.symmetric, self.most, reflectance)]

    def _alphas(self, si: Any, active: Any) -> tuple[Any, Any]:
        if self.alpha is None:
            alpha = dr.sqrt(2 / (self.at("exponent", si, active) + 2))
            return alpha, alpha
        if self.isotropic:
            alpha = clamp(self.at("alpha", si, active)[0], SMOOTHEST, self.kind.largest)
            return alpha, alpha
        u, v = (clamp(alpha, SMOOTHEST, self.kind.largest) for alpha in self.at("alpha", si, active))
        return u, v

    def _roughest(self) -> float | None:
        """Largest roughness, of the numbers that Mitsuba shows of a texture; None if it shows none."""
        textures = [self.exponent] if self.alpha is None else self.alpha.textures.values()
        shown = [[found.ravel() for _, found in numbers(texture, differentiated=True)] for texture in textures]
        if not all(shown):
            return None
        alphas = np.concatenate([part for parts in shown for part in parts])
        if self.alpha is None:
            alphas = np.sqrt(2 / (np.maximum(alphas, 0) + 2))
        return float(np.clip(alphas.max(), SMOOTHEST, min(type(self).alpha.high, self.kind.largest)))

    def _tabulate(self, most: int) -> None:
        """Make the table, anew if something changed, where there is one: else quadrature takes its place."""
        roughness = self.exponent if self.alpha is None else self.alpha.textures.get("alpha")
        constant = roughness is not None and settled(roughness) and (self.metal.mirror or self.fits.result is not None)
        alpha = self._roughest() if constant and tables_work() and not self.symmetric else None
        if alpha is None or alpha > TABULATED:
            self.table.clear()
            return
        logarithm, _ = self.fits.result or (None, None)
        constants = alpha, most, *(self.fits.constants or ())
        self.table.update(lambda *_: Tabulated.of(self.kind, alpha, most, logarithm), *constants)


@dataclass
class GrooveLobe(Lobe):
    """The lobe of grooves: all ways through them, however many bounces that takes."""

    distribution: Distribution
    brdf: Callable  # (pair, cos_i, tilts, most, reflectance) -> (f cos_o, the same of mirrors)
    symmetric: bool
    most: Any  # bounces that are followed
    reflectance: Reflectance | None  # None is a mirror

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """(f cos_o, density), which is the same for mirrors."""
        pair = Pair.of(wi, wo)
        tilts = Tilts.along(self.distribution, pair.cos_azimuth, pair.sin_azimuth)
        return self.brdf(pair, wi.z, tilts, self.most, self.reflectance)

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """Where a ray goes that meets a groove by chance; nowhere above, if it bounces too often, and is lost."""
        wo, k = self.follow(wi, u, v)
        return type(wo)(wo.x, wo.y, dr.select(k <= self.most, wo.z, -1))

    def follow(self, wi: Any, u: Any, v: Any) -> tuple[Any, Any]:
        """(direction, number of bounces) of a ray that enters a groove anywhere.

        Grooves are met by their ground area, since all rims are at one height (Heitz and d'Eon 2014, for one bounce).
        """
        x, y = self.distribution.sample_azimuth(v.y)
        tilts = Tilts.along(self.distribution, x, y)
        tilt = tilts.sample(v.x)
        sin_psi, cos_psi, length = polar(wi.x * x + wi.y * y, wi.z)
        if self.symmetric:
            swap, k, (sin, cos) = symmetric_way((sin_psi, cos_psi), tilt, u, self.most)
        else:
            partner = tilts.sample_partner(*more_numbers(u, v.x, v.y))
            swap, k, (sin, cos) = nonsymmetric_way((sin_psi, cos_psi), tilt, partner, u, self.most)
        x, y = dr.select(swap, -x, x), dr.select(swap, -y, y)
        along = wi.y * x - wi.x * y  # across the plane of the kaleidoscope; turns round
        return direction(length * sin * x + along * y, length * sin * y - along * x, length * cos), k
