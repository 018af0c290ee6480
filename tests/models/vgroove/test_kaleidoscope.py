"""Bounces between two facets against rays traced between two line segments."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.models.vgroove import kaleidoscope
from asperity.models.vgroove.kaleidoscope import Groove, bounces, entrance, exit_angle, leaving_share, symmetric_way


def trace(tilt_l, tilt_r, psi, rays=1000):
    """Bounces and exit angles of rays that meet the left facet first, by reflecting them between two line segments.

    Stratified over the part of the facet that the other one does not shade.
    """
    along = np.array([[-np.cos(tilt_l), np.cos(tilt_r)], [np.sin(tilt_l), np.sin(tilt_r)]])  # from the apex upwards
    lengths, normals = 1 / along[1], np.array([[np.sin(tilt_l), -np.sin(tilt_r)], [np.cos(tilt_l), np.cos(tilt_r)]])
    offset = (np.arange(rays) + 0.5) / rays * lengths[0]
    place, to = along[:, :1] * offset, -np.tile([[np.sin(psi)], [np.cos(psi)]], rays)
    lit = np.full(rays, to[:, 0] @ normals[:, 0] < -1e-9)  # not along it, but for rounding
    lit &= ~(_distance(place, -to, along[:, 1], lengths[1]) < np.inf)
    count, facet = np.zeros(rays, int), np.zeros(rays, int)
    going = lit.copy()
    while going.any():
        n = normals[:, facet]
        to = np.where(going, to - 2 * (to * n).sum(0) * n, to)
        count = count + going
        facet = np.where(going, 1 - facet, facet)
        distance = np.where(facet == 0, *(_distance(place, to, along[:, m], lengths[m]) for m in (0, 1)))
        going &= distance < np.inf
        place = np.where(going, place + np.where(going, distance, 0) * to, place)
    return count, np.arctan2(to[0], to[1])


def _distance(place, to, along, length):
    """Distance to a segment from the origin, infinite where it is missed."""
    across = to[0] * along[1] - to[1] * along[0]
    distance = (along[0] * place[1] - along[1] * place[0]) / np.where(across == 0, 1e-300, across)
    met = place + distance * to
    s = met[0] * along[0] + met[1] * along[1]
    return np.where((distance > 1e-12) & (s > 0) & (s < length), distance, np.inf)


@pytest.mark.parametrize("tilts", [(20, 20), (46, 46), (62, 62), (75, 75), (84, 84), (15, 50), (70, 35), (80, 60)])
def test_kaleidoscope_equals_traced_rays(tilts):
    """Table 1 found .003 at most. 1000 strata miss each limit of a share by .0005 at most, and those add up."""
    left, right = np.radians(tilts)
    groove = Groove(llvm.Float64(left), llvm.Float64(right))
    for psi in np.radians(np.arange(-85.0, 86.0, 10.0)):
        count, exits = trace(left, right, psi)
        if np.cos(psi - left) < 1e-9:
            assert not count.any()
            continue
        shares = [float(leaving_share(groove, llvm.Float64(psi), k)[0]) for k in range(1, 40)]
        assert np.abs(np.bincount(count, minlength=40)[1:40] / count.size - shares).sum() < 3e-3
        for k in set(count) - {0}:
            exact = float(exit_angle(groove, llvm.Float64(psi), llvm.UInt(int(k)))[0])
            assert np.abs(exits[count == k] - exact).max() < 1e-9
        assert sum(shares) == pytest.approx(masking(left, right, psi), abs=1e-12)
        lit = count > 0
        distance = (np.arange(count.size) + 0.5) / count.size / np.sin(left)  # from the apex, along the facet
        offset = llvm.Float64((distance * np.cos(psi - left))[lit])
        psis = llvm.Float64(np.full(lit.sum(), psi))
        k = np.asarray(bounces(groove, psis, offset, llvm.UInt(60)))
        assert (k != count[lit]).mean() < 2e-3  # rays that meet a rim


@pytest.mark.parametrize("tilt", [0.1, 10, 46, 75, 89])
def test_closed_forms_of_equal_facets_are_the_general_ones(tilt):
    """To 1e-6 of an angle, which counts bounces otherwise of one ray in 10^4 where there are 100 of them."""
    rng, n, most = np.random.default_rng(0), 100_000, llvm.UInt(200)
    psi, u = llvm.Float64(np.arcsin(rng.uniform(-1, 1, n))), llvm.Float64(rng.random(n))
    groove = Groove(*[llvm.Float64(np.radians(tilt))] * 2)
    offset, swap = entrance(groove, psi, u)
    psi_seen = dr.select(swap, -psi, psi)
    k = bounces(groove.swapped(swap), psi_seen, offset, most)
    out = exit_angle(groove, psi_seen, k)
    found_swap, found_k, (sin, cos) = symmetric_way(dr.sincos(psi), dr.sincos(groove.tilt_l), u, most)
    same = k == found_k
    assert dr.all(swap == found_swap) and np.array(same).mean() > 1 - 2e-4
    error = dr.abs(dr.sin(out) - sin) + dr.abs(dr.cos(out) - cos)
    assert dr.max(dr.select(same, error, 0))[0] < 1e-6 * dr.max(llvm.Float64(k))[0]


def test_the_kaleidoscope_needs_its_clamps(monkeypatch):
    """Eq. 6 as printed lets an image reflect that the ray runs away from, at a negative offset."""

    def as_printed(groove, psi, m):
        tilt = dr.select(m % 2 == 1, groove.tilt_l, groove.tilt_r)
        return dr.sin(kaleidoscope.meeting_angle(groove, psi, m)) / dr.sin(tilt)

    left, right = np.radians((80, 60))
    groove, psis = Groove(llvm.Float64(left), llvm.Float64(right)), np.radians(np.arange(-85.0, 86.0, 10.0))

    def error():
        traced = [np.bincount(trace(left, right, psi)[0], minlength=40)[1:40] / 1000 for psi in psis]
        shares = [[float(leaving_share(groove, llvm.Float64(psi), k)[0]) for k in range(1, 40)] for psi in psis]
        return np.abs(np.subtract(traced, shares)).sum(1).max()

    assert error() < 3e-3
    monkeypatch.setattr(kaleidoscope, "reach", as_printed)
    assert error() > 0.1


def masking(left, right, psi):
    """G1: share of the left facet that the right one does not shade, of equal depth."""
    shaded = max(0.0, np.sin(psi + right - np.pi / 2) / np.sin(right))
    return max(0.0, 1 - shaded * np.sin(left) / np.cos(psi - left))
