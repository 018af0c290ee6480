"""The quadrature over grooves of independent tilts."""

import asperity  # noqa: F401  isort: skip
from itertools import pairwise

import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import cosine_directions

from asperity.microfacet.distributions import GGX, Beckmann
from asperity.microfacet.quadrature import gauss_legendre
from asperity.models.vgroove import nonsymmetric
from asperity.models.vgroove.bounces import needed_bounces_nonsymmetric
from asperity.models.vgroove.kaleidoscope import Groove, Pair, bounces, entrance, exit_angle
from asperity.models.vgroove.tilts import Tilts


@pytest.mark.parametrize("alpha", [0.15, 0.5, 1.0])
@pytest.mark.parametrize("kind", [GGX, Beckmann])
def test_nonsymmetric_quadrature(monkeypatch, kind, alpha):
    """Mean error of the default under .2 %, and convergence: many nodes are exact to 1e-4."""
    rng, most = np.random.default_rng(4), llvm.UInt(needed_bounces_nonsymmetric(kind, alpha))
    i, o = (llvm.Array3f64(cosine_directions(rng, 4000)) for _ in range(2))
    pair = Pair.of(i, o)
    tilts = Tilts.along(kind(alpha, alpha), pair.cos_azimuth, pair.sin_azimuth)

    def value(nodes):
        monkeypatch.setitem(nonsymmetric.NODES, kind, nodes)
        return np.asarray(nonsymmetric.nonsymmetric(pair, i.z, tilts, most, None)[1])

    default, fine, exact = value(nonsymmetric.NODES[kind]), value((16, 48)), value((32, 200))
    default, fine, exact = (one[exact > 1e-3] for one in (default, fine, exact))
    assert np.abs(fine / exact - 1).mean() < 1e-4
    error = np.abs(default / exact - 1)
    assert error.mean() < 2e-3 and np.quantile(error, 0.95) < 1e-2


def test_two_bounces_are_smooth_between_their_kinks():
    """Eight Gauss nodes in each piece are as good as 10 000 steps, each of whose kinks leaves step^2 / 8 at most."""
    rng, n, steps = np.random.default_rng(5), 200, 10_000
    p, q = (llvm.Float64(x) for x in (rng.uniform(-1.5, 1.5, n), rng.uniform(0, 1.5, n)))

    def integral(begin, length, nodes, weights):
        p_, q_, begin, length = (dr.repeat(x, len(nodes)) for x in (p, q, begin, length))
        way = nonsymmetric.Way(llvm.UInt(2), llvm.Bool(False), p_, q_)
        r = begin + length * dr.tile(llvm.Float64(nodes), n)
        width = nonsymmetric.Width.of(way)(dr.sincos(way.first_tilt(r)), dr.sincos(r))
        return np.array(dr.block_sum(width * length * dr.tile(llvm.Float64(weights), n), len(nodes)))

    way = nonsymmetric.Way(llvm.UInt(2), llvm.Bool(False), p, q)
    low, extent = way.interval()
    ends = way.kinks(low, low + extent)
    pieces = sum(integral(begin, end - begin, *gauss_legendre(8)) for begin, end in pairwise(ends))
    even = integral(low, extent, (np.arange(steps) + 0.5) / steps, np.full(steps, 1 / steps))
    assert np.abs(pieces - even).max() < 3 * (np.pi / 2 / steps) ** 2 / 8 and (even > 0.01).mean() > 0.2


def test_ways():
    """The closed form is the kaleidoscope's own search, in double precision but for the fast functions' 1e-6 a bounce.

    Rays that meet a rim to that precision, a few in a million, may bounce once more or less.
    """
    rng, n, most = np.random.default_rng(6), 100_000, llvm.UInt(40)
    slopes = [rng.uniform(0.05, 1.5, n) * np.tan(1.57 * rng.random(n)) for _ in range(2)]
    l, r, psi, u = (llvm.Float64(x) for x in (*np.arctan(slopes), np.arcsin(rng.uniform(-1, 1, n)), rng.random(n)))
    offset, swap = entrance(groove := Groove(l, r), psi, u)
    groove, turned = groove.swapped(swap), dr.select(swap, -psi, psi)
    k = bounces(groove, turned, offset, most)
    tilts = [dr.sincos(angle) for angle in (psi, l, r)]
    found_swap, found_k, exits = nonsymmetric.nonsymmetric_way(*tilts, u, most)
    same = np.array(k) == np.array(found_k)
    assert np.array_equal(np.array(swap), np.array(found_swap)) and (~same).sum() <= 3
    error = np.abs(np.array(exits) - np.array(dr.sincos(exit_angle(groove, turned, k)))).max(0)
    assert (error / np.array(k))[same & (np.array(k) <= 40)].max() < 2e-6
