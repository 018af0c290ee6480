"""Returns the energy that grains and base pass on to each other: a compensation lobe with two species.

Not in the paper, whose model is single scattering. The idea is Kulla and Conty's (2017), for two materials: light that
is lost after meeting a grain or the base first is returned spread like that loss. How often it meets either again
follows from the exact form factors of the furnace. Reciprocal; closes the white furnace; no fitted constants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import qmc

from ...microfacet.ggx import GRAZING, lift, to_sphere
from .grains import density, sample_visible_normal, visible_fraction
from .shadows import Shadows, shadow

FILLINGS, COSINES, AZIMUTHS = 25, 48, 7
"""Nodes of the tables: in arcsin(sqrt(tau_0)), and in sphere space, where losses vary evenly whatever beta: in the root
of the cosine, and in the azimuth of the first quadrant."""
SAMPLES = 4096
SPARSEST = 1e-4
"""Least filling factor of the tables."""


class Loss(NamedTuple):
    """What single scattering loses at one filling factor if all is white, and how often it would be met again."""

    mean_grain: Any  # hemispherical means of the two losses
    mean_base: Any
    visible: Any  # hemispherical mean of the grains' visible fraction, tau_avg
    area: Any  # exposed area of the grains over that of the plane, H_S


@dataclass
class LossTable:
    """Losses for constant ``beta_x`` and ``beta_y`` and any filling factor, as ratios to it.

    All of it is proportional to tau_0 where that is small.
    """

    beta_x: float
    beta_y: float
    losses: Any  # L_S and L_B over azimuth, cosine and filling factor
    means: Any  # of `Loss`, over the filling factor

    @classmethod
    def made(cls, beta_x: float, beta_y: float, diffuse: bool, shaded: Callable[[Shadows, Any], Any]) -> LossTable:
        """The table for ``diffuse`` grains, or mirrors; ``shaded(shadows, h)`` is the choice of masking."""
        tau_0 = np.maximum(np.sin(np.linspace(0, np.pi / 2, FILLINGS)) ** 2, SPARSEST)  # dense at both ends
        azimuths = 1 if beta_x == beta_y else AZIMUTHS
        root, azimuth = np.linspace(0, 1, COSINES), np.linspace(0, np.pi / 2, azimuths)
        grid = np.meshgrid(tau_0, np.maximum(root**2, GRAZING), azimuth, indexing="ij")
        losses, visible = _losses(grid[0], grid[1], grid[2], beta_x, beta_y, diffuse, shaded)
        mean = _hemispherical_mean(np.concatenate([losses, visible], axis=-1), root, azimuth, beta_x, beta_y)
        means = np.column_stack([mean, _exposed_area(tau_0, beta_x, beta_y)])
        losses, means = losses / tau_0[:, None, None, None], means / tau_0[:, None]
        return cls(beta_x, beta_y, _table(mi.Texture3f, losses), _table(mi.Texture1f, means))

    def at(self, tau_0) -> Loss:
        """What depends on the filling factor alone."""
        return Loss(*(tau_0 * mean for mean in self.means.eval(_centre(_filling(tau_0), FILLINGS))))

    def along(self, tau_0, w):
        """(L_S, L_B): shares of the light along ``w`` that meet grain or base first and are lost."""
        w = to_sphere(lift(w, self.beta_x, self.beta_y), self.beta_x, self.beta_y)
        azimuth = dr.atan2(dr.abs(w.y), dr.abs(w.x) + 1e-12) * (2 / dr.pi)
        at = (
            _centre(azimuth, self.losses.shape[2]),
            _centre(dr.sqrt(w.z), COSINES),
            _centre(_filling(tau_0), FILLINGS),
        )
        return [tau_0 * loss for loss in self.losses.eval(mi.Point3f(*at))]


def lobe(tau_0, loss: Loss, lost_i, lost_o, grain, base):
    """BRDF of the returned light, for albedos ``grain`` and ``base`` (spectra) and losses (L_S, L_B) along i and o.

    ``blocked`` and ``between`` are the fluxes that grains pass to grains, and to the base and back.
    """
    between = dr.maximum(loss.visible - tau_0, 1e-6)
    lost = dr.maximum(loss.area - loss.visible, 1e-6)
    blocked = dr.maximum(lost - between, 0)

    def exchange(grain, base):
        """The matrix S: (grain-grain, grain-base, base-base)."""
        x, y = grain / loss.area, base / dr.maximum(1 - tau_0, 1e-6)
        scale = dr.rcp(1 - blocked * x - between * between * x * y)
        return (blocked + between * between * y) / (lost * lost) * scale, scale / lost, x * scale

    # d_S, d_B: the symmetric scaling that makes the lobe return, in the white furnace, exactly what was lost.
    s, m, b = exchange(1, 1)
    mean_s, mean_b = dr.maximum(loss.mean_grain, 1e-7), dr.maximum(loss.mean_base, 1e-7)
    middle = m * (mean_s - mean_b)
    ratio = (dr.sqrt(middle * middle + 4 * s * b * mean_s * mean_b) - middle) / (2 * b * mean_b)
    d_s = dr.rsqrt(s * mean_s + m * mean_b * ratio)
    d_b = ratio * d_s

    s, m, b = exchange(grain, base)
    s_i, s_o = grain * (d_s * lost_i[0]), grain * (d_s * lost_o[0])
    b_i, b_o = base * (d_b * lost_i[1]), base * (d_b * lost_o[1])
    return (s_i * s * s_o + m * (s_i * b_o + b_i * s_o) + b_i * b * b_o) / dr.pi


def _losses(tau_0, cos, azimuth, beta_x, beta_y, diffuse, shaded):
    """(L_S, L_B) and tau_i on a grid of filling factors and directions in sphere space, by quasi-Monte Carlo."""
    Float, Vector = _array_types()

    def spread(x):
        return dr.repeat(Float(np.ascontiguousarray(x.ravel(), dtype=np.float32)), SAMPLES)

    r, sin = density(spread(tau_0)), np.sqrt(1 - cos * cos)
    i = Vector(spread(sin * np.cos(azimuth)), spread(sin * np.sin(azimuth)), spread(cos))
    wi = dr.normalize(Vector(i.x / beta_x, i.y / beta_y, i.z))
    points = qmc.Sobol(4, seed=0).random(SAMPLES).T.astype(np.float32)
    u = [dr.tile(Float(np.minimum(point, np.float32(1 - 2**-24))), cos.size) for point in points]

    m = sample_visible_normal(r, i, u[0], u[1])
    h, m = m.z, dr.normalize(Vector(beta_x * m.x, beta_y * m.y, m.z))
    cosine = _cosine_hemisphere(Vector, u[2], u[3])
    wo = _about(m, cosine) if diffuse else 2 * dr.dot(wi, m) * m - wi

    def blocked(wo, h):  # of what is seen along i at height h, the share that is in shadow along wo
        o = to_sphere(lift(wo, beta_x, beta_y), beta_x, beta_y)
        return 1 - dr.select(wo.z > 0, dr.exp(-r * (shaded(Shadows(i, o), h) - shadow(i, h))), 0)

    visible = visible_fraction(r, i)
    columns = visible * blocked(wo, h), (1 - visible) * blocked(cosine, Float(0)), visible
    columns = [dr.block_sum(column, SAMPLES).numpy().reshape(cos.shape) / SAMPLES for column in columns]
    return np.stack(columns[:2], axis=-1), columns[2][..., None]


def _exposed_area(tau_0, beta_x, beta_y):
    """H_S = tau_0 int D dm = r int int exp(-r pi (1 - h^2)) |E m'| dh dphi."""
    r = -np.log1p(-np.minimum(tau_0, 1 - 1e-6))[:, None, None] / np.pi
    h, azimuth = ((np.arange(64) + 0.5) / 64)[:, None], (np.arange(64) + 0.5) / 64 * 2 * np.pi
    x, y = (np.sqrt(1 - h * h) * f(azimuth) for f in (np.cos, np.sin))
    stretch = np.sqrt((beta_x * x) ** 2 + (beta_y * y) ** 2 + h * h)
    return (r * np.exp(-r * np.pi * (1 - h * h)) * stretch).mean(axis=(1, 2)) * 2 * np.pi


