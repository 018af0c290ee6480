"""Fits to data whose material is known."""

import asperity  # noqa: F401  isort: skip
import dataclasses
import json

import mitsuba as mi
import numpy as np
import pytest

from asperity import fitting, materials
from asperity.errors import ParameterError, UnknownNameError
from asperity.fitting import losses, result
from asperity.lab import evaluate
from asperity.measured import BRDF

RGB = ("R", "G", "B")
NOISE = 0.02


def made(material, n=1500, noise=NOISE, seed=0, channels=RGB, errors=False):
    """Values of a material in random pairs, with noise relative to them."""
    mi.set_variant("llvm_ad_rgb" if len(channels) == 3 else "llvm_ad_mono")
    random = np.random.default_rng(seed)
    z, phi = np.sqrt(random.uniform(0.01, 1, (2, n))), random.uniform(0, 2 * np.pi, (2, n))
    wi, wo = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    wo[::3] = wi[::3] * [-1, -1, 1] + 0.1 * random.normal(size=wi[::3].shape)  # near the mirrored direction
    wo = wo / np.linalg.norm(wo, axis=1, keepdims=True)
    wi, wo = wi[wo[:, 2] > 0.05], wo[wo[:, 2] > 0.05]
    f = evaluate.at_pairs(evaluate.load(material), wi, wo)[:-1].T / wo[:, 2:]
    noisy = f * (1 + noise * random.normal(size=f.shape))
    return BRDF(wi, wo, noisy, channels, NOISE * np.maximum(f, 1e-6) if errors else None, source="made")


PAINT = {
    "type": "interfacedlambertian",
    "distribution": "ggx",
    "alpha": 0.25,
    "int_ior": 1.6,
    "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.3, 0.1]},
}
TRUTH = {"alpha": 0.25, "int_ior": 1.6, **{f"diffuse_reflectance[{c}]": v for c, v in zip("RGB", (0.6, 0.3, 0.1))}}


@pytest.mark.parametrize("loss", losses.LOSSES)
def test_parameters_are_found_within_their_errors(loss):
    found = fitting.fit(made(PAINT, errors=loss == "errors"), "interfacedlambertian", loss=loss)
    for one in found.parameters:
        # Five numbers, four losses: that none is three standard errors away has a chance of 95 %; the seed is fixed.
        assert abs(one.value - TRUTH[one.name]) < 3 * one.error, one
        assert one.error < 0.05 * one.value and not one.remark
    assert not found.undetermined and found.complete


def test_the_errors_are_those_of_the_noise():
    """chi squared of data with known errors is 1 for each; the error of the fit is the noise."""
    data = made(PAINT, errors=True)
    found = fitting.fit(data, "interfacedlambertian", loss="errors")
    chi2 = np.square((found.values.T / found.data.wo[:, 2:] - found.data.values) / found.data.errors)
    assert chi2.mean() == pytest.approx(1, abs=4 * np.sqrt(2 / chi2.size))
    assert found.errors.log_cosine == pytest.approx(found.errors.noise, rel=0.05)


def test_what_the_data_cannot_tell_is_told():
    """Seen straight from above and lit from there, filling factor and albedo of black and diffuse are one number."""
    wi = np.tile([0.0, 0.0, 1.0], (64, 1))
    data = BRDF(wi, wi, np.full((64, 1), 0.1), ("Y",))
    found = fitting.fit(data, {"type": "blendbsdf", "bsdf_0": {"type": "diffuse"}, "bsdf_1": {"type": "lambertsphere"}})
    assert found.undetermined or found.related
    assert any("not determined" in line or "hardly told apart" in line for line in found.statements())


def test_a_parameter_without_effect_is_not_determined():
    shiny = {"type": "roughconductor", "alpha": 0.3, "eta": 0.2, "k": 3.0}
    beside = {"type": "blendbsdf", "weight": 0.0, "bsdf_0": shiny, "bsdf_1": {"type": "diffuse"}}
    found = fitting.fit(made(shiny), beside, free=["bsdf_0.alpha", "bsdf_1.reflectance"])
    assert found.undetermined == [f"bsdf_1.reflectance[{c}]" for c in "RGB"]


def test_the_right_model_wins_and_more_parameters_do_not_by_themselves():
    ranked = fitting.rank(made(PAINT), ["diffuse", "interfacedlambertian", "lambertsphere", "roughplastic"])
    assert ranked[0].name == "interfacedlambertian" and ranked[-1].name in ("diffuse", "lambertsphere")
    lambertian = made({"type": "diffuse", "reflectance": 0.5}, noise=0.1)
    ranked = fitting.rank(lambertian, ["orennayar", "diffuse"])
    assert ranked[0].name == "diffuse"


def test_outliers_count_less_with_a_robust_loss():
    data = made(PAINT)
    data.values[::10] *= 30
    plain, robust = (fitting.fit(data, "interfacedlambertian", robust=how) for how in ("linear", "cauchy"))
    off = [abs(one["diffuse_reflectance[G]"] - 0.3) for one in (plain, robust)]
    assert off[1] < 0.03 and off[0] > 5 * off[1]


