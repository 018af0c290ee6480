"""The quadrature over grooves of independent tilts."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import cosine_directions

from asperity.microfacet.distributions import GGX, Beckmann
from asperity.models.vgroove import nonsymmetric
from asperity.models.vgroove.bounces import needed_bounces_nonsymmetric
from asperity.models.vgroove.kaleidoscope import Pair
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

    default, fine, exact = value(nonsymmetric.NODES[kind]), value((32, 16, 48)), value((64, 32, 200))
    default, fine, exact = (one[exact > 1e-3] for one in (default, fine, exact))
    assert np.abs(fine / exact - 1).mean() < 1e-4
    error = np.abs(default / exact - 1)
    assert error.mean() < 2e-3 and np.quantile(error, 0.95) < 1e-2
