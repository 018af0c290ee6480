"""Quadrature that takes nothing from the package, in double precision; and materials to try it on."""

import numpy as np
from scipy.special import gamma

EXPONENTS = [0.2, 0.4, 0.6, 0.8, 1, 1.4, 2, 3, 4, 5]
LARGEST = [0.015, 0.261, 0.448, 0.461, 0.348, 0.153, 0.104, 0.085, 0.068, 0.058]
"""Width for an exponent, up to which the authors have tables."""


def material(rng):
    """(alpha, p, b, c) within the range of the authors' tables."""
    p = np.exp(rng.uniform(*np.log([0.2, 5])))
    alpha = np.interp(p, EXPONENTS, LARGEST) * rng.uniform(0.05, 1)
    return max(alpha, 1e-3), p, np.exp(rng.uniform(*np.log([0.05, 20]))), rng.uniform(1.02, 3.02)


def tilts(rng, n, alpha):
    """Of half vectors: evenly, a quarter in the core, a quarter next to the horizon, and both ends."""
    theta = rng.uniform(0, np.pi / 2, n)
    theta[: n // 4] = 4 * alpha * rng.random(n // 4)
    theta[n // 4 : n // 2] = np.pi / 2 - 0.2 * rng.random(n // 2 - n // 4) ** 2
    theta[-2:] = 0, np.pi / 2
    return np.clip(theta, 0, np.pi / 2)


def panels(low, high, peaks, order=8):
    """Gauss nodes of intervals that double away from peaks, given as (position, width)."""
    steps, ends = 2.0 ** np.arange(-1, 40), [low, high]
    for position, width in peaks:
        near = np.r_[position, position + width * steps, position - width * steps]
        ends += list(near[(near > low) & (near < high)])
    ends = np.unique(ends)
    x, w = np.polynomial.legendre.leggauss(order)
    half = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + half * (x + 1)).ravel(), (half * w).ravel()


def convolution(theta, u, c, alpha_u, alpha_v, p, phi=0.0):
    """V over slopes: in units of the widths, where D depends on their length r alone, and in azimuth around h."""
    h = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    at, last, unit = np.array([h[0] / alpha_u, h[1] / alpha_v]), 35 ** (0.5 / p), 0.1
    nearest, width = min(np.hypot(*at) / max(h[2], 1e-9), last), 0.1 / u / max(alpha_u, alpha_v)
    # log(1 + r / unit), since tails are long; D has an edge at r = 1.
    peaks = [(np.log1p(nearest / unit), width / (unit + nearest)), (np.log1p(1 / unit), 0.1)]
    x, weight = panels(0, np.log1p(last / unit), peaks)
    r, weight = unit * np.expm1(x), weight * unit * np.exp(x)
    psi, around = panels(-np.pi, np.pi, [(0, width / max(nearest, 0.05)), (np.pi / 2, 0.1), (-np.pi / 2, 0.1)])
    psi = psi[:, None] + np.arctan2(*at[::-1])
    x, y = alpha_u * r * np.cos(psi), alpha_v * r * np.sin(psi)
    length = np.sqrt(1 + x * x + y * y)
    facing = np.maximum(h[0] * x + h[1] * y + h[2], 0) / length
    cross = (h[1] - h[2] * y) ** 2 + (h[2] * x - h[0]) ** 2 + (h[0] * y - h[1] * x) ** 2
    diffracted = (1 + 4 * u * u * cross / length**2) ** (-(c + 1) / 2) * facing**2
    density = p / (np.pi * gamma(1 / p)) * np.exp(-(r ** (2 * p)))
    return around @ (diffracted * length) @ (density * r * weight)


def disc(f, s, B, c):
    """Integral over directions, around the middle of their disc, of f times the power spectrum of light of sine s.

    ``f(r^2, o_z)`` is of the squared distance from the mirror direction, at (s, 0), and of the cosine.
    """
    t, weight = panels(0, 1, [(np.sqrt(max(1 - s, 0)), 0.1 / B), (1, 0.1), (0, 0.1)])
    radius, weight = 1 - t * t, 2 * t * weight  # o_z has a root at the rim
    phi, around = panels(0, np.pi, [(0, 0.1 / B)])
    square = (radius * np.cos(phi[:, None]) - s) ** 2 + (radius * np.sin(phi[:, None])) ** 2
    spectrum = B * B * (c - 1) / (2 * np.pi) * (1 + B * B * square) ** (-(c + 1) / 2)
    return 2 * around @ (spectrum * f(square, np.sqrt(1 - radius**2))) @ (radius * weight)


def propagating(s, B, c):
    """R."""
    return disc(lambda square, cos: 1, s, B, c)


def smooth_albedo(s, B, c, k, propagating):
    """T, for the deviation of the phase k = 4 pi sigma / lambda; ``propagating`` gives R for an array of cos_d."""

    def shared(square, cos_o):
        up = np.sqrt(1 - s * s) + cos_o
        cos2 = (square + up**2) / 4
        R = propagating(np.sqrt(cos2))
        return -np.expm1(-k * k * cos2 * R) / R * up**2 / (4 * cos2)

    return disc(shared, s, B, c)
