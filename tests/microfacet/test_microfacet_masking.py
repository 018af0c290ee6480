"""Masking and shadowing: of V-cavities by what is seen of them, of Smith by what is known."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import directions
from normals import hemisphere, mean

from asperity.microfacet import masking
from asperity.microfacet.distributions import DISTRIBUTIONS, Gaussian

N = 1 << 17
TOWARDS = [(0.0, 0.0, 1.0), (0.6, 0.3, 0.5), (-0.9, 0.5, 0.01), (0.1, -1.0, 0.3)]
CASES = pytest.mark.parametrize("w", [np.array(w) / np.linalg.norm(w) for w in TOWARDS], ids=str)
KINDS = pytest.mark.parametrize("kind", [*DISTRIBUTIONS.values(), Gaussian])
ALPHAS = 0.2, 0.6


@KINDS
@CASES
def test_what_is_seen_of_cavities_fills_the_view(kind, w):
    """int D <w.m> G1 dm = cos, in each cavity exactly: only the quadrature of D is left, 1e-6 (Gaussian: 2e-4)."""
    (m, angle), w = hemisphere(*ALPHAS), llvm.Array3f64(w)
    distribution = kind(*ALPHAS)
    seen = distribution.density(m) * masking.cavity_visible(dr.dot(w, m), w.z, m.z)
    assert mean(seen, angle) == pytest.approx(w.z[0], rel=2e-4 if kind is Gaussian else 1e-6)
    assert mean(masking.cavity_visible_density(distribution, w, m), angle) == pytest.approx(1, abs=1e-6)


@KINDS
@CASES
def test_visible_normals_follow_their_density(kind, w):
    """Moments, by their standard errors; what is left of the choice is uniform, and knows nothing of the normal."""
    rng, distribution, w = np.random.default_rng(9), kind(*ALPHAS), llvm.Array3f64(w)
    numbers = (llvm.Float64(rng.random(N)) for _ in range(3))
    drawn, left = masking.sample_cavity_visible_normal(distribution, w, *numbers)
    assert dr.all(dr.dot(w, drawn) > 0)
    m, angle = hemisphere(*ALPHAS)
    weight = np.asarray(masking.cavity_visible_density(distribution, w, m)) * angle
    for moment in (lambda x, y, z: x, lambda x, y, z: y, lambda x, y, z: x * x, lambda x, y, z: z):
        found, expected = moment(*np.array(drawn)), (moment(*np.asarray(m)) * weight).sum()
        assert found.mean() == pytest.approx(expected, abs=5 * found.std() / N**0.5)
    left = np.array(left)
    assert np.abs(np.sort(left) - (np.arange(N) + 0.5) / N).max() * N**0.5 < 2.23  # Kolmogorov and Smirnov, 1 in 10 000
    assert np.abs(np.corrcoef([left, *np.array(drawn)])[0, 1:]).max() < 5 / N**0.5


def test_both_directions_meet_torrance_and_sparrow():
    """G = min(1, 2 m_z i_z / i.m, 2 m_z o_z / o.m) where both face the facet, 0 elsewhere; twice the same is one."""
    rng = np.random.default_rng(4)
    i, o, m = (directions(rng, 10_000) for _ in range(3))
    facing_i, facing_o = (i * m).sum(0), (o * m).sum(0)
    g = np.minimum(1, 2 * m[2] * np.minimum(i[2] / facing_i, o[2] / facing_o)) * ((facing_i > 0) & (facing_o > 0))
    found = np.array(masking.cavity_visible_and_lit(*(llvm.Float64(x) for x in (facing_i, facing_o, i[2], o[2], m[2]))))
    np.testing.assert_allclose(found, facing_i * facing_o * g, atol=1e-15)
    assert 0.1 < (found == 0).mean() < 0.9
    one = masking.cavity_visible(*(llvm.Float64(x) for x in (facing_i, i[2], m[2])))
    same = masking.cavity_visible_and_lit(*(llvm.Float64(x) for x in (facing_i, facing_i, i[2], i[2], m[2])))
    np.testing.assert_allclose(same, np.array(one) * np.maximum(facing_i, 0), atol=1e-15)


def test_smith_of_two_directions():
    """What is known of both adds up: at most the more hidden of them; at least as if neither knew of the other."""
    i, o = llvm.Float64(0, 0.5, 2, 3), llvm.Float64(0.7, 0.5, 0, 1)
    one, separable = dr.minimum(masking.smith_masking(i), masking.smith_masking(o)), masking.smith_separable(i, o)
    height = masking.smith_height_correlated(i, o)
    same, turned = (masking.smith_direction_correlated(i, o, angle) for angle in (0, np.pi))
    np.testing.assert_allclose(separable, [1 / 1.7, 1 / 2.25, 1 / 3, 1 / 8])
    np.testing.assert_allclose(height, [1 / 1.7, 1 / 2, 1 / 3, 1 / 5])
    np.testing.assert_allclose(same, one)
    np.testing.assert_allclose(turned, [1 / 1.7, 1 / 1.96634, 1 / 3, 1 / 4.93268], rtol=1e-5)
    assert dr.all((separable <= height) & (height <= turned) & (turned <= same))


def test_the_azimuth_between_directions():
    i, o = llvm.Array3f([1, 1, 0, 0.5], [0, 0, 0, 0.5], [1, 1, 1, 0.5]), llvm.Array3f([0, -1, 1, -1], [2, 0, 0, 0], 1)
    dr.enable_grad(i, o)
    azimuth = masking.azimuth_between(i, o)
    np.testing.assert_allclose(azimuth, [np.pi / 2, np.pi, 0, 0.75 * np.pi], rtol=1e-6)
    np.testing.assert_allclose(masking.azimuth_between(o, i), azimuth)
    dr.backward(azimuth)
    assert np.isfinite(dr.grad(i)).all() and np.isfinite(dr.grad(o)).all()
