"""Pores against points counted in them, and at both ends of their depth."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import values

from asperity.lab import evaluate
from asperity.microfacet.ggx import GRAZING
from asperity.models.baselines.merillou import SHALLOW, lit_and_visible

N = 1 << 14
WHITE = {"type": "diffuse", "reflectance": 1.0}
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


def lit_by_counting(a, b, n=2000):
    x = (np.arange(n) + 0.5) / n * 2 - 1
    within = [(x[:, None] - c[0]) ** 2 + (x[None, :] - c[1]) ** 2 <= 1 for c in ((0, 0), a, b)]
    return np.logical_and.reduce(within).sum() * (2 / n) ** 2 / np.pi


@pytest.mark.parametrize("vector", [llvm.Array2f, llvm.Array2f64])
def test_lit_and_visible_part_of_a_pore_is_what_points_count(vector):
    """2000² points: the outline crosses 10^4 cells at most; if each errs by half at random, that is 1.6e-5 of pi."""
    rng = np.random.default_rng(2)
    pairs = [scale * rng.normal(size=(2, 2)) for scale in (0.1, 0.4, 0.7, 1.0, 3.0) for _ in range(6)]
    a, b = np.array([0.4, -0.7]), np.array([0.9, 0.0])
    pairs += [(a, a), (0 * a, a), (0 * a, 0 * a), (a, -a), (a, 1.2 * a), (b, -b), (2.47 * a, a), (a, a + 1e-7)]
    for i, o in pairs:
        one, other = (vector(*map(float, w)) for w in (i, o))
        area = lit_and_visible(one, other)[0]
        assert area == pytest.approx(lit_by_counting(i, o), abs=6e-5)
        assert area == pytest.approx(lit_and_visible(other, one)[0], abs=1e-6)


def test_shallow_pores_hide_nothing(rgb):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (3, 4))
    pores = {"type": "merillou", "tau_0": 0.4, "base": WHITE}
    shallow = values({**pores, "depth": 0.0}, wi, wo, component=1)
    # Depth 0 stands for SHALLOW: discs apart by d have 1 - 2 d / pi in common. Directions are lifted to the cosine
    # GRAZING alpha, with an alpha of .88 here.
    hidden = 2 / np.pi * SHALLOW * sum(1 / np.maximum(np.array(w.z), 0.88 * GRAZING) for w in (wi, wo))
    flat = 0.6 * values(WHITE, wi, wo)
    assert (np.abs(shallow - flat) <= (hidden + FLOAT32) * flat + 1e-6).all()


def test_deep_pores_hide_all(rgb):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (3, 4))
    deep = values({"type": "merillou", "tau_0": 0.4, "depth": 1000.0, "base": WHITE}, wi, wo, component=1)
    assert not deep[:, np.array(wi.z) < 0.999].any()
