"""Random directions, and random numbers from others."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest
from helpers import directions

from asperity.lab.evaluate import variates
from asperity.microfacet import sampling

N = 1 << 16


def numbers(count):
    return [llvm.Float64(x) for x in np.random.default_rng(1).random((count, N))]


@pytest.mark.parametrize("number", [0.25, llvm.Float(0.25), llvm.Float64(0.25)], ids=["float", "float32", "float64"])
def test_directions_of_all_numbers(number):
    """At u = v = 1/4."""
    diagonal = -np.sqrt(1 / 8)
    for w, expected in (
        (sampling.cosine_hemisphere(number, number), [diagonal, diagonal, np.sqrt(0.75)]),
        (sampling.spherical(number, number), [0, np.sqrt(15) / 4, 0.25]),
    ):
        assert np.ravel(w) == pytest.approx(expected, abs=1e-7)
        assert type(w.x) is type(number)


def test_the_cosine_hemisphere_is_mitsubas(rgb):
    """Its middle and its edges included, so that stratified samplers are worth the same."""
    u, v = (np.r_[x, 0, 0, 0.5, 0.5].astype(np.float32) for x in np.random.default_rng(3).random((2, 10_000)))
    v[-2] = 0
    ours = np.array(sampling.cosine_hemisphere(mi.Float(u), mi.Float(v)))
    theirs = np.array(mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, v)))
    np.testing.assert_allclose(ours[:2], theirs[:2], atol=1e-6)
    np.testing.assert_allclose(ours[2] ** 2, theirs[2] ** 2, atol=1e-6)  # theirs is 1 - x^2 - y^2, rounded


def test_cosine_hemisphere():
    """E[z^2] = 1/2, E[z^4] = 1/3, and the azimuth is even: to 5 standard errors, of at most .35 / sqrt(N)."""
    w = np.array(sampling.cosine_hemisphere(*numbers(2)))
    assert [(w[2] ** 2).mean(), (w[2] ** 4).mean()] == pytest.approx([1 / 2, 1 / 3], abs=5 * 0.35 / N**0.5)
    assert np.abs(w[:2].mean(axis=1)).max() < 5 * 0.5 / N**0.5


def test_turning_about_a_normal_is_a_rotation():
    rng = np.random.default_rng(2)
    n, v, w = (llvm.Array3f64(directions(rng, 100, lowest=0)) for _ in range(3))
    assert dr.all(dr.abs(sampling.about(n, llvm.Array3f64(0, 0, 1)) - n) < 1e-12, axis=None)
    v, w, turned = sampling.about(n, v), sampling.about(n, w), (v, w)
    assert dr.all(dr.abs(dr.dot(v, w) - dr.dot(*turned)) < 1e-12)
    assert dr.all(dr.abs(dr.dot(n, v) - turned[0].z) < 1e-12)


@pytest.mark.parametrize("chance", [0.0, 0.3, 1.0])
def test_what_is_left_of_a_choice_is_uniform(chance):
    """By Kolmogorov and Smirnov, on both sides (1 in 10 000)."""
    happens, left = (np.array(x) for x in sampling.choose(numbers(1)[0], llvm.Float64(chance)))
    assert happens.mean() == pytest.approx(chance, abs=5 * 0.5 / N**0.5) and left.max() < 1
    for part in (np.sort(left[happens]), np.sort(left[~happens])):
        assert np.abs(part - (np.arange(part.size) + 0.5) / part.size).max(initial=0) * part.size**0.5 < 2.23


def test_parts_of_a_number_and_hashes_are_uniform_and_independent(rgb):
    # Mitsuba's hash with its 4 rounds had correlations of .006 here, which made a per mille of single bounces double.
    n = 2**21
    given = variates(n, 3)
    more = sampling.more_numbers(given[0], *given[1])
    for every in ([given[0], *given[1], *more], sampling.split(given[0])):
        every = np.array(every, dtype=float)
        limit = 5 / np.sqrt(n)  # 16 pairs: chance exceeds it once in 10^5
        assert np.abs(np.corrcoef(every) - np.eye(len(every))).max() < limit
        assert np.abs(every.mean(axis=1) - 0.5).max() < limit


def test_hashes_in_a_scalar_variant_are_the_same():
    mi.set_variant("llvm_ad_rgb")
    lanes = [float(x[0]) for x in sampling.more_numbers(mi.Float(0.1), mi.Float(0.2), mi.Float(0.3))]
    mi.set_variant("scalar_rgb")
    assert list(sampling.more_numbers(*(float(np.float32(x)) for x in (0.1, 0.2, 0.3)))) == lanes