def test_interrupted_it_keeps_the_best(monkeypatch):
    def stop(task, done, total):
        if done == 50:
            raise KeyboardInterrupt

    found = fitting.fit(made(PAINT), "interfacedlambertian", progress=stop)
    assert not found.complete and found.errors.log_cosine < 0.2
    assert "interrupted" in found.statements()[-1]


def test_the_same_seed_gives_the_same(tmp_path):
    data = made(PAINT)
    first, second = (fitting.fit(data, "roughplastic", pairs=500, seed=3) for _ in range(2))
    assert first.parameters == second.parameters
    first.save(tmp_path / "fit.json")
    assert materials.resolve(str(tmp_path / "fit.json")).description["type"] == "roughplastic"
    content = json.loads((tmp_path / "fit.json").read_text())
    assert content["fit"]["errors"]["log_cosine"] == first.errors.log_cosine
    loaded = evaluate.at_pairs(materials.resolve(str(tmp_path / "fit.json")).load(), first.data.wi, first.data.wo)[:-1]
    assert np.allclose(loaded, first.values, rtol=1e-4)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"loss": "log2"}, "unknown loss 'log2'"),
        ({"robust": "l2"}, "unknown robust loss"),
        ({"loss": "errors"}, "no standard errors"),
        ({"free": ["alpah"]}, "no 'alpah' to fit. Did you mean 'alpha'"),
        ({"fix": {"alpha": -1}}, "alpha"),
        ({"fix": {"alhpa": 0.1}}, "alhpa"),
        ({"grazing": 0}, "grazing = 0"),
        ({"saturation": 0.0}, "0 pairs are left"),
        ({"plus": "velvet"}, "plus = 'velvet'"),
        ({"pairs": 3}, "pairs = 3"),
    ],
)
def test_what_makes_no_sense_is_refused(options, words):
    with pytest.raises((ParameterError, UnknownNameError), match=words):
        fitting.fit(made(PAINT), "interfacedlambertian", **options)


def test_a_loaded_material_cannot_be_fitted():
    with pytest.raises(ParameterError, match="no parameters to fit"):
        fitting.fit(made(PAINT), evaluate.load({"type": "diffuse"}))


def test_covariances_of_noise_that_differs():
    """White's covariance against 4000 fits of a line, whose noise grows along it; the usual formula is off by 1.4."""
    random = np.random.default_rng(0)
    t = np.linspace(0, 1, 200)
    jacobian = np.stack([np.ones_like(t), t], axis=1)
    noise = 0.1 + t**2
    fits = [np.linalg.lstsq(jacobian, noise * random.normal(size=200), rcond=None)[0] for _ in range(4000)]
    residuals = noise * random.normal(size=(200, 200))
    found = np.mean([result.covariance(jacobian, r) for r in residuals], axis=0)
    assert np.allclose(found, np.cov(np.transpose(fits)), rtol=0.1)


def test_errors_reach_over_a_fold():
    """Where (x - 1/2)^2 is measured, 0.3 fits as well as 0.7; with little noise in between it does not."""
    x, bounds = np.array([0.7, 0.2]), (np.zeros(2), np.ones(2))
    jacobian = np.stack([np.full(400, 0.4), np.linspace(-1, 1, 400)], axis=1)
    values = np.random.default_rng(0).normal(size=400)
    values -= jacobian @ np.linalg.lstsq(jacobian, values, rcond=None)[0]  # x is the best
    for noise, reaches in ((0.8, True), (0.02, False)):

        def residuals(x, noise=noise):
            return noise * values + (x[0] - 0.5) ** 2 - 0.04 + (x[1] - 0.2) * jacobian[:, 1]

        error = np.sqrt(np.diag(result.covariance(jacobian, noise * values)))
        found = result.profiled(residuals, x, jacobian, error, bounds)
        assert (3 * found[0] >= 0.39) == reaches and found[1] == pytest.approx(error[1])


def test_black_data_have_no_bias(tmp_path):
    data = made(PAINT)
    data.values[:] = 0
    found = fitting.fit(data, "lambertsphere")
    assert found["reflectance[R]"] < 1e-3 and np.isnan(found.errors.bias)
    found.save(tmp_path / "x.json")
    assert json.loads((tmp_path / "x.json").read_text(), parse_constant=pytest.fail)["fit"]["errors"]["bias"] is None


def test_of_many_correlations_few_are_told():
    rows = [result.Parameter(f"p{k}", 0.5, 0.1, 0, 1) for k in range(5)]
    found = fitting.fit(made(PAINT), "diffuse")
    found = dataclasses.replace(found, parameters=tuple(rows), correlation=np.full((5, 5), 0.99))
    assert len(found.related) == 10 and found.statements()[-1] == "5 other pairs are hardly told apart."
