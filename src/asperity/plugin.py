"""The one adapter between asperity's models and Mitsuba: the only place that knows how plugins are registered.

Mitsuba has one ``mi.BSDF`` class per variant and forgets nothing: a registration is keyed by name and variant. So each
model, a plain class, is wrapped once for every variant that becomes active.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import drjit as dr
import mitsuba as mi

from . import cuda, llvm, loading, threads
from .microfacet.albedo import directional_albedo
from .microfacet.quadrature import RULES, rule
from .models import MODELS, PHASES, TEXTURES
from .parameters import Usual


def register() -> None:
    """Register every model in the active variant."""
    variant = mi.variant()
    llvm.guard(variant)
    cuda.guard(variant)
    threads.ensure_worker()
    loading.PLUGINS.update(MODELS, TEXTURES, PHASES)
    for name, model in MODELS.items():
        mi.register_bsdf(name, _bsdf(model, variant))
    for name, model in TEXTURES.items():
        mi.register_texture(name, _texture(model, variant))
    for name, model in PHASES.items():
        mi.register_phase(name, _phase(model, variant))


def _plugin(base: Any, model_class: Any) -> type:
    """A subclass of Mitsuba's ``base`` with what all plugins share: parameters, traversal, text."""

    class Plugin(base):
        """Mitsuba's view of a model, whose the physics is."""

        def __init__(self, props: mi.Properties) -> None:
            self.model = model_class.parse(props)  # first: Mitsuba's constructor makes this known to all threads
            base.__init__(self, props)
            self.parts = _parts(self.model)

        def __init_subclass__(cls) -> None:
            cls.__name__ = cls.__qualname__ = model_class.__name__

        def traverse(self, callback: mi.TraversalCallback) -> None:
            for name, child in self.model.children().items():
                callback.put(name, child, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: list[str]) -> None:
            self.model.check()
            self.model.refresh()

        def to_string(self) -> str:
            children = (f"  {name} = {child}".replace("\n", "\n  ") for name, child in self.model.children().items())
            return f"{model_class.__name__}[\n" + ",\n".join(children) + "\n]"

        def ranges(self) -> dict[str, tuple[float, float]]:
            """(least, greatest) by the name of a parameter that ``mi.traverse`` shows, for checks and fits."""
            return self.model.ranges()

        def usual(self) -> dict[str, Usual]:
            """Usual values by the name of a parameter that ``mi.traverse`` shows, for sliders, fits and sweeps."""
            return self.model.usual()

    return Plugin


@cache
def _bsdf(model_class: Any, variant: str) -> type:
    """The ``mi.BSDF`` of the active ``variant`` that wraps ``model_class``."""

    class BSDF(_plugin(mi.BSDF, model_class)):  # type: ignore[misc]
        """Adds components, polarisation, and the albedo."""

        def __init__(self, props: mi.Properties) -> None:
            super().__init__(props)
            self.m_components = self.model.components()
            self.m_flags = 0
            for flags in self.m_components:
                self.m_flags |= flags

        def eval_pdf(self, ctx, si, wo, active=True):
            value, pdf = self.model.eval_pdf(ctx, si, wo, active)
            return _depolarise(value), pdf

        # Dr.Jit traces lazily: what the caller does not use is never compiled.
        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs, weight = self.model.sample(ctx, si, sample1, sample2, active)
            return bs, _depolarise(weight)

        def eval_diffuse_reflectance(self, si, active=True):
            # Mitsuba's default, pi times the value at normal incidence, is right for Lambertian BSDFs only.
            if hasattr(self.model, "directional_albedo"):
                return _depolarise(self.model.directional_albedo(si, active))
            return _depolarise(directional_albedo(self.model.sample, si, active))

    return BSDF


@cache
def _texture(model_class: Any, variant: str) -> type:
    """The ``mi.Texture`` of the active ``variant`` that wraps a texture of ours, of one number."""

    class Texture(_plugin(mi.Texture, model_class)):  # type: ignore[misc]
        """Adds the number, and its mean."""

        def eval_1(self, si, active=True):
            return self.model.eval(si, active)

        def eval(self, si, active=True):
            return mi.UnpolarizedSpectrum(self.model.eval(si, active))

        def eval_3(self, si, active=True):
            return mi.Color3f(self.model.eval(si, active))

        def mean(self):
            return self.model.mean()

        def is_spatially_varying(self) -> bool:
            return True

    return Texture


@cache
def _phase(model_class: Any, variant: str) -> type:
    """The ``mi.PhaseFunction`` of the active ``variant`` that wraps a phase function of ours."""

    class Phase(_plugin(mi.PhaseFunction, model_class)):  # type: ignore[misc]
        """Adds one component, which depends on the angle."""

        def __init__(self, props: mi.Properties) -> None:
            super().__init__(props)
            self.m_flags = int(mi.PhaseFunctionFlags.Anisotropic)

        def eval_pdf(self, ctx, mei, wo, active=True):
            value, pdf = self.model.eval_pdf(ctx, mei, wo, active)
            return _depolarise(value), pdf

        def sample(self, ctx, mei, sample1, sample2, active=True):
            wo, weight, pdf = self.model.sample(ctx, mei, sample1, sample2, active)
            return wo, _depolarise(weight), pdf

    return Phase


def _parts(model: Any) -> tuple[Any, ...]:
    """All arrays that a model uses, where ``dr.freeze`` looks for them: it knows containers, but not our classes."""
    rules = [rule(n, mi.Float) for n in RULES] if dr.is_jit_v(mi.Float) else []
    return vars(model), rules


def _depolarise(value: Any) -> Any:
    return mi.depolarizer(value) if mi.is_polarized else value
