"""The checks accept Mitsuba's own BSDFs, and catch models that are wrong in one way each."""

import asperity  # noqa: F401, I001  (before Mitsuba: chooses the LLVM)
import broken
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import AsperityError
from asperity.lab import checks, evaluate, pictures

RIGHT = {
    "diffuse": {"type": "diffuse"},
    "roughconductor": {"type": "roughconductor", "distribution": "ggx", "alpha": 0.2},
    "anisotropic": {"type": "roughconductor", "distribution": "ggx", "alpha_u": 0.1, "alpha_v": 0.4},
    "narrow": {"type": "roughconductor", "distribution": "ggx", "alpha": 0.01},
    "roughdielectric": {"type": "roughdielectric", "alpha": 0.3},
    "conductor": {"type": "conductor", "material": "Au"},
    "delta and smooth": {"type": "plastic"},
    "twosided": {"type": "twosided", "bsdf": {"type": "diffuse"}},
    "half vector": {"type": "broken_HalfVector"},
}

# Which checks a fault fails, and no others.
BROKEN = {
    "MissingCosine": {"weight", "reciprocity", "furnace"},
    "MissingJacobian": {"chi2", "pdf-integral", "furnace"},
    "NonReciprocal": {"reciprocity"},
    "WrongWeight": {"weight", "furnace"},
    "Flickering": {"determinism"},
    "Creating": {"energy"},
    "NaNAtGrazing": {"finiteness"},
    "InfiniteGradient": {"gradients"},
    "Detached": {"gradients"},
    "UnsetEta": {"finiteness"},
    "WrongSampledPdf": {"sampled-pdf"},
    "WrongEvalPdf": {"eval-pdf"},
    "DimAtNormal": {"continuity"},
    "DimFromNormal": {"continuity", "reciprocity"},
    "SpikeInRetroPdf": {"continuity"},
    "NaNWithoutReflectance": {"bounds"},
    "DeadWhenWhite": {"bounds"},
    "NegativeWhenSmooth": {"bounds"},
    "ClosureInALoop": {"gradients"},
}


@pytest.fixture(autouse=True)
def variant():
    before = mi.variant()
    mi.detail.add_variant_callback(broken.register)
    mi.set_variant("llvm_ad_rgb")
    broken.register()
    yield
    mi.detail.remove_variant_callback(broken.register)
    if before is not None:
        mi.set_variant(before)


def failed(results):
    return {result.name for result in results if result.passed is False}


@pytest.mark.parametrize("name", RIGHT)
def test_accepts_right_models(name):
    results = checks.check(RIGHT[name], only=list(checks.CHECKS))
    assert not failed(results), results


def test_runs_all_checks_in_all_variants_by_default():
    results = checks.check({"type": "broken_Lambertian"})
    assert [r.name for r in results] == list(checks.NAMES)
    assert all(r.passed for r in results), results


@pytest.mark.parametrize("name", BROKEN)
def test_catches_a_fault_by_the_checks_it_concerns(name, tmp_path):
    results = checks.check({"type": f"broken_{name}"}, only=list(checks.CHECKS))
    assert failed(results) == BROKEN[name]
    for result in results:
        if result.passed is False:
            pictures.draw(result, tmp_path / "failure.png")
            assert (tmp_path / "failure.png").read_bytes().startswith(b"\x89PNG")


def test_an_exception_fails_the_check_and_is_quoted():
    (result,) = checks.check({"type": "broken_Raising"}, only=["weight"])
    assert result.passed is False
    assert "no density yet" in result.measured


def test_nan_in_the_pdf_is_not_mistaken_for_a_delta_lobe():
    assert failed(checks.check({"type": "broken_NaNPdf"}, only=["chi2", "pdf-integral"])) == {"chi2", "pdf-integral"}


def test_catches_a_model_that_fails_in_scalar_variants_and_restores_the_variant():
    (result,) = checks.check({"type": "broken_VectorOnly"}, only=["variants"])
    assert result.passed is False
    assert "scalar_rgb" in result.measured
    assert "llvm_ad_rgb" not in result.measured
    assert mi.variant() == "llvm_ad_rgb"


def test_delta_lobes_are_skipped_with_a_reason():
    skipped = [r for r in checks.check({"type": "conductor"}) if r.passed is None]
    assert {r.name for r in skipped} == {"chi2", "weight", "sampled-pdf", "reciprocity", "continuity", "gradients"}
    assert all("delta" in r.measured for r in skipped)


def test_known_fault_of_roughplastic():
    # Its pdf reflects half vectors below the surface too: positive below the horizon, 0/0 at wo = -wi.
    results = checks.check({"type": "roughplastic"}, only=["chi2", "pdf-integral", "finiteness", "energy"])
    assert failed(results) == {"chi2", "pdf-integral", "finiteness"}


def test_parameters_are_given_back():
    bsdf = mi.load_dict({"type": "roughconductor", "alpha": 0.3, "specular_reflectance": 1.0})
    before = {key: np.array(value) for key, value in mi.traverse(bsdf)}
    checks.check(bsdf, only=["gradients"])
    for key, value in mi.traverse(bsdf):
        assert np.array_equal(before[key], value)


@pytest.mark.parametrize("scalar, note", [("scalar_rgb", "llvm_ad_rgb"), ("scalar_spectral", "llvm_ad_spectral")])
def test_scalar_variants_check_in_their_llvm_counterpart(scalar, note):
    mi.set_variant(scalar)
    results = checks.check({"type": "diffuse"}, only=["weight", "energy", "gradients"])
    assert not failed(results)
    assert note in results[-1].measured
    assert mi.variant() == scalar
    with pytest.raises(AsperityError, match="one direction at a time"):
        checks.check(mi.load_dict({"type": "diffuse"}))


def test_polarised_light():
    mi.set_variant("llvm_ad_spectral_polarized")
    assert not failed(checks.check({"type": "roughconductor", "alpha": 0.2}, only=["weight", "reciprocity", "furnace"]))


def test_progress_names_each_check():
    seen = []
    checks.check({"type": "diffuse"}, lambda *step: seen.append(step), only=["weight", "energy"])
    assert seen == [("weight", 0, 2), ("energy", 1, 2)]


def test_misuse_is_explained(monkeypatch):
    with pytest.raises(AsperityError, match="Did you mean 'reciprocity'"):
        checks.check({"type": "diffuse"}, only=["reciprocal"])
    with pytest.raises(AsperityError, match=r"significance = 2: expected a number in \(0, 1\)"):
        checks.check({"type": "diffuse"}, significance=2)
    with pytest.raises(AsperityError, match="expected a BSDF"):
        evaluate.load(mi.load_dict({"type": "sphere"}))
    with pytest.raises(AsperityError, match="difuse"):
        evaluate.load({"type": "difuse"})
    monkeypatch.setattr(mi, "variant", lambda: None)
    with pytest.raises(AsperityError, match="no Mitsuba variant is set"):
        checks.check({"type": "diffuse"})


def test_hard_pairs_are_unit_and_hit_the_horizon_exactly():
    wi, wo = (np.array(w) for w in evaluate.hard_pairs())
    assert np.allclose(np.linalg.norm(wi, axis=0), 1)
    assert np.allclose(np.linalg.norm(wo, axis=0), 1)
    assert (wi[2] == 0).any()
    assert (wo[2] == 0).any()
