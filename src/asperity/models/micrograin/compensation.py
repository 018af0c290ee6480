"""Returns the energy that grains and base pass on to each other: a compensation lobe with two species.

Not in the paper, whose model is single scattering. The idea is Kulla and Conty's (2017), for two materials: light that
is lost after meeting a grain or the base first is returned spread like that loss. How often it meets either again
follows from the exact form factors of the furnace. Reciprocal; closes the white furnace; no fitted constants.

Exchange. Over a unit of the plane, grains (S) expose the area H, the base (B) exposes 1 - tau_0. What one sends to
another in uniform radiosity, area times form factor, is the same both ways, and adds up to the area:

    T     = mean of tau_i         sky to grains: tau_i is the visible fraction, means are hemispherical, by cosine
    1 - T                         sky to base
    K_SB  = T - tau_0             base to grains: the rest of 1 - tau_0, for the base sends nothing to itself
    K_SS  = H - T - K_SB          grains to grains: the rest of H
    l_S   = K_SS + K_SB = H - T   grains to anything but the sky
    l_B   = K_SB                  base to anything but the sky

One lost path. Of the light along i, the share L_X(i) meets X first, S or B, and would meet S or B again, not the sky,
if X were white: what single scattering loses, with all its directions and mirrors. X reflects a_X of it. From here on
all is taken to be diffuse: K_XY / l_X of it arrives at Y. Seen from the other end, along o, Y shows the share L_Y(o) of
what it gets from S and B, which is l_Y in uniform radiosity. So with two vertices, f is a_X L_X(i) K_XY / (l_X l_Y)
a_Y L_Y(o) / pi.

All lost paths. What falls on Z in between leaves it as the radiosity P_Z, albedo over area: P_S = a_S / H and
P_B = a_B / (1 - tau_0). With any number of vertices in between, K becomes K + K P K + K P K P K + ..., that is

    S_XY = (K (1 - P K)^-1)_XY / (l_X l_Y),    K = | K_SS  K_SB |
                                                   | K_SB   0   |

    S_SS = (K_SS + K_SB^2 P_B) / (l_S^2 D),    S_SB = 1 / (l_S D),    S_BB = P_S / D,
    D = det(1 - P K) = 1 - K_SS P_S - K_SB^2 P_S P_B.

The furnace. Were losses diffuse, their means m_X would be T l_S / H and (1 - T) l_B / (1 - tau_0), and in the white
furnace all that was lost would come back. They are not, so L_X is scaled by d_X, such that it does, whatever i:

    f = 1 / pi sum_XY (a_X d_X L_X(i)) S_XY (a_Y d_Y L_Y(o)),    d_X sum_Y S_XY d_Y m_Y = 1  with S of a_S = a_B = 1.

Divided by each other, the two equations are quadratic in q = d_B / d_S:

    S_BB m_B q^2 + S_SB (m_S - m_B) q - S_SS m_S = 0,    d_S = 1 / sqrt(S_SS m_S + S_SB m_B q).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from ...lobes import Lobe
from ...microfacet.ggx import GRAZING, lift, normal_in_sphere_space, to_sphere
from ...microfacet.numerics import ONE_BELOW
from ...microfacet.quadrature import accumulate
from ...microfacet.sampling import about, cosine_hemisphere, reflect
from ...microfacet.tables import Table, array_types
from .grains import Grains, density, sample_visible_normal, visible_fraction
from .shadows import Shadows, shadow

FILLINGS, COSINES, AZIMUTHS = 25, 48, 7
"""Nodes of the tables: in arcsin(sqrt(tau_0)), and in sphere space, where losses vary evenly whatever beta: in the root
of the cosine, and in the azimuth of the first quadrant."""
SAMPLES, AT_ONCE = 4096, 64
"""Quasi-random points a node, and how many of them are lanes: the others are in a loop, whose derivatives take no
memory."""
SPARSEST = 1e-4
"""Least filling factor of the tables."""
SPARSE = 0.03
"""Filling factor below which derivatives are taken at fixed directions. Those that move with beta miss that light which
crosses the horizon is lost at once, as it is among few grains: at tau_0 = 0.002, 13 % of the BSDF's derivative. Among
more, they are those of the table, while fixed ones differ by its noise: both are right to 1 or 2 %."""


class Loss(NamedTuple):
    """What single scattering loses at one filling factor if all is white, and how often it would be met again."""

    mean_grain: Any  # hemispherical means of the two losses, m_S and m_B
    mean_base: Any
    visible: Any  # hemispherical mean of the grains' visible fraction, T
    area: Any  # exposed area of the grains over that of the plane, H


@dataclass
class LossTable:
    """Losses for constant beta and any filling factor, as ratios to it, which are finite where tau_0 is small."""

    losses: Table  # L_S and L_B over filling factor, cosine and azimuth
    means: Table  # of `Loss`, over the filling factor

    @classmethod
    def made(cls, diffuse: bool, shaded: Callable[[Shadows, Any], Any], *beta: Any) -> LossTable:
        """The table for ``diffuse`` grains, or mirrors; ``shaded(shadows, h)`` is the choice of masking.

        ``beta`` is one number, or those along x and y. If it carries derivatives, so does the table.
        """
        Float, Vector = array_types('scattering = "multiple"')
        nodes = Nodes.of(beta, Float, Vector)
        losses = nodes.losses(diffuse, shaded)
        means = [*nodes.means(Table.of(nodes.shape, losses)), nodes.exposed_area()]
        per_node = dr.repeat(nodes.tau_0, dr.width(nodes.r) // FILLINGS)
        return cls(
            Table.of(nodes.shape, [loss / per_node for loss in losses[:2]]).native(),
            Table.of((FILLINGS,), [mean / nodes.tau_0 for mean in means]).native(),
        )

    def at(self, tau_0: Any) -> Loss:
        """What depends on the filling factor alone."""
        return Loss(*(tau_0 * mean for mean in self.means.at(_filling(tau_0))))

    def along(self, tau_0: Any, w: Any) -> list[Any]:
        """[L_S, L_B]: shares of the light along ``w``, in sphere space, that meet grain or base first and are lost."""
        azimuth = dr.atan2(dr.abs(w.y), dr.abs(w.x) + 1e-12) * (2 / dr.pi)
        return [tau_0 * loss for loss in self.losses.at(_filling(tau_0), dr.sqrt(w.z), azimuth)]


def returned(tau_0: Any, loss: Loss, lost_i: Any, lost_o: Any, grain: Any, base: Any) -> Any:
    """BRDF of the returned light, for albedos ``grain`` and ``base`` (spectra) and losses (L_S, L_B) along i and o.

    Symbols as above. Few grains and many leave areas without meaning, 0 / 0: these are kept off zero.
    """
    H, T = loss.area, loss.visible
    K_SB, l_S = dr.maximum(T - tau_0, 1e-6), dr.maximum(H - T, 1e-6)
    K_SS = dr.maximum(l_S - K_SB, 0)

    def exchange(a_S: Any, a_B: Any) -> tuple[Any, Any, Any]:
        """(S_SS, S_SB, S_BB)."""
        P_S, P_B = a_S / H, a_B / dr.maximum(1 - tau_0, 1e-6)
        scale = dr.rcp(1 - K_SS * P_S - K_SB * K_SB * P_S * P_B)
        return (K_SS + K_SB * K_SB * P_B) / (l_S * l_S) * scale, scale / l_S, P_S * scale

    S_SS, S_SB, S_BB = exchange(1, 1)
    m_S, m_B = dr.maximum(loss.mean_grain, 1e-7), dr.maximum(loss.mean_base, 1e-7)
    middle = S_SB * (m_S - m_B)
    q = (dr.sqrt(middle * middle + 4 * S_SS * S_BB * m_S * m_B) - middle) / (2 * S_BB * m_B)
    d_S = dr.rsqrt(S_SS * m_S + S_SB * m_B * q)
    d_B = q * d_S

    S_SS, S_SB, S_BB = exchange(grain, base)
    S_i, S_o = grain * (d_S * lost_i[0]), grain * (d_S * lost_o[0])
    B_i, B_o = base * (d_B * lost_i[1]), base * (d_B * lost_o[1])
    return (S_i * S_SS * S_o + S_SB * (S_i * B_o + B_i * S_o) + B_i * S_BB * B_o) / dr.pi


@dataclass
class Returned(Lobe):
    """The lobe of light that single scattering loses, drawn by cosine."""

    grains: Grains
    losses: LossTable
    grain: Any  # albedos, spectra
    base: Any

    def share(self, wi: Any) -> Any:
        """What is lost."""
        return sum(self.losses.along(self.grains.tau_0, self.grains.to_sphere(wi)))

    def eval_pdf(self, wi: Any, wo: Any) -> tuple[Any, Any]:
        """`returned` times the cosine, and the cosine over pi."""
        # Few grains do not pass light to each other: what they return is proportional to their number.
        tau_0 = dr.maximum(self.grains.tau_0, SPARSEST)
        lost_i, lost_o = (self.losses.along(tau_0, self.grains.to_sphere(w)) for w in (wi, wo))
        f = returned(tau_0, self.losses.at(tau_0), lost_i, lost_o, self.grain, self.base)
        return f * (wo.z * self.grains.tau_0 / tau_0), wo.z / dr.pi

    def draw(self, wi: Any, u: Any, v: Any) -> Any:
        """By cosine."""
        return cosine_hemisphere(v.x, v.y)


@dataclass
class Nodes:
    """Nodes of the losses: each filling factor with each direction of the first quadrant, in sphere space."""

    shape: tuple[int, int, int]  # numbers of filling factors, cosines and azimuths
    tau_0: Any  # the filling factors alone
    r: Any  # density and direction at each node
    i: Any
    beta_x: Any
    beta_y: Any

    @classmethod
    def of(cls, beta: tuple, Float: Any, Vector: Any) -> Nodes:
        """Arrays of these types; one azimuth where all are alike."""
        beta_x, beta_y = Float(beta[0]), Float(beta[-1])
        alike = len(beta) == 1 or (not dr.grad_enabled(beta) and bool(dr.all(beta_x == beta_y)))
        tau_0 = np.maximum(np.sin(np.linspace(0, np.pi / 2, FILLINGS)) ** 2, SPARSEST)  # dense at both ends
        root, azimuth = np.linspace(0, 1, COSINES), np.linspace(0, np.pi / 2, 1 if alike else AZIMUTHS)
        grid = np.meshgrid(tau_0, np.maximum(root**2, GRAZING), azimuth, indexing="ij")
        filling, cos, azimuth = (x.ravel() for x in grid)
        sin = np.sqrt(1 - cos * cos)
        i = Vector(*(Float(x.astype(np.float32)) for x in (sin * np.cos(azimuth), sin * np.sin(azimuth), cos)))
        r = density(Float(filling.astype(np.float32)))
        return cls(grid[0].shape, Float(tau_0.astype(np.float32)), r, i, beta_x, beta_y)

    def losses(self, diffuse: bool, shaded: Callable[[Shadows, Any], Any]) -> list[Any]:
        """[L_S, L_B, tau_i] at every node, by quasi-Monte Carlo."""
        from scipy.stats import qmc  # here, since to import it takes as long as to import Mitsuba

        Float, Vector, nodes = type(self.r), type(self.i), dr.width(self.r)
        UInt = dr.uint32_array_t(Float)
        numbers = qmc.Sobol(4, seed=0).random(SAMPLES).T.astype(np.float32)
        points = [Float(np.minimum(number, np.float32(ONE_BELOW))) for number in numbers]
        node = dr.repeat(dr.arange(UInt, nodes), AT_ONCE)
        first = dr.tile(dr.arange(UInt, AT_ONCE), nodes) * (SAMPLES // AT_ONCE)
        r, i = dr.gather(Float, self.r, node), dr.gather(Vector, self.i, node)
        leave = _scattered if diffuse else _reflected

        def blocked(index: Any, beta: tuple) -> tuple[Any, Any]:
            """Of light that has met a grain, or the base, the share that is in shadow then."""
            u, v, *more = (dr.gather(Float, point, first + index) for point in points)
            cosine = Vector(cosine_hemisphere(*more))
            wo, h, weight = leave(r, i, sample_visible_normal(r, i, u, v), cosine, *beta)
            return 1 - weight * exposed(wo, h, beta), 1 - exposed(cosine, Float(0), beta)

        def exposed(wo: Any, h: Any, beta: tuple) -> Any:
            """Of what is seen along i at height ``h``, the share that is not in shadow along ``wo``."""
            o = to_sphere(lift(wo, *beta), *beta)
            return dr.select(wo.z > 0, dr.exp(-r * (shaded(Shadows(i, o), h) - shadow(i, h))), 0)

        start = dr.zeros(Float, nodes * AT_ONCE)
        sums = accumulate(blocked, UInt(SAMPLES // AT_ONCE), (start, start), (self.beta_x, self.beta_y))
        grain, base = (dr.block_sum(total, AT_ONCE) / SAMPLES for total in sums)
        visible = visible_fraction(self.r, self.i)
        return [visible * grain, (1 - visible) * base, visible]

    def means(self, table: Table) -> list[Any]:
        """Means of the channels L of a ``table`` on these nodes over real directions, int int L cos dcos dphi / pi.

        By midpoints in cos^2 and in the azimuth phi.
        """
        Float = type(self.r)
        UInt = dr.uint32_array_t(Float)
        squares, turns = 512, 128
        lane = dr.arange(UInt, FILLINGS * turns)
        sin_turn, cos_turn = dr.sincos((Float(lane % turns) + 0.5) * (np.pi / (2 * turns)))
        filling = Float(lane // turns) / (FILLINGS - 1)

        def along(index: Any, captured: tuple) -> tuple:
            table, beta_x, beta_y = captured
            square = (Float(index) + 0.5) / squares
            sin = dr.sqrt(1 - square)
            x, y = beta_x * sin * cos_turn, beta_y * sin * sin_turn
            cos = dr.sqrt(square / (x * x + y * y + square))
            return tuple(table.at(filling, dr.sqrt(cos), dr.atan2(y, x) * (2 / dr.pi)))

        start = (dr.zeros(Float, dr.width(lane)),) * table.channels
        sums = accumulate(along, UInt(squares), start, (table, self.beta_x, self.beta_y))
        return [dr.block_sum(total, turns) / (squares * turns) for total in sums]

    def exposed_area(self) -> Any:
        """H = tau_0 int D dm = r int int exp(-r pi (1 - h^2)) |E m'| dh dphi, for each filling factor."""
        Float, n = type(self.r), 64
        middles = (np.arange(n) + 0.5) / n
        grid = np.meshgrid(self.tau_0.numpy().astype(float), middles, middles, indexing="ij")
        tau_0, h, turn = (x.ravel() for x in grid)
        r, sin, turn = -np.log1p(-np.minimum(tau_0, 1 - 1e-6)) / np.pi, np.sqrt(1 - h * h), 2 * np.pi * turn
        numbers = r * np.exp(-r * np.pi * (1 - h * h)), sin * np.cos(turn), sin * np.sin(turn), h
        exposed, x, y, h = (Float(x.astype(np.float32)) for x in numbers)
        area = exposed * dr.sqrt(dr.square(self.beta_x * x) + dr.square(self.beta_y * y) + h * h)
        return dr.block_sum(dr.block_sum(area, n), n) * (2 * np.pi / (n * n))


