"""`benchmarks/published.py`: formulas of published fits, and the networks in `benchmarks/materials.py`."""

import asperity  # noqa: F401  isort: skip
import importlib
from pathlib import Path

import numpy as np
import pytest

LOBES = {
    "NganCookTorrance": {"albedo": [0.1, 0.2, 0.3], "eta": 0.04, "roughness": 0.2},
    "LowMicrofacetFit": {"A": [10.0, 9.0, 8.0], "B": 300.0, "C": 1.5, "eta": 1.5},
    "Bagher": {
        "albedo": [0.1, 0.2, 0.3],
        "alpha": [0.03, 0.05, 0.06],
        "p": [0.5, 0.6, 0.7],
        "eta": [[0.2, 0.1, 0.3], [0.1, 0.05, 0.2]],
        "K": [10.0, 9.0, 8.0],
        "Lambda": [5.0, 6.0, 7.0],
        "c": [0.4, 0.5, 0.6],
        "k": [3.0, 4.0, 5.0],
        "theta0": [0.8, 0.9, 1.0],
    },
}
NORMAL = np.array([[0.0, 0.0, 1.0]])
AT_NORMAL = {
    "NganCookTorrance": 0.1 * 0.04 / (np.pi * 0.2**2) / np.pi,
    "LowMicrofacetFit": 10 * 0.2**2 / np.pi,
    "Bagher": 0.1 * 10 * np.exp(-0.03) / (np.sqrt(0.03) * np.pi) * (0.2 - 0.1) / np.pi,
}
"""f in red where both directions are the normal: D F / pi, without shadows."""

SOME = ("blue-acrylic", "brass", "dark-red-paint", "green-plastic", "nylon", "pvc", "steel", "white-paint")


@pytest.fixture
def script(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")
    return importlib.import_module


@pytest.fixture
def materials(script):
    found = script("materials")
    return found if (found.FOLDER / "merl").exists() else pytest.skip(f"{found.FOLDER} is missing")


def directions(seed, n=100):
    z, phi = np.random.default_rng(seed).uniform([[0.05], [0]], [[1], [2 * np.pi]], (2, n))
    return np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)


@pytest.mark.parametrize("name", LOBES)
def test_values_at_the_normal(script, name):
    fit = {"lobes": [{"type": name, **LOBES[name]}]}
    assert script("published").evaluate(fit, NORMAL, NORMAL)[0, 0] == pytest.approx(AT_NORMAL[name], rel=1e-12)


@pytest.mark.parametrize("name", LOBES)
def test_reciprocity(script, name):
    """To the rounding of the half vector, which narrow lobes magnify."""
    fit, wi, wo = {"lobes": [{"type": name, **LOBES[name]}]}, directions(1), directions(2)
    there, back = (script("published").evaluate(fit, *pair) for pair in ((wi, wo), (wo, wi)))
    assert np.allclose(there, back, rtol=1e-9) and there.min() >= 0 and there.max() > 0


def test_lobes_add_up_and_a_lambertian_returns_its_albedo(script):
    lobe = {"type": "Lambertian", "albedo": [0.1, 0.2, 0.3]}
    f = script("published").evaluate({"lobes": [lobe, lobe]}, directions(1), directions(2))
    assert np.allclose(f * np.pi, [0.2, 0.4, 0.6])


@pytest.mark.parametrize("fit", ["ngan_cooktorrance", "low_lowmicrofacet_E2", "bagher_sgd"])
def test_published_fits_are_nearer_than_with_another_divisor(script, materials, fit):
    """Lobes times or by pi, which is what conventions differ by, are further from most materials."""
    from asperity.fitting import losses

    factors, errors = (1 / np.pi, 1, np.pi), []
    for name in SOME:
        data = materials.within(materials.network(name, every=997))
        body, lobe = materials.published()[fit][name]["lobes"]
        f = [script("published").evaluate({"lobes": [one]}, data.wi, data.wo) for one in (body, lobe)]
        o = data.wo[:, 2:]
        measured = (data.values * o).T
        errors.append([losses.log_cosine(((f[0] + x * f[1]) * o).T, measured, data.weights) for x in factors])
    found = np.median(errors, axis=0)
    assert factors[found.argmin()] == 1 and found.min() < 0.025


def test_networks_are_sampled_where_a_file_of_merl_has_values(materials):
    data = materials.network("chrome", every=97)
    assert 5_000 < len(data) < 15_000 and data.values.min() >= 0
    assert data.values.max() > 100  # a polished metal's highlight, in 1/sr
