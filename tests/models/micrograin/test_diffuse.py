"""The quadrature over Lambertian grains."""

import asperity  # noqa: F401  isort: skip
import importlib
from pathlib import Path

import drjit.llvm.ad as llvm
import drjit.scalar as scalar
import numpy as np
import pytest
from helpers import directions, unit

from asperity.models.micrograin.coat import Coat, fit
from asperity.models.micrograin.diffuse import Facet, lambertian
from asperity.models.micrograin.grains import Grains, SecondColour
from asperity.models.micrograin.shadows import Shadows


@pytest.fixture
def reference(monkeypatch):
    """`lambertian` in double precision, by many nodes: that of the benchmarks."""
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "benchmarks")
    return importlib.import_module("exact").lambertian


FACETS = {
    "plain": Facet(),
    "by height": Facet(SecondColour()),
    "by normal": Facet(SecondColour(0.8, 0.6)),
    "coated": Facet(SecondColour(), Coat(1.5)),
}
FITTED = FACETS | {f"fitted {eta}": Facet(SecondColour(), Coat(eta, "fit")) for eta in (1.2, 2.5)}


@pytest.mark.parametrize("isotropic", [True, False], ids=["isotropic", "anisotropic"])
@pytest.mark.parametrize("facet", FITTED)
def test_quadrature(rgb, reference, facet, isotropic):
    """Cosines from 1e-3, betas of 0.1 to 5: half a percent for 99.5 %, 1 % at worst, where above 1e-3.

    Of more inputs, and of axes as 1 to 20 or more, a few in 10^4 are beyond 1 % (docs/micrograin.md).
    """
    facet, n = FITTED[facet], 200
    if facet.coat and facet.coat.fitted:
        facet = Facet(facet.second, Coat(facet.coat.eta, fit(facet.coat.eta)))
    rng = np.random.default_rng(7)
    i, o = directions(rng, n, 1e-3), directions(rng, n, 1e-3)
    o[:, : n // 4] = unit(i + 0.05 * rng.normal(size=i.shape))[:, : n // 4]
    o[2] = np.maximum(np.abs(o[2]), 1e-3)
    o, beta = unit(o), np.exp(rng.uniform(np.log(0.1), np.log(5), (2, n)))
    i[:, -4:], o[:, -4:-2] = np.array([[0], [0], [1]]), np.array([[0], [0], [1]])
    tau_0, betas = rng.uniform(0.01, 1, n), beta[[0, 0]] if isotropic else beta

    def grains(Float):
        return Grains.of(*map(Float, (tau_0, *betas)))

    i, o = (np.array(grains(llvm.Float64).lift(llvm.Array3f64(w))) for w in (i, o))
    pairs = map(llvm.Array3f64, (i, o))
    exact = map(np.array, reference(grains(llvm.Float64), *pairs, facet.coat and facet.coat.eta, facet.second))
    ours = lambertian(grains(llvm.Float), llvm.Array3f(i), llvm.Array3f(o), Shadows.union, facet, isotropic=isotropic)
    for found, expected in zip(map(np.array, ours), exact):
        error = np.abs(found - expected) / np.maximum(expected, 1e-3)
        assert np.quantile(error, 0.995) < 5e-3 and error.max() < 1e-2


def test_anisotropic_grains_seen_from_straight_above(rgb):
    """A direction without an azimuth, as its neighbours."""
    grains = Grains.of(llvm.Float(0.4), llvm.Float(0.3), llvm.Float(2.0))
    above = [llvm.Array3f(float(np.sin(t)), 0, float(np.cos(t))) for t in (0, 1e-4)]
    for azimuth in (0.3, 1.5, 2.8, -2):
        other = llvm.Array3f(*map(float, (0.8 * np.cos(azimuth), 0.8 * np.sin(azimuth), 0.6)))
        for swap in (1, -1):
            at, near = (lambertian(grains, *(w, other)[::swap], Shadows.union, Facet()) for w in above)
            assert float(at.first[0]) == pytest.approx(float(near.first[0]), rel=1e-3)
            assert float(at.pdf[0]) == pytest.approx(float(near.pdf[0]), rel=1e-3)


@pytest.mark.parametrize("facet", FACETS.values(), ids=FACETS)
def test_plain_floats_do_and_grains_may_be_called_isotropic(facet):
    """A recorded loop adds up in another order than copies; the quadrature's accuracy is half a percent."""

    def integral(float_type, array_type, isotropic):
        grains = Grains.of(*map(float_type, (0.4, 0.7, 0.7)))
        wi, wo = array_type(0.48, 0.6, 0.64), array_type(-0.36, 0.48, 0.8)
        parts = lambertian(grains, wi, wo, Shadows.union, facet, isotropic=isotropic)
        return [float(np.ravel(part)[0]) for part in parts]

    plain = integral(float, scalar.Array3f64, False)
    assert integral(llvm.Float64, llvm.Array3f64, False) == pytest.approx(plain, rel=1e-12)
    assert integral(float, scalar.Array3f64, True) == pytest.approx(plain, rel=5e-3)
    assert plain[0] > 0 and (plain[1] > 0) == (facet.second is not None)
