"""Physics of interfaced Lambertian facets: against independent quadrature, published numbers, and limits."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import directions, float64, gauss, towards

from asperity.microfacet.distributions import GGX, Beckmann, Gaussian
from asperity.models.interfacedlambertian import body
from asperity.models.interfacedlambertian.facets import CavityFacets, SmithFacets

INDICES = [1.0, 1.0001, 1.01, 1.1, 1.33, 1.5, 2.0, 2.5, 2.9999, 3.0, 5.0, 10.0]
PAIRS = [(0, 0, 0), (60, 60, 0), (60, 60, 180), (30, 80, 90)]
VALUES = {  # I at the pairs above, alpha = .5 (Gaussian: .35), n = 1 and 1.5: by quadrature of many nodes, twice
    (Beckmann, SmithFacets): ([0.90535, 1.18148, 0.62469, 0.88587], [0.83218, 1.02176, 0.45341, 0.70142]),
    (GGX, SmithFacets): ([0.82644, 1.11391, 0.39394, 0.67145], [0.75109, 0.97648, 0.28510, 0.53581]),
    (Beckmann, CavityFacets): ([0.90535, 1.18898, 0.64124, 0.90535], [0.83218, 1.02694, 0.46543, 0.68951]),
    (GGX, CavityFacets): ([0.82644, 1.23481, 0.53140, 0.82924], [0.75109, 1.07337, 0.38458, 0.63237]),
    (Gaussian, CavityFacets): ([0.88698, 1.20222, 0.61378, 0.88715], [0.81351, 1.04026, 0.44641, 0.67469]),
}
COMBINATIONS = pytest.mark.parametrize("kind, facets", VALUES, ids=lambda x: x.__name__)
RULE = 16, 12
FLOATS = pytest.mark.parametrize("Float", [llvm.Float, llvm.Float64])


def pair(i, o, phi):
    return llvm.Array3f64(towards(i, 0)), llvm.Array3f64(towards(o, phi))


def fresnel_by_polarisation(cos, n):
    inside = np.sqrt(n**2 - 1 + cos**2)
    return ((cos - inside) ** 2 / (cos + inside) ** 2 + (n**2 * cos - inside) ** 2 / (n**2 * cos + inside) ** 2) / 2


@FLOATS
@pytest.mark.parametrize("n", INDICES)
def test_what_is_not_reflected_is_transmitted(Float, n):
    """In float32 to 4e-7 of either, however little it is: F of 1e-9 at n = 1.0001, T of 1e-3 at grazing."""
    cos = Float(np.linspace(1e-3, 1, 500))
    exact = fresnel_by_polarisation(np.array(cos, dtype=float), float(Float(n)[0]))
    tolerance = 4e-7 if Float is llvm.Float else 1e-12
    n = Float(n)
    np.testing.assert_allclose(body.transmitted(cos, n), 1 - exact, rtol=tolerance)
    # F near its zero, Brewster's angle for one polarisation, has a large relative derivative by the cosine
    np.testing.assert_allclose(body.fresnel(cos, n), exact, rtol=100 * tolerance, atol=1e-15)
    twice = body.transmitted_twice(cos, 1 - cos * 0.9, n)
    np.testing.assert_allclose(twice, body.transmitted(cos, n) * body.transmitted(1 - cos * 0.9, n), rtol=2e-6)


def test_matched_indices_have_no_interface():
    cos = llvm.Float(-1, 0, 1e-6, 0.5, 1)
    assert dr.all(body.fresnel(cos, llvm.Float(1)) == 0)
    np.testing.assert_allclose(body.transmitted(cos, llvm.Float(1)), 1, rtol=3e-7)
    assert body.fresnel(0.5, 1.0) == 0 and body.outer_reflectance(1.0) == 0 and body.body_albedo(0.3, 1.0) == 0.3


@FLOATS
@pytest.mark.parametrize("n", INDICES)
def test_reflectance_for_diffuse_light(Float, n):
    """By 200 nodes in the root of the cosine, where F is smooth; the fit is good to 8e-7, float32 to as much."""
    x, w = gauss(200)
    expected = (w * 4 * x**3 * fresnel_by_polarisation(x**2, n)).sum()
    assert np.asarray(body.outer_reflectance(Float(n)))[0] == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize("reflectance", [0.0, 0.2, 0.8, 1.0])
@pytest.mark.parametrize("n", [1.0, 1.2, 1.5, 2.5])
def test_light_that_bounces_inside(reflectance, n):
    """The geometric series of Eq. 9; and nothing is lost where the body is white: r_e + (1 - r_e)^2 Q = 1."""
    r_e = body.outer_reflectance(n)
    inside = 1 - (1 - r_e) / n**2
    series = sum(reflectance * (reflectance * inside) ** k for k in range(2000)) / n**2
    assert body.body_albedo(reflectance, n) == pytest.approx(series, rel=1e-9, abs=1e-12)
    if reflectance == 1:
        assert r_e + (1 - r_e) ** 2 * body.body_albedo(1.0, n) == pytest.approx(1, rel=1e-12)


@COMBINATIONS
def test_published_values(kind, facets):
    """To the five digits given, with many nodes; with those of the model to .2 %."""
    alpha = 0.35 if kind is Gaussian else 0.5
    for n, expected in zip((1.0, 1.5), VALUES[kind, facets]):
        for rule, tolerance in (((64, 32), 2e-4), (RULE, 2e-3)):
            found = [body.body_integral(kind(alpha, alpha), facets(), n, *pair(*w), *rule)[0] for w in PAIRS]
            assert found == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("masked, expected", list(zip(PAIRS, (0.0127324, 4.878e-6, 0.110625, 0.00347405))), ids=str)
def test_published_values_of_the_interface(masked, expected):
    i, o = pair(*masked)
    found = body.interface(Beckmann(0.5, 0.5), SmithFacets(), 1.5, i, o) / o.z
    assert found[0] == pytest.approx(expected, rel=1e-4)


@COMBINATIONS
@pytest.mark.parametrize("n", [1.0, 1.5])
def test_smooth_facets_are_one_facet(kind, facets, n):
    """I = T(i) T(o), but for the square of alpha: of slopes, and of what they do to T, below 10 over cos^2."""
    i, o = (llvm.Array3f64(directions(np.random.default_rng(k), 200, lowest=0.1)) for k in (1, 2))
    found = body.body_integral(kind(2e-4, 2e-4), facets(), n, i, o, *RULE)
    np.testing.assert_allclose(found, body.transmitted_twice(i.z, o.z, n), rtol=2e-3)


@COMBINATIONS
@pytest.mark.parametrize("alphas", [(0.4, 0.4), (0.3, 0.8)], ids=str)
def test_reciprocal_and_alike_under_its_symmetries(kind, facets, alphas):
    """To rounding, and to the node opposite the more grazing direction, which is 1e-10 off it."""
    i, o = (llvm.Array3f64(directions(np.random.default_rng(k), 200)) for k in (3, 4))
    there, back = (body.body_integral(kind(*alphas), facets(), 1.5, *w, *RULE) for w in ((i, o), (o, i)))
    np.testing.assert_allclose(there, back, rtol=1e-10)
    swapped = [llvm.Array3f64(w.y, w.x, w.z) for w in (i, o)]
    np.testing.assert_allclose(
        body.body_integral(kind(*alphas[::-1]), facets(), 1.5, *swapped, *RULE), there, rtol=1e-10
    )
    if alphas[0] == alphas[1]:
        sin, cos = np.sin(0.7), np.cos(0.7)
        turned = [llvm.Array3f64(w.x * cos - w.y * sin, w.x * sin + w.y * cos, w.z) for w in (i, o)]
        np.testing.assert_allclose(body.body_integral(kind(*alphas), facets(), 1.5, *turned, *RULE), there, rtol=1e-10)


def test_plain_floats_are_as_good():
    i, o = (dr.normalize(dr.scalar.Array3f64(*w)) for w in ((0.3, 0.2, 0.7), (-0.6, 0.4, 0.2)))
    for distribution in (GGX(0.4, 0.2), Beckmann(0.4, 0.2), Gaussian(0.4, 0.2)):
        arrays = type(distribution)(llvm.Float64(0.4), llvm.Float64(0.2))
        for f, rule in ((body.body_integral, (4, 8)), (body.interface, ())):
            found = f(distribution, CavityFacets(), 1.5, i, o, *rule)
            expected = f(arrays, CavityFacets(), float64(1.5), llvm.Array3f64(i), llvm.Array3f64(o), *rule)
            assert found == pytest.approx(expected[0], rel=1e-12)
