"""Tilts of partners: their normalisation, and their samples."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.models.vgroove.tilts import TILTS

N = 1 << 17


@pytest.mark.parametrize("kind", TILTS.values())
@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.9])
def test_partners(kind, alpha):
    """The normalisation, by quadrature, and the sampler's distribution (Kolmogorov and Smirnov, 1 in 10 000)."""
    a, tilts = (np.arange(200_000) + 0.5) / 200_000 * np.pi / 2, kind(llvm.Float64(alpha), 3)
    p = np.asarray(tilts.density(llvm.Float64(np.sin(a)), llvm.Float64(np.cos(a)))) * np.sin(a) ** 2
    assert p.mean() * np.pi / 2 == pytest.approx(float(tilts.partner()[0]), rel=1e-6)
    rng = np.random.default_rng(8)
    sin, cos = tilts.sample_partner(*(llvm.Float64(rng.random(N)) for _ in range(3)))
    drawn = np.sort(np.arctan2(np.asarray(sin), np.asarray(cos)))
    cdf = np.interp(drawn, a, np.cumsum(p) / p.sum())
    assert np.abs(cdf - (np.arange(N) + 0.5) / N).max() * N**0.5 < 2.23


@pytest.mark.parametrize("kind", TILTS.values())
@pytest.mark.parametrize("alpha", [0.001, 0.1, 0.5, 1.0])
def test_shares_of_partners(kind, alpha):
    """Closed forms of what tilts up to an angle, and beyond, make of P, to 1e-4: Phong's series at n = 0 has 4e-5."""
    steps = 100_000  # with tan a = alpha tan t
    t = (np.arange(steps) + 0.5) / steps * np.pi / 2
    a, sine, cosine = np.arctan(alpha * np.tan(t)), np.sin(t), np.cos(t)
    tilts = kind(llvm.Float64(alpha))
    p = np.asarray(tilts.density(llvm.Float64(np.sin(a)), llvm.Float64(np.cos(a)))) * np.sin(a) ** 2
    p = p / float(tilts.partner()[0]) * alpha / ((alpha * sine) ** 2 + cosine**2) * np.pi / 2 / steps
    below, beyond = np.cumsum(p) - p / 2, np.cumsum((p / np.tan(a))[::-1])[::-1] - p / np.tan(a) / 2
    single = kind(llvm.Float(alpha)).partners(llvm.Float(np.float32(np.sin(a))), llvm.Float(np.float32(np.cos(a))))
    assert np.asarray(single[0]) == pytest.approx(below, abs=1e-4)
    assert np.asarray(single[1]) == pytest.approx(beyond, abs=1e-4 * beyond[0])


@pytest.mark.parametrize("kind", TILTS.values())
def test_derivatives_of_level_and_steep_facets_are_finite(kind):
    """Backwards, where the infinite slope of a root would meet a factor of 0."""
    alpha = llvm.Float(0.5)
    dr.enable_grad(alpha)
    flatter, beyond = kind(alpha).partners(llvm.Float(0, 1e-20, 1), llvm.Float(1, 1, 0))
    dr.backward(dr.sum(0.3 * flatter + 0.7 * beyond))  # whole factors leave exact zeros, which hide it
    assert np.isfinite(dr.grad(alpha)[0])
