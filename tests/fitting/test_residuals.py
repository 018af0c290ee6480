"""Values and derivatives of materials in pairs of directions."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.fitting import CANDIDATES, free
from asperity.fitting.residuals import Lanes, Model
from asperity.lab import evaluate
from asperity.measured import BRDF

CHANNELS = {"rgb": ("R", "G", "B"), "mono": ("Y",), "spectral": ("450 nm", "500 nm", "550 nm", "600 nm", "650 nm")}
STEP = 1e-2


def data(channels, n=64):
    random = np.random.default_rng(2)
    z, phi = random.uniform(0.2, 1, (2, n)), random.uniform(0, 2 * np.pi, (2, n))
    wi, wo = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    return BRDF(wi, wo, np.ones((n, len(channels))), channels)


@pytest.mark.parametrize("mode", CHANNELS)
def test_values_are_those_of_the_description(mode):
    """Each wavelength, and each channel of a colour, has a number of its own."""
    mi.set_variant(f"llvm_ad_{mode}")
    pairs, channels = data(CHANNELS[mode]), CHANNELS[mode]
    material = {"type": "interfacedlambertian"}
    model = Model(material, free.parameters(material), channels)
    x = np.random.default_rng(1).uniform(0.2, 0.8, sum(model.sizes))
    assert len(x) == len(channels) + 2
    found = model(x, Lanes.of(pairs))
    for k, name in enumerate(channels):
        alone = material | {path: float(value[min(k, len(value) - 1)]) for path, value in model.values(x).items()}
        waves = None if mode != "spectral" else [float(name.split()[0])] * 4
        wanted = evaluate.at_pairs(evaluate.load(alone), pairs.wi, pairs.wo, waves)[0]
        assert np.allclose(found[k], wanted, rtol=1e-4)
    described = free.described(material, model.values(x), channels)
    again = Model(described, free.parameters(material), channels)
    assert np.allclose(again(x, Lanes.of(pairs)), found, rtol=1e-4)
    if mode != "spectral":
        loaded = evaluate.at_pairs(evaluate.load(described), pairs.wi, pairs.wo)
        assert np.allclose(loaded[: len(channels)], found, rtol=1e-4)


@pytest.mark.parametrize("name", ["micrograin", "interfacedlambertian", "roughconductor + diffuse", "roughplastic"])
def test_derivatives_are_those_of_differences(name):
    mi.set_variant("llvm_ad_rgb")
    pairs = Lanes.of(data(CHANNELS["rgb"]))
    model = Model(CANDIDATES[name], free.parameters(CANDIDATES[name]), CHANNELS["rgb"])
    x = np.random.default_rng(5).uniform(0.35, 0.65, sum(model.sizes))
    value, derivatives = model.derivatives(x, pairs)
    assert np.allclose(value, model(x, pairs), rtol=1e-5)
    found = model.jacobian(derivatives)
    for k, row in enumerate(found):
        step = STEP * (np.arange(len(x)) == k)
        wanted = (model(x + step, pairs) - model(x - step, pairs)) / (2 * STEP)
        # Derivatives of tables are good to 3 % of the largest, and single precision allows no smaller steps.
        assert np.allclose(row, wanted, rtol=0.05, atol=0.03 * np.abs(wanted).max() + 1e-5), model.free


@pytest.mark.parametrize("name", CANDIDATES)
def test_all_parameters_of_all_candidates_are_found_in_spectra(name):
    """Of two spectra with equal values Mitsuba makes one object, which is traversed once."""
    mi.set_variant("llvm_ad_spectral")
    description, channels = CANDIDATES[name], CHANNELS["spectral"]
    chosen = free.chosen(free.parameters(description), None, ())
    assert len(set(Model(description, chosen, channels).keys)) == len(chosen)
