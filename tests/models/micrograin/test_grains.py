"""The grains' statistics: areas, normals, and how they are sampled."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.microfacet.ggx import normal_in_sphere_space, to_sphere
from asperity.models.lambertsphere.fit import chebyshev
from asperity.models.micrograin.grains import (
    START,
    density,
    exposure,
    sample_visible_normal,
    visible_fraction,
)
from asperity.models.micrograin.shadows import shadow

N = 1 << 17
GRAINS = [(0.37, 1.0, 1.0), (0.62, 0.8, 1.7), (0.2, 2.5, 0.6), (0.85, 0.35, 0.35), (0.05, 0.3, 3.0)]


@pytest.mark.parametrize("tau_0, beta_x, beta_y", GRAINS)
def test_visible_areas_add_up_to_one(tau_0, beta_x, beta_y):
    """tau_0 int D G1 (i.m)+ / cos_i dm = tau_i: what is seen is grain or base, exactly. Midpoint rule, good to 1e-4."""
    h, azimuth = np.meshgrid((np.arange(1000) + 0.5) / 1000, (np.arange(1000) + 0.5) / 1000 * 2 * np.pi, indexing="ij")
    r, radius = density(llvm.Float64(tau_0)), np.sqrt(1 - h * h)
    m = llvm.Array3f64((radius * np.cos(azimuth)).ravel(), (radius * np.sin(azimuth)).ravel(), h.ravel())
    for theta in np.radians([0.1, 20, 60, 85]):
        i = to_sphere(
            llvm.Array3f64(float(np.sin(theta)) * 0.8, float(np.sin(theta)) * 0.6, float(np.cos(theta))), beta_x, beta_y
        )
        seen = exposure(r, m.z, shadow(i, m.z)) * dr.maximum(dr.dot(i, m), 0) / i.z
        assert float((r * dr.mean(seen) * 2 * dr.pi)[0]) == pytest.approx(float(visible_fraction(r, i)[0]), abs=2e-4)


@pytest.mark.parametrize("tau_0, beta_x, beta_y", GRAINS)
def test_ndf_is_normalised(tau_0, beta_x, beta_y):
    """int D cos dm = 1 (Eq. 12), over the hemisphere in Gauss-Legendre squares of cos² and azimuth."""
    x, w = np.polynomial.legendre.leggauss(200)
    z = np.sqrt((x + 1) / 2)[:, None]
    azimuth = (np.arange(400) + 0.5) / 400 * 2 * np.pi
    m = np.stack(np.broadcast_arrays(np.sqrt(1 - z * z) * np.cos(azimuth), np.sqrt(1 - z * z) * np.sin(azimuth), z))
    h, d_ggx = normal_in_sphere_space(llvm.Array3f64(m.reshape(3, -1)), beta_x, beta_y)
    r = density(llvm.Float64(tau_0))
    projected = np.asarray(dr.pi * r * d_ggx * exposure(r, h, 0)).reshape(200, 400).mean(1)
    assert (w / 2 * projected).sum() * np.pi == pytest.approx(tau_0, rel=2e-3)


@pytest.mark.parametrize("r", [1e-4, 0.03, 0.3, 1.0, 2.0, 4.4])
def test_the_visible_height_is_inverted(r):
    """The CDF at the sampled height returns the random number, for all cosines and its extremes: 4.2e-5 as measured."""
    rng = np.random.default_rng(5)
    cos, azimuth = np.exp(rng.uniform(np.log(0.001), 0, N)), rng.uniform(0, 2 * np.pi, N)
    u = np.float32(
        np.clip(
            np.r_[rng.uniform(0, 1, N - 2000), 10.0 ** rng.uniform(-7, -2, 1000), np.linspace(0.999, 1, 1000)],
            0,
            1 - 6e-8,
        )
    )
    sin = np.sqrt(1 - cos * cos)
    w = llvm.Array3f(sin * np.cos(azimuth), sin * np.sin(azimuth), cos)
    h = llvm.Float64(sample_visible_normal(llvm.Float(r), w, llvm.Float(u), llvm.Float(rng.uniform(0, 1, N))).z)
    w = llvm.Array3f64(w)
    cdf = (1 - exposure(llvm.Float64(r), h, shadow(w, h))) / visible_fraction(llvm.Float64(r), w)
    assert np.abs(np.asarray(cdf) - u).max() < 5e-5


@pytest.mark.parametrize("cos", [0.001, 0.004, 0.01, 0.3, 0.9])
def test_the_visible_azimuth_is_inverted(cos):
    """The CDF at the azimuth returns the random number: two Halley steps leave 4e-5 at worst, one leaves 4e-3."""
    rng, sin = np.random.default_rng(6), float(np.sqrt(1 - cos * cos))
    w, v = llvm.Array3f(0.6 * sin, 0.8 * sin, cos), np.float32(rng.uniform(0, 1, N))
    m = np.array(sample_visible_normal(llvm.Float(0.4), w, llvm.Float(rng.uniform(0, 1, N)), llvm.Float(v)), float)
    x = np.arctan2(0.6 * m[1] - 0.8 * m[0], 0.6 * m[0] + 0.8 * m[1])
    a, b = cos * m[2], sin * np.hypot(m[0], m[1])  # of h, float32 has lost the digits
    limit = np.arccos(np.clip(-a / b, -1, 1))
    total = a * limit + b * np.sin(limit)
    cdf = (1 + (a * x + b * np.sin(x)) / total) / 2
    assert np.abs(cdf - v).max() < 4e-5


def stepped(alpha, cos, sigma):
    """Angles one Halley step nearer to where the area is sigma, and the share of what is seen that they are off.

    The worst over all r; formulas as in docs/micrograin.md, "Visible heights and azimuths".
    """
    alpha, sin = np.clip(alpha, 0, np.pi / 2), np.sqrt(1 - cos * cos)

    def area(alpha):
        h, lit = sin * np.cos(alpha), np.pi - np.arctan2(np.sin(alpha), cos * np.cos(alpha))
        return lit * (1 - h * h) + (alpha - h * sin * np.sin(alpha)) / cos

    def slope(alpha):
        h, lit = sin * np.cos(alpha), np.pi - np.arctan2(np.sin(alpha), cos * np.cos(alpha))
        return 2 * sin / cos * np.sin(alpha) * (cos * h * lit + sin * np.sin(alpha))

    error, step = area(alpha) - sigma, 1e-6
    bend = (slope(alpha + step) - slope(alpha - step)) / (2 * step)
    alpha = alpha - 2 * error * slope(alpha) / np.maximum(2 * slope(alpha) ** 2 - error * bend, 1e-20)
    whole, rs = np.pi / 2 * (1 + 1 / cos), np.geomspace(1e-4, 4.4, 25)
    steepest = np.max([r * np.exp(-r * sigma) / -np.expm1(-r * whole) for r in rs], axis=0)
    return np.abs(area(np.clip(alpha, 0, np.pi / 2)) - sigma) * steepest, area


@pytest.mark.slow
def test_heights_start_from_the_best_polynomial_of_its_form():
    """Its error, over the error that a Halley step turns into 3e-5, is as small as it can be; 3e-5 is what is left."""
    cosines = np.r_[np.geomspace(1e-3, 0.99, 60), 1 - np.geomspace(0.01, 5e-4, 8)]
    angles = np.r_[np.geomspace(1e-4, 1, 80), np.linspace(0.02, np.pi / 2, 60)]
    cos, alpha = (x.ravel() for x in np.meshgrid(cosines, angles))
    sigma = stepped(alpha, cos, 0)[1](alpha)
    nothing, whole = np.pi * cos**2, np.pi / 2 * (1 + 1 / cos)
    q = np.clip((sigma - nothing) / (whole - nothing), 1e-30, 1)
    allowed = np.full_like(alpha, 0.6)
    for error in np.geomspace(0.6, 1e-4, 60):
        worst = np.maximum(*(stepped(alpha + sign * error, cos, sigma)[0] for sign in (-1, 1)))
        allowed = np.where(worst > 3e-5, error, allowed)
    powers = np.stack([q ** (n / 4) * cos ** (m / 2) for n in range(1, 6) for m in range(4)], axis=1)
    best = chebyshev(powers / allowed[:, None], alpha / allowed)
    present, least = (np.abs(powers @ factors - alpha) / allowed for factors in (np.ravel(START), best))
    assert present.max() < 1.01 * least.max()
    assert stepped(powers @ np.ravel(START), cos, sigma)[0].max() < 3.2e-5
