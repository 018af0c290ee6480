"""Fresnel terms on spectra."""

from __future__ import annotations

import mitsuba as mi


def conductor(cos, eta, k):
    """Unpolarised reflectance of a conductor of index eta + i k, two spectra, for one cosine: a spectrum in [0, 1]."""
    return type(eta)([mi.fresnel_conductor(cos, mi.Complex2f(n, extinction)) for n, extinction in zip(eta, k)])
