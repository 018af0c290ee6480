"""BRDFs as functions: what pairs that lie anywhere are interpolated to, and what a BSDF is."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest
from data import glossy, real

from asperity.errors import ParameterError
from asperity.lab import evaluate
from asperity.measured import BRDF, functions, goniometer
from asperity.measured.functions import of_brdf, of_bsdf, random_pairs, turned

RGB = ("R", "G", "B")


def scattered(n, f=glossy, isotropic=True):
    wi, wo = random_pairs(n, seed=5)
    return BRDF(wi, wo, f(wi, wo), RGB, isotropic=isotropic)


def streak(wi, wo):
    """An anisotropic BRDF."""
    half = wi + wo
    return np.exp(-np.square(half[:, :1] / half[:, 2:] / 0.6)) * np.ones(3)


@pytest.mark.parametrize("f, isotropic", [(glossy, True), (glossy, False), (streak, False)])
def test_scattered_pairs_keep_their_values_and_are_of_second_order_between(f, isotropic):
    """Four times as many pairs are closer by 4^(1/3), or 4^(1/4) where the azimuth counts: second order divides the
    error by 2.5, or 2."""
    wi, wo = random_pairs(2000)
    errors = []
    for n in (2500, 10_000):
        data = scattered(n, f, isotropic)
        between = of_brdf(data)
        assert np.allclose(between(data.wi, data.wo), data.values, rtol=1e-6)
        errors.append(np.median(np.abs(between(wi, wo) / f(wi, wo) - 1)))
    assert errors[1] < 0.05 and errors[0] / errors[1] > (2 if isotropic else 1.6)


def test_what_is_alike_is_the_same():
    """Reciprocal pairs, and in isotropic BRDFs those that are turned about the normal, or mirrored."""
    wi, wo = random_pairs(100)
    f, angle = of_brdf(scattered(500)), np.linspace(0, 6, 100)
    for alike in [(wo, wi), (turned(wi, angle), turned(wo, angle)), (wi * [1, -1, 1], wo * [1, -1, 1])]:
        assert np.allclose(f(*alike), f(wi, wo), rtol=1e-6)
    f = of_brdf(scattered(500, streak, isotropic=False))
    assert np.allclose(f(wo, wi), f(wi, wo), rtol=1e-6)
    assert not np.allclose(f(turned(wi, angle), turned(wo, angle)), f(wi, wo), rtol=0.1)


def test_values_are_held_within_those_around():
    """Beyond the pairs, too: all of these are within 30 degrees of the normal."""
    data = scattered(2000)
    near = data.subset(np.flatnonzero(np.minimum(data.wi[:, 2], data.wo[:, 2]) > 0.85))
    values = of_brdf(near)(*random_pairs(2000))
    assert (values >= near.values.min(axis=0) * (1 - 1e-9)).all()
    assert (values <= near.values.max(axis=0) * (1 + 1e-9)).all()


def test_few_pairs_and_the_same_ones_several_times():
    one = scattered(1)
    assert np.allclose(of_brdf(one)(*random_pairs(5)), one.values)
    many = one.subset(np.zeros(100, dtype=int))
    assert np.allclose(of_brdf(many)(*random_pairs(5)), one.values)
    assert len(functions.Scattered(many).cross_validation()[0]) == 0


def test_cross_validation_tells_the_error_between_pairs():
    """It has one pair less at each place, so it is somewhat larger: by less than half."""
    data = scattered(4000)
    between = functions.Scattered(data)
    chosen, found = between.cross_validation()
    wi, wo = random_pairs(2000)
    told, true = (np.median(np.abs(x)) for x in (found / data.values[chosen] - 1, between(wi, wo) / glossy(wi, wo) - 1))
    assert true < told < 1.5 * true


def test_a_bsdf_is_its_values_without_the_cosine(rgb):
    wi, wo = random_pairs(50)
    f = of_bsdf(evaluate.load({"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}))
    assert np.allclose(f(wi, wo), np.array([0.1, 0.2, 0.3]) / np.pi, rtol=1e-5)
    assert f.channels == RGB and f.isotropic
    assert not of_bsdf(evaluate.load({"type": "roughconductor", "alpha_u": 0.1, "alpha_v": 0.3})).isotropic
    assert of_bsdf(evaluate.load({"type": "roughconductor", "alpha": 0.02})).isotropic


def test_what_has_no_values_is_refused(rgb):
    with pytest.raises(ParameterError, match="all mirror"):
        of_bsdf(evaluate.load({"type": "conductor"}))


def test_a_bsdf_at_any_number_of_wavelengths():
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    spectrum = {"type": "spectrum", "value": [(400, 0.2), (700, 0.8)]}
    bsdf = evaluate.load({"type": "diffuse", "reflectance": spectrum})
    f = of_bsdf(bsdf, [400, 450, 500, 550, 700])
    assert f.channels[-1] == "700 nm"
    assert np.allclose(f(*random_pairs(3)) * np.pi, [0.2, 0.3, 0.4, 0.5, 0.8], rtol=1e-4)
    with pytest.raises(ParameterError, match="name the wavelengths"):
        of_bsdf(bsdf)


def test_the_sample_of_nist_reflects_what_is_known_of_it():
    """Sintered PTFE has an albedo of 0.99 in the visible (Weidner and Hsia 1981); pairs that
    by symmetry are the same differ by 1.0% in the median."""
    data = goniometer.load(real("nist/PTFE.csv"))
    f = of_brdf(data)
    u = (np.arange(4096) + 0.5) / 4096
    wo = np.stack([np.sqrt(u) * np.cos(4096 * 2.4 * u), np.sqrt(u) * np.sin(4096 * 2.4 * u), np.sqrt(1 - u)], axis=-1)
    wi = np.broadcast_to([np.sin(0.4), 0, np.cos(0.4)], wo.shape)
    assert np.allclose(np.pi * f(wi, wo).mean(axis=0)[1:3], 0.99, atol=0.015)
    chosen, found = f.f.cross_validation()
    assert np.median(np.abs(found / data.values[chosen] - 1)) < 0.01
