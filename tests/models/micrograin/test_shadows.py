"""Shadows against what rays see, and exact identities."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import drjit.scalar as scalar
import numpy as np
import pytest
from helpers import directions, unit
from hypothesis import given
from hypothesis import strategies as st

from asperity.models.micrograin.shadows import Shadows, shadow


def families(rng, n):
    """Pairs of directions, most of them awkward; unit vectors after rounding to float32."""
    i = directions(rng, n)
    o = directions(rng, n)
    upright = np.array([[0], [0], [1]]) + 0 * i
    pairs = {
        "random": (i, o),
        "same": (i, i),
        "opposite": (i, i * np.array([[-1], [-1], [1]])),
        "o upright": (i, upright),
        "both upright": (upright, upright),
        **{f"apart by {d:g}": (i, unit(i + d * rng.normal(size=i.shape))) for d in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)},
        "apart in z alone": (i, i + np.array([[0], [0], [3e-7]])),
    }
    return {name: tuple(np.float32(w).astype(float) for w in pair) for name, pair in pairs.items()}


def area_by_counting(i, o, h, n=1500):
    """Area of the union of the shadows, by ray casting from a grid on the plane: the definition, not the formula.

    A point outside the disc is shaded along w if the ray from it in direction w hits the unit sphere.
    """
    half = 1 + max(abs(np.r_[i[:2] / i[2], o[:2] / o[2]]))
    x = (np.arange(n) + 0.5) / n * 2 * half - half
    p = np.stack(np.broadcast_arrays(x[:, None], x[None, :], h))
    free = (p * p).sum(0) > 1
    shaded = np.zeros_like(free)
    for w in (i, o):
        along = -np.tensordot(w, p, 1)  # distance to the closest approach
        shaded |= (along > 0) & ((p * p).sum(0) - along**2 < 1)
    return (free & shaded).sum() * (2 * half / n) ** 2


def test_union_of_shadows_is_what_rays_see():
    """1500² points resolve an area to about its outline times a cell's width over the root of the cells it crosses."""
    rng = np.random.default_rng(3)
    for i, o, h in zip(directions(rng, 12, 0.3).T, directions(rng, 12, 0.3).T, rng.uniform(0, 0.9, 12)):
        union = Shadows(llvm.Array3f64(*map(float, i)), llvm.Array3f64(*map(float, o))).union(llvm.Float64(h))
        assert float(union[0]) == pytest.approx(area_by_counting(i, o, h), abs=0.01)


def test_outlines_cross_on_both_cylinders():
    """Where they cross within both shadows: p.i = p.o < 0 and |p|^2 - (p.i)^2 = 1, and either finds the same point."""
    rng = np.random.default_rng(4)
    i, o = directions(rng, 4000, 0.05), directions(rng, 4000, 0.05)
    h = rng.uniform(0, 1, 4000)
    shadows = Shadows(llvm.Array3f64(i), llvm.Array3f64(o))
    points, inside = [], np.ones(4000, bool)
    cos_sum = dr.minimum(shadows.level * llvm.Float64(h), 1)
    for (w, other), cut in zip(((i, o), (o, i)), shadows.at(llvm.Float64(h))):
        cos_psi, sin_psi = (np.array(x) for x in cut.crossing(cos_sum, dr.safe_sqrt(1 - cos_sum**2)))
        along, across = unit(w[:2]), unit(np.stack([-w[1], w[0]]))
        across = -across * np.sign((across * other[:2]).sum(0))  # the other shadow lies opposite to its direction
        s = np.hypot(*w[:2])
        p = np.concatenate([(h * s - cos_psi) / w[2] * along + sin_psi * across, [h]])
        inside &= np.abs(sin_psi) < 0.999 * np.array(cut.sin_alpha)
        points.append(p)
    p, q = (point[:, inside] for point in points)
    i, o = i[:, inside], o[:, inside]
    t = (p * i).sum(0)
    assert inside.sum() > 500 and (t < 0).all()
    assert np.abs(p - q).max() < 1e-6 and np.abs(t - (p * o).sum(0)).max() < 1e-6
    assert np.abs((p * p).sum(0) - t * t - 1).max() < 1e-6


def directions_of_floats():
    """Unit vectors above the horizon, as plain floats in double precision."""
    angles = st.tuples(st.floats(0, 1.55), st.floats(-3.2, 3.2))
    return angles.map(lambda a: np.array([np.sin(a[0]) * np.cos(a[1]), np.sin(a[0]) * np.sin(a[1]), np.cos(a[0])]))


@given(i=directions_of_floats(), o=directions_of_floats(), h=st.floats(0, 1))
def test_a_union_is_between_the_larger_shadow_and_the_sum(i, o, h):
    """On plain floats: the formulas ask for no array type."""
    i, o = (scalar.Array3f64(*map(float, w)) for w in (i, o))
    sigma_i, sigma_o, union = shadow(i, h), shadow(o, h), Shadows(i, o).union(h)
    rounding = 1e-6 * (1 + sigma_i + sigma_o)
    assert max(sigma_i, sigma_o) - rounding <= union <= sigma_i + sigma_o + rounding


@pytest.mark.parametrize("family", families(np.random.default_rng(0), 2))
@pytest.mark.parametrize("height", ["random", 0.0, 1.0])
def test_float32_masking_and_its_gradients(family, height):
    """Measured at most 6e-5 (pairs 1e-3 apart, at cosines of 0.01); gradients finite everywhere."""
    rng = np.random.default_rng(0)
    i, o = families(rng, 20_000)[family]
    above = o[2] >= 0.01
    h = np.float32(rng.uniform(0, 1, i.shape[1]) if height == "random" else np.full(i.shape[1], height))
    exact = dr.exp(-0.3 * Shadows(llvm.Array3f64(i), llvm.Array3f64(o)).union(llvm.Float64(h)))
    i, o, h = llvm.Array3f(i), llvm.Array3f(o), llvm.Float(h)
    dr.enable_grad(i, o, h)
    masking = dr.exp(-0.3 * Shadows(i, o).union(h))
    dr.backward(dr.sum(masking))
    assert np.abs(np.asarray(masking) - np.asarray(exact))[above].max() < 1e-4
    assert all(np.isfinite(np.asarray(dr.grad(x))).all() for x in (i, o, h))


def test_identities_of_the_masking_function():
    """Angles are polynomials, good to 7e-8 of themselves; areas are angles over cosines of 0.05 or more."""
    rng = np.random.default_rng(1)
    i, o = (llvm.Array3f64(directions(rng, 1000, 0.05)) for _ in range(2))
    h, n = llvm.Float64(rng.uniform(0, 1, 1000)), llvm.Array3f64(0, 0, 1)
    both, one = Shadows(i, o), shadow(i, h)
    assert dr.allclose(both.union(h), Shadows(o, i).union(h), atol=1e-9)  # reciprocity
    assert dr.allclose(Shadows(i, i).union(h), one, atol=1e-6)  # retro-reflection: the shadows coincide
    assert dr.allclose(Shadows(i, n).union(h), one, atol=1e-6)  # along n there is none
    assert dr.allclose(both.union(llvm.Float64(1)), 0, atol=1e-9)  # nor is there at the top
    assert dr.all(both.union(h) <= both.sum(h) + 1e-5)  # Eq. 18 is at least Eq. 17
    across = llvm.Array3f64(-i.x, -i.y, i.z)
    assert dr.allclose(Shadows(i, across).union(h), Shadows(i, across).sum(h), atol=1e-6)  # disjoint