def _scattered(r: Any, i: Any, point: Any, cosine: Any, beta_x: Any, beta_y: Any) -> tuple[Any, Any, Any]:
    """(wo, height, weight) of light from a diffuse grain's visible ``point`` m', along ``cosine`` about its normal.

    The weight is 1; if wo is held (see `SPARSE`), its derivative is that of the density of this wo.
    """
    m = dr.normalize(type(i)(beta_x * point.x, beta_y * point.y, point.z))
    wo = _held(r, about(m, cosine))
    cos = dr.dot(m, wo)
    return wo, point.z, cos / dr.detach(cos)


def _reflected(r: Any, i: Any, point: Any, cosine: Any, beta_x: Any, beta_y: Any) -> tuple[Any, Any, Any]:
    """The same of light that a mirror's ``point`` reflects; if wo is held, another point does (Lucas 2024, Eq. 22)."""
    m = dr.normalize(type(i)(beta_x * point.x, beta_y * point.y, point.z))
    wi = dr.normalize(type(i)(i.x / beta_x, i.y / beta_y, i.z))
    wo = _held(r, reflect(wi, m))
    if not dr.grad_enabled(wo):
        return wo, point.z, 1
    h, d_ggx = normal_in_sphere_space(dr.normalize(wi + dr.select(wo.z > 0, wo, wi)), beta_x, beta_y)
    log_density = dr.log(d_ggx / wi.z) - r * (dr.pi * (1 - h * h) + shadow(i, h))
    weight = dr.select(r < density(SPARSE), dr.replace_grad(type(r)(1), log_density), 1)
    return wo, dr.replace_grad(point.z, h), weight


def _held(r: Any, wo: Any) -> Any:
    """The direction, without its derivatives among few grains."""
    return dr.select(r < density(SPARSE), dr.detach(wo), wo)


def _filling(tau_0: Any) -> Any:
    """The tables' coordinate in [0, 1]."""
    return dr.atan2(dr.sqrt(dr.maximum(tau_0, 1e-6)), dr.sqrt(dr.maximum(1 - tau_0, 1e-6))) * (2 / dr.pi)
