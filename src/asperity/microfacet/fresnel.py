"""Fresnel terms on spectra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mitsuba as mi


@dataclass
class Dielectric:
    """A smooth interface to a dielectric of relative index ``eta``."""

    eta: Any

    def __call__(self, cos):
        """Unpolarised reflectance at the cosine of incidence from outside."""
        return mi.fresnel(cos, self.eta)[0]


def conductor(cos, eta, k):
    """Unpolarised reflectance of a conductor of index eta + i k, two spectra, for one cosine: a spectrum in [0, 1]."""
    return type(eta)([mi.fresnel_conductor(cos, mi.Complex2f(n, extinction)) for n, extinction in zip(eta, k)])