def _hemispherical_mean(table, root, azimuth, beta_x, beta_y):
    """2 int int L cos dcos dazimuth / (2 pi) over real directions, for an L linear between the nodes of ``table``."""
    square, turn = np.meshgrid((np.arange(512) + 0.5) / 512, (np.arange(128) + 0.5) / 256 * np.pi, indexing="ij")
    x, y = (np.sqrt(1 - square) * f(turn) for f in (np.cos, np.sin))
    cos = np.sqrt(square / ((beta_x * x) ** 2 + (beta_y * y) ** 2 + square))
    at = np.sqrt(cos), np.arctan2(beta_y * y, beta_x * x)
    if len(azimuth) == 1:
        table, azimuth = np.repeat(table, 2, axis=2), np.array([0, np.pi / 2])
    return np.array([RegularGridInterpolator((root, azimuth), layer)(at).mean(axis=(0, 1)) for layer in table])


def _table(texture, data):
    data = mi.TensorXf(np.ascontiguousarray(data, dtype=np.float32))
    return texture(data, filter_mode=dr.FilterMode.Linear, wrap_mode=dr.WrapMode.Clamp)


def _centre(x, n: int):
    """Texture coordinate at which a table of ``n`` nodes from 0 to 1 has the value for x."""
    return (x * (n - 1) + 0.5) / n


def _filling(tau_0):
    """The tables' coordinate in [0, 1]."""
    return dr.atan2(dr.sqrt(dr.maximum(tau_0, 1e-6)), dr.sqrt(dr.maximum(1 - tau_0, 1e-6))) * (2 / dr.pi)


def _array_types():
    """Arrays to compute tables with: the variant's own, or LLVM's where that is scalar."""
    if dr.is_jit_v(mi.Float):
        return mi.Float, mi.Vector3f
    import drjit.llvm as llvm

    return llvm.Float, llvm.Array3f


def _cosine_hemisphere(Vector, u, v):
    radius, (sin, cos) = dr.sqrt(u), dr.sincos(2 * dr.pi * v)
    return Vector(radius * cos, radius * sin, dr.safe_sqrt(1 - u))


def _about(n, w):
    """Turn ``w`` from about the z axis to about ``n`` (Duff et al. 2017), n.z >= 0."""
    a = -dr.rcp(1 + n.z)
    b = n.x * n.y * a
    s, t = type(n)(1 + n.x * n.x * a, b, -n.x), type(n)(b, 1 + n.y * n.y * a, -n.y)
    return s * w.x + t * w.y + n * w.z
