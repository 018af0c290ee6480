"""Denoised pictures are nearer the truth, and what guides the denoiser is what one sees."""

import asperity  # noqa: F401, I001  (before mitsuba: it finds a working LLVM)
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.scenes import denoise
from asperity.scenes.preview import preview

pytestmark = pytest.mark.usefixtures("rgb")
RED = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.2, 0.1]}}
installed = pytest.mark.skipif(not denoise.find_spec("pyoidn"), reason="an extra: pyoidn")


def scene(material=RED, **view):
    return mi.load_dict(preview(material, object="sphere", size=(64, 64), **view))


def test_features_are_albedo_and_normal_of_what_is_seen():
    albedo, normal = denoise.features(scene(), spp=16)
    middle = albedo[30:34, 30:34].reshape(-1, 3)
    assert middle == pytest.approx(np.tile([0.6, 0.2, 0.1], (16, 1)), abs=1e-5)
    # The camera looks at the middle of the ball, from (0, -8.6, 3.2).
    assert normal[31:33, 31:33].mean(axis=(0, 1)) == pytest.approx([0, -0.97, 0.25], abs=0.05)
    assert normal[-1, 0] == pytest.approx([0, 0, 1], abs=1e-5), "the ground"


def test_features_of_other_variants_are_grey():
    mi.set_variant("llvm_ad_spectral")
    albedo, _ = denoise.features(scene(), spp=4)
    assert np.ptp(albedo, axis=-1).max() == 0


@installed
@pytest.mark.parametrize("channels", [3, 1])
def test_the_error_falls(channels):
    shown = scene(env="venice")
    truth = np.array(mi.render(shown, spp=1024, seed=1))[..., :channels]
    noisy = np.array(mi.render(shown, spp=4, seed=2))[..., :channels]
    clean = denoise.denoised(noisy, *denoise.features(shown))
    assert clean.shape == noisy.shape
    error, before = (np.sqrt(np.mean((image - truth) ** 2)) for image in (clean, noisy))
    # Measured: a quarter. One half leaves room for other versions of the network.
    assert error < before / 2


@installed
def test_what_is_not_finite_does_not_spread():
    noisy = np.full((32, 32, 3), 0.5)
    noisy[16, 16] = np.nan
    flat = np.zeros((32, 32, 3), np.float32)
    assert np.isfinite(denoise.denoised(noisy, flat, flat)).all()


def test_what_is_missing_is_said(monkeypatch):
    monkeypatch.setattr(denoise, "find_spec", lambda name: None)
    assert not denoise.available()
    with pytest.raises(ParameterError, match=r"--denoise: there is no pyoidn; python -m pip install"):
        denoise.require()


@installed
def test_scalar_variants_cannot():
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match="not in the variant scalar_rgb"):
        denoise.require()
