"""Cavities one can hit, as the ground truth of the model: V-grooves whose facets are paint under a smooth interface."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...errors import ParameterError
from ...goniophotometer.grooves import Grooves, Shape
from ...goniophotometer.tile import opaque
from ...microfacet.distributions import Gaussian
from ...microfacet.numerics import heading
from .facets import DISTRIBUTIONS

TRIES = 8
"""Of Gaussian normals, whose samples are too steep by a / sin a < pi / 2: after as many rejections, .03 % still are."""


class InterfacedFacet:
    """A facet: a smooth interface of relative index ``eta`` over a body that scatters evenly, of this ``albedo``.

    Light is reflected with probability F, or else leaves evenly and refracted: T_o Q / pi (Meneveaux et al. 2018,
    Eq. 9). Nothing of the model's is used. Mitsuba's ``plastic`` is this if it is ``nonlinear``, but for its fit to the
    inner reflectance, by which it is up to .2 % too bright or too dark to an index of 2, and 4 % too bright at 2.5.
    """

    def __init__(self, albedo: Any, eta: float):
        cos, weight = (np.polynomial.legendre.leggauss(200) + np.array([[1], [0]])) / 2
        # Substituted, since at grazing F changes as the cosine's root where eta is near 1.
        fresnel = np.array(mi.fresnel(mi.Float(np.float32(cos**2)), eta)[0])
        outer = float((4 * cos**3 * fresnel) @ weight)
        inner = 1 - (1 - outer) / eta**2
        albedo = np.broadcast_to(albedo, dr.size_v(mi.UnpolarizedSpectrum))
        self.body = opaque(mi.UnpolarizedSpectrum, *(albedo / (eta**2 * (1 - albedo * inner))))
        self.eta = opaque(mi.Point2f, eta, 0).x

    def flags(self) -> int:
        """A mirror, and a diffuse lobe."""
        return int(mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide)

    def eval(self, ctx: Any, si: Any, wo: mi.Vector3f, active: Any) -> Any:
        """The body, times the cosine."""
        lit = active & (si.wi.z > 0) & (wo.z > 0)
        return self.body * ((1 - self._fresnel(si.wi)) * (1 - self._fresnel(wo)) * wo.z / dr.pi) & lit

    def sample(self, ctx: Any, si: Any, sample1: mi.Float, sample2: mi.Point2f, active: Any) -> tuple[Any, Any]:
        """The interface or the body, by chance."""
        mirrored = sample1 < self._fresnel(si.wi)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = dr.select(mirrored, mi.reflect(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
        return bs, dr.select(mirrored, 1, self.body * (1 - self._fresnel(bs.wo)))

    def _fresnel(self, w: mi.Vector3f) -> mi.Float:
        return mi.fresnel(dr.maximum(w.z, 0), self.eta)[0]


@dataclass(frozen=True)
class ExplicitCavities:
    """V-cavities with a ``distribution`` of normals, their openings side by side in one plane.

    ``albedo`` is the body's, K_d, a number or three; ``eta`` the relative index of the interface over it.
    """

    distribution: str = "beckmann"
    alpha_u: float = 0.3
    alpha_v: float = 0.3
    albedo: float | tuple[float, float, float] = 0.5
    eta: float = 1.5

    def __post_init__(self) -> None:
        for name in ("alpha_u", "alpha_v"):
            _number(name, alpha := getattr(self, name))
            if not alpha > 0:
                raise ParameterError(f"{name} = {alpha!r}: expected a number above 0.")
        values = np.atleast_1d(self.albedo)
        if not (values.dtype.kind in "fi" and values.shape in ((1,), (3,)) and np.all((values >= 0) & (values <= 1))):
            raise ParameterError(f"albedo = {self.albedo!r}: expected one number in [0, 1], or three.")
        if not 1 <= self.eta <= 5:
            raise ParameterError(f"eta = {self.eta:g}: expected a relative index in [1, 5].")

    @classmethod
    def of(cls, model: dict[str, Any], given: set[str]) -> ExplicitCavities:
        """The cavities of an ``interfacedlambertian`` BSDF; of its parameters the scene has ``given`` some itself."""
        if model["masking"] == "smith" and model["scattering"] == "single":
            raise ParameterError('masking = "smith": no explicit surface has it; measure "vcavity".')
        for name in {"alpha"} & given:  # by the name that was given
            _number(name, model[name])
        alpha_u, alpha_v = (model[name] if name in given else model["alpha"] for name in ("alpha_u", "alpha_v"))
        colour = model["diffuse_reflectance"]
        if isinstance(colour, dict) and colour.get("type") == "rgb":
            colour = colour["value"]
        values = np.atleast_1d(colour)
        if values.dtype.kind not in "fi":
            raise ParameterError(
                f"diffuse_reflectance = {model['diffuse_reflectance']!r}: not simulated; give one number, or RGB."
            )
        first, *others = map(float, values)
        albedo: Any = (first, *others) if others else first
        eta = max(_index(model, "int_ior") / _index(model, "ext_ior"), 1.0)  # 1 in air is meant to be no interface
        return cls(model["distribution"], alpha_u, alpha_v, albedo, eta)

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "cavities"} | asdict(self)

    def piece(self, rng: np.random.Generator) -> Grooves:
        """Always the same; the cavities are drawn with the rays."""
        return Grooves(self.draw, InterfacedFacet(self.albedo, self.eta))

    def draw(self, rng: mi.PCG32) -> Shape:
        """A cavity by ground area: that of a normal with density D cos."""
        distribution = DISTRIBUTIONS[self.distribution](*opaque(mi.Point2f, self.alpha_u, self.alpha_v))
        m = distribution.sample(rng.next_float32(), rng.next_float32())
        rejected = mi.Bool(isinstance(distribution, Gaussian))
        for _ in range(TRIES if isinstance(distribution, Gaussian) else 0):
            sin = dr.sqrt(dr.square(m.x) + dr.square(m.y))
            rejected = rejected & (rng.next_float32() * dr.atan2(sin, m.z) > sin)
            m = dr.select(rejected, distribution.sample(rng.next_float32(), rng.next_float32()), m)
        tilt = dr.atan2(dr.sqrt(dr.square(m.x) + dr.square(m.y)), m.z)
        return Shape(mi.Vector2f(*heading(m.x, m.y)), tilt, tilt)


def _index(model: dict[str, Any], name: str) -> float:
    """An index of refraction that is given by a number, or by a name that Mitsuba knows."""
    if not isinstance(model[name], int | float | str):
        raise ParameterError(f"{name} = {model[name]!r}: simulated cavities are alike everywhere; expected one number.")
    props = mi.Properties()
    props[name] = model[name]
    return float(mi.lookup_ior(props, name, 1.0))


def _number(name: str, value: Any) -> None:
    if not isinstance(value, int | float):
        raise ParameterError(f"{name} = {value!r}: simulated cavities are alike everywhere; expected one number.")
