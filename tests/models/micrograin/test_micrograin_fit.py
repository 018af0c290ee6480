"""The script that makes the rule of heights."""

import numpy as np

from asperity.microfacet.quadrature import gauss_legendre
from asperity.models.micrograin import fit
from asperity.models.micrograin.diffuse import HEIGHTS


def test_heights(monkeypatch):
    """Six fitted nodes are better than six of Gauss, by the norm that is fitted; the rule in diffuse.py is good.

    That of inputs half of which are grazing: .5 % at 99.5 % when it was made, of 24 000.
    """
    monkeypatch.setattr(fit, "INPUTS", 300)
    integrands = fit.Integrands(np.random.default_rng(3))
    errors = [integrands.errors(*rule) for rule in (fit.fitted(integrands, 6), map(np.array, gauss_legendre(6)))]
    means = [(error**12).mean() ** (1 / 12) for error in errors]
    assert means[0] < 0.5 * means[1]
    t = np.cbrt(1 - np.array(HEIGHTS[0]))
    assert np.quantile(integrands.errors(t, np.array(HEIGHTS[1]) / (3 * t * t)), 0.99) < 5e-3


def test_slopes():
    """Cubics through values of a cubic are that cubic."""
    integrands = object.__new__(fit.Integrands)
    grid = np.linspace(0, 1, fit.GRID + 1)
    integrands.values = np.stack([grid**3, 1 - grid], axis=1)
    t = np.array([0.001, 0.3, 0.77])
    value, slope = integrands.at(t)
    assert np.allclose(value, np.stack([t**3, 1 - t], axis=1)) and np.allclose(slope[:, 0], 3 * t * t)
