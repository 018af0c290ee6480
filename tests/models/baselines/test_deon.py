"""Shares of grains and base against integrals over heights."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.models.baselines.deon import base_share, grain_share
from asperity.models.micrograin.grains import density

NODES = np.polynomial.legendre.leggauss(400)
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


@pytest.mark.parametrize("slopes", [0.0, 0.3, 5.0, 400.0])
@pytest.mark.parametrize("tau_0", [1e-6, 0.01, 0.3, 0.97])
def test_shares_are_integrals_over_heights(tau_0, slopes):
    """Quantiles u above 1 - tau_0 belong to grains; what blocks the base's light is above w = 1 - tau_0."""
    nodes, weights = NODES
    u = 1 - tau_0 * (1 - nodes) / 2
    grains, base = (weights * u**slopes).sum() / 2 * tau_0, (1 - tau_0) ** (1 + slopes)
    for number in (llvm.Float, llvm.Float64):
        depth = dr.pi * density(number(tau_0))
        # exp(-depth slopes) amplifies the rounding of depth
        tolerance = FLOAT32 * (1 + slopes * -np.log1p(-tau_0))
        assert grain_share(depth, number(slopes))[0] == pytest.approx(grains, rel=tolerance)
        assert base_share(depth, number(slopes))[0] == pytest.approx(base, rel=tolerance, abs=1e-37)


@pytest.mark.parametrize("tau_0", [0.0, 1e-5, 0.4, 1.0])
def test_grains_and_base_are_all_that_is_seen(tau_0):
    """d'Eon's shares, along one direction and without masking among the grains, sum to 1."""
    depth, slopes = dr.pi * density(llvm.Float(tau_0)), llvm.Float(0, 0.5, 30, 500)
    seen = (1 + slopes) * grain_share(depth, slopes) + base_share(depth, slopes)
    assert np.allclose(seen, 1, atol=1e-6)
