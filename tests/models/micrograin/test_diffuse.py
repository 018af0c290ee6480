"""The quadrature over Lambertian grains."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import drjit.scalar as scalar
import numpy as np
import pytest
from helpers import directions, unit

from asperity.models.micrograin.coat import Coat, fit
from asperity.models.micrograin.diffuse import Facet, lambertian
from asperity.models.micrograin.grains import Grains, SecondColour
from asperity.models.micrograin.shadows import Shadows, shadow

HEIGHTS, AZIMUTHS = 96, 1024


def reference(grains, wi, wo, facet):
    """(first, second, pdf) of `lambertian` in double precision: many heights, crowded at the top, and whole rings."""
    t, weights = np.polynomial.legendre.leggauss(HEIGHTS)
    h, weights = 1 - ((1 - t) / 2) ** 3, 1.5 * ((1 - t) / 2) ** 2 * weights
    tau_0, *betas = (np.array(x) for x in (grains.tau_0, grains.beta_x, grains.beta_y))
    stretch = np.array([*betas, np.ones_like(tau_0)])
    x = 2 * np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS
    i, o = (stretch * w / np.linalg.norm(stretch * w, axis=0) for w in (wi, wo))
    shadows, i_only = Shadows(llvm.Array3f64(i), llvm.Array3f64(o)), llvm.Array3f64(i)
    r, found = np.array(grains.r), np.zeros((3, len(tau_0)))
    for height, weight in zip(h, weights):
        ring = np.stack([np.sqrt(1 - height**2) * np.cos(x), np.sqrt(1 - height**2) * np.sin(x), height + 0 * x])
        m = stretch[:, :, None] * ring[:, None]
        length = np.linalg.norm(m, axis=0)
        cos_i, cos_o = (np.maximum(np.einsum("cl,clx->lx", w, m), 0) / length for w in (wi, wo))
        # (i'.m') (E o.m') / |E m'|
        lit = cos_i * length / np.linalg.norm(stretch * wi, axis=0)[:, None] * cos_o
        through = lit
        if facet.coat:
            through = (
                lit
                * fresnel_through(cos_i, float(np.ravel(facet.coat.eta)[0]))
                * fresnel_through(cos_o, float(np.ravel(facet.coat.eta)[0]))
            )
        share = 0
        if facet.second:
            share = height if facet.second.by_height else (1 + (0.8 * m[0] + 0.6 * m[1]) / length) / 2
        disc = np.pi * (1 - height**2)
        exposed, visible = (
            weight * np.exp(-r * (disc + np.array(area)))
            for area in (shadows.union(llvm.Float64(height)), shadow(i_only, llvm.Float64(height)))
        )
        rings = [(through * (1 - share)).mean(-1), (through * share).mean(-1), lit.mean(-1)]
        found = found + np.stack([exposed, exposed, visible]) * rings
    return found * 2 * r / i[2]


def fresnel_through(cos, eta):
    """1 - F, from the two amplitudes."""
    inside = np.sqrt(np.maximum(1 - (1 - cos**2) / eta**2, 0))
    s, p = (cos - eta * inside) / (cos + eta * inside), (inside - eta * cos) / (inside + eta * cos)
    return np.where(inside > 0, 1 - (s * s + p * p) / 2, 0)


FACETS = {
    "plain": Facet(),
    "by height": Facet(SecondColour()),
    "by normal": Facet(SecondColour(0.8, 0.6)),
    "coated": Facet(SecondColour(), Coat(1.5)),
}
FITTED = FACETS | {f"fitted {eta}": Facet(SecondColour(), Coat(eta, "fit")) for eta in (1.2, 2.5)}


@pytest.mark.parametrize("isotropic", [True, False], ids=["isotropic", "anisotropic"])
@pytest.mark.parametrize("facet", FITTED)
def test_quadrature(rgb, facet, isotropic):
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
    exact = reference(grains(llvm.Float64), i, o, facet)
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
