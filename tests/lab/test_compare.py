"""Two BSDFs in numbers."""

import asperity  # noqa: F401  isort: skip
import json

import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.lab import evaluate
from asperity.lab.compare import FAINT, compare


def lambertian(reflectance):
    return evaluate.load({"type": "diffuse", "reflectance": reflectance})


GOLD = {"type": "roughconductor", "material": "Au", "alpha": 0.2, "distribution": "ggx"}


def test_two_lambertians(rgb):
    """f cos θ = ρ/π cos θ: every error is known. The largest differs from the mean by rounding in float32 only."""
    found = compare(lambertian(0.5), lambertian(0.6))
    assert found.mean_relative == pytest.approx(0.2, rel=1e-5)
    assert found.worst.error == pytest.approx(0.2, rel=1e-5)
    assert found.albedo_difference == pytest.approx(np.full(18, 0.1), abs=1e-5)
    cosine = (np.arange(100_000) + 0.5) / 100_000  # even in solid angle
    difference = np.log1p(0.6 / np.pi * cosine) - np.log1p(0.5 / np.pi * cosine)
    # 64 rows by the midpoint rule: its error is (1/64)² of the curvature's size.
    assert found.log_cosine == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-3)
    assert found.noise is None


def test_a_bsdf_equals_itself(rgb):
    found = compare(evaluate.load(GOLD), evaluate.load(GOLD))
    assert found.mean_relative == found.worst.error == found.log_cosine == 0
    assert not found.albedo_difference.any()


def test_the_worst_is_where_it_says(rgb):
    """Evaluated there, both differ by just as much."""
    a, b = lambertian(0.5), evaluate.load(GOLD)
    found = compare(a, b)
    error, incident, outgoing = found.worst
    wi, wo = (np.array(evaluate.direction(*angles)).reshape(1, 3) for angles in (incident, outgoing))
    of_a, of_b = (evaluate.at_pairs(bsdf, wi, wo)[:-1] for bsdf in (a, b))
    floor = FAINT * 0.5 / (2 * np.pi)
    assert error == pytest.approx(np.max(np.abs(of_b - of_a) / np.maximum(of_a, floor)), rel=1e-3)


def test_a_black_reference_gives_json_without_infinity(rgb):
    numbers = compare(lambertian(0.0), lambertian(0.5)).numbers()
    assert numbers["mean_relative_error"] is None and numbers["worst_relative_error"] is None
    assert numbers["albedo_largest_difference"] == pytest.approx(0.5, abs=1e-5)
    json.dumps(numbers, allow_nan=False)


def test_not_finite_is_refused_by_name(rgb, monkeypatch):
    values = evaluate.at_pairs

    def broken(bsdf, wi, wo):
        found = values(bsdf, wi, wo).copy()
        found[1, 7] = np.nan
        return found

    monkeypatch.setattr(evaluate, "at_pairs", broken)
    with pytest.raises(ParameterError, match=r"rust is not finite at 1 of .* the first at θ_i = 16\.\d+°"):
        compare(lambertian(0.5), lambertian(0.5), ("rust", "gold"))


def test_variants(rgb):
    """In spectra too, where each lane has wavelengths of its own; scalar variants have no arrays."""
    mi.set_variant("llvm_ad_spectral")
    assert compare(lambertian(0.5), lambertian(0.6)).mean_relative == pytest.approx(0.2, rel=1e-5)
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match=r"variant scalar_rgb.*llvm_ad_rgb"):
        compare(lambertian(0.5), lambertian(0.6))
