"""The checks accept Mitsuba's own BSDFs, and catch models that are wrong in one way each."""

import asperity  # noqa: F401, I001  (before Mitsuba: chooses the LLVM)
from types import SimpleNamespace

import broken
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import AsperityError
from asperity.lab import checks, evaluate, pictures
from asperity.lab.checks import bounds, variants

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
    yield mi.variant()
    mi.detail.remove_variant_callback(broken.register)
    if before is not None:
        mi.set_variant(before)


def failed(results):
    return {result.name for result in results if result.passed is False}


SLOW = {"anisotropic", "narrow", "roughdielectric", "delta and smooth", "conductor"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in RIGHT]
)
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
            pictures.write(result, tmp_path / "failure.png")
            assert (tmp_path / "failure.png").read_bytes().startswith(b"\x89PNG")


def test_an_exception_fails_the_check_and_is_quoted():
    (result,) = checks.check({"type": "broken_Raising"}, only=["weight"])
    assert result.passed is False
    assert "no density yet" in result.measured


def test_nan_in_the_pdf_is_not_mistaken_for_a_delta_lobe():
    assert failed(checks.check({"type": "broken_NaNPdf"}, only=["chi2", "pdf-integral"])) == {"chi2", "pdf-integral"}


def test_catches_a_model_that_fails_in_scalar_variants_and_restores_the_variant(variant):
    (result,) = checks.check({"type": "broken_VectorOnly"}, only=["variants"])
    assert result.passed is False
    assert "scalar_rgb" in result.measured
    assert "llvm_ad_rgb" not in result.measured
    assert mi.variant() == variant


def test_delta_lobes_are_skipped_with_a_reason():
    skipped = [r for r in checks.check({"type": "conductor"}) if r.passed is None]
    assert {r.name for r in skipped} == {"chi2", "weight", "sampled-pdf", "reciprocity", "continuity", "gradients"}
    assert all("delta" in r.measured for r in skipped)


def test_known_fault_of_roughplastic():
    # Its pdf reflects half vectors below the surface too: positive below the horizon, 0/0 at wo = -wi.
    results = checks.check({"type": "roughplastic"}, only=["chi2", "pdf-integral", "finiteness", "energy"])
    assert failed(results) == {"chi2", "pdf-integral", "finiteness"}


SPELLINGS = {"chi²": "chi2", "PDF integral": "pdf-integral", "sampled_pdf": "sampled-pdf", "eval_pdf": "eval-pdf"}


@pytest.mark.parametrize("given", [*SPELLINGS, *checks.NAMES])
def test_names_can_be_typed_and_old_spellings_still_do(given):
    assert checks.canonical(given) == SPELLINGS.get(given, given)
    assert checks.canonical(given).isascii()


def test_significance_is_an_argument():
    """Near 1, any noise of the samples is taken for a fault."""
    noisy = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.2, "material": "none"}
    limits = [checks.check(noisy, only=["chi2"], significance=s)[0].bound for s in (0.01, 1e-6)]
    assert "once in 100 " in limits[0] and "once in 1000000 " in limits[1]
    assert failed(checks.check(noisy, only=["chi2"], significance=1 - 1e-9)) == {"chi2"}


@pytest.mark.parametrize("name", ["vgroove", "pole", "narrow"])
def test_continuity_accepts_poles_whose_strength_depends_on_the_way_there(name):
    pole = {"type": "vgroove", "alpha": 1.0, "material": "Cu"}
    elliptic = {"type": "vgroove", "distribution": "beckmann", "alpha_u": 0.2, "alpha_v": 0.6}
    narrow = {"type": "roughconductor", "alpha": 0.001}
    (result,) = checks.check({"vgroove": elliptic, "pole": pole, "narrow": narrow}[name], only=["continuity"])
    assert result.passed, result


def test_a_jump_is_told_with_its_directions():
    (result,) = checks.check({"type": "broken_DimFromNormal"}, only=["continuity"])
    assert "eval 0.0318, but 0.159 0.05° off, at wi θ 0°" in result.measured


def test_bounds_finds_ranges_within_nested_bsdfs():
    nested = {"type": "twosided", "bsdf": {"type": "broken_NegativeWhenSmooth"}}
    (result,) = checks.check(nested, only=["bounds"])
    assert result.passed is False and "brdf_0.roughness.value = 0.1: eval" in result.measured


def told(**ranges):
    return SimpleNamespace(ranges=lambda: ranges)


INNER, OUTER = told(top=(0.0, np.inf), threshold=(-1.0, 1.0)), told(tau_0=(0.1, 0.9))


@pytest.mark.parametrize("name, ends", [("top", (0.0, 0.9)), ("threshold", (-1.0, 1.0)), ("other", (0.1, 0.9))])
def test_where_a_texture_leaves_its_range_open_its_owner_knows(name, ends):
    path = [(object(), "value"), (INNER, name), (OUTER, "tau_0"), (object(), "bsdf")]
    key = f"bsdf.tau_0.{name}.value"
    parameters = SimpleNamespace(path=lambda _: path, initial={key: np.zeros(1)})
    assert bounds.ends(parameters, key) == ends


def test_bounds_skips_what_tells_no_range():
    (result,) = checks.check({"type": "roughconductor", "alpha": 0.2}, only=["bounds"])
    assert result.passed is None and "ranges" in result.measured


def test_unused_parameters_of_mitsuba_are_no_trouble():
    """The hair's absorption is None where pigments are given instead; its reciprocity is not a matter of code."""
    gradients, reciprocity = checks.check({"type": "hair"}, only=["gradients", "reciprocity"])
    assert gradients.passed, gradients
    assert reciprocity.passed is None and "fibre" in reciprocity.measured


def test_a_file_of_other_colours_is_no_fault(monkeypatch):
    """What `measured` says of RGB files in spectral variants."""
    probe = variants.probe

    def picky(description):
        if mi.is_spectral:
            raise RuntimeError("Measurements in RGB format require the use of a RGB variant of Mitsuba!")
        return probe(description)

    monkeypatch.setattr(variants, "probe", picky)
    (result,) = checks.check({"type": "diffuse"}, only=["variants"])
    assert result.passed and "need other colours: skipped; " in result.measured and "RGB variant" in result.measured


def test_parameters_are_given_back():
    bsdf = mi.load_dict({"type": "roughconductor", "alpha": 0.3, "specular_reflectance": 1.0})
    before = {key: np.array(value) for key, value in mi.traverse(bsdf)}
    checks.check(bsdf, only=["gradients", "bounds"])
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


def test_special_pairs_are_exact_and_off_the_horizon():
    wi, wo = evaluate.special_pairs()
    assert np.allclose(np.linalg.norm(wi, axis=1), 1) and np.allclose(np.linalg.norm(wo, axis=1), 1)
    assert min(np.abs(wi[:, 2]).min(), np.abs(wo[:, 2]).min()) > 1e-3
    for special in (wi == [0, 0, 1], wo == [0, 0, 1], wi == wo, wi == wo * [-1, -1, 1], wi == -wo):
        assert special.all(axis=1).sum() >= 25
    (one,) = evaluate.special_pairs(both_sides=False)[:1]
    assert (one[:, 2] > 0).all()
