"""What `accuracy` holds the models to: f cos_o and density in double precision, without the models' approximations.

Each takes a material and pairs of directions, (3, n), and returns (4, n): f cos_o in red, green, blue, and the density.
Shared with the models is what tests hold to simulation: densities of normals, the geometry of a single groove, areas
in shadow. Their fits, tables, quadratures and closed sums over bounces are not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np

from asperity.microfacet.fresnel import conductor
from asperity.microfacet.quadrature import gauss_legendre
from asperity.models.micrograin.grains import Grains, SecondColour, density, exposure
from asperity.models.micrograin.material import Material
from asperity.models.micrograin.shadows import Shadows, shadow
from asperity.models.micrograin.specular import Specular
from asperity.models.vgroove.kaleidoscope import Pair
from asperity.models.vgroove.nonsymmetric import Way, Width, single_bounce
from asperity.models.vgroove.symmetric import POLE, cook_torrance_share
from asperity.models.vgroove.tilts import Tilts

Double, Vector, Index = llvm.Float64, llvm.Array3f64, llvm.UInt
PIECES, NODES = 4, 32
"""Of the integral over a partner's tilt, for every number of bounces: Gauss-Legendre in each piece."""
HEIGHTS, AZIMUTHS = 192, 96
"""Nodes on a grain, of the azimuths on either lit arc."""


def grooves(material: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """All terms of all bounces, one by one, and in each the reflectances, one by one.

    Symmetric grooves are exact to rounding. Of independent tilts two bounces are: their integral is split at its kinks.
    More bounces have kinks elsewhere, which cost 1e-4 of their share.
    """
    model, n = mi.load_dict(material).model, wi.shape[1]
    rule = Rule(n, 1, 1) if model.symmetric else Rule(n, PIECES, NODES)
    i, o = (Vector(np.repeat(w.astype(float), rule.count, axis=1)) for w in (wi, wo))
    pair = Pair.of(i, o)
    theta, delta = dr.atan2(pair.sin_theta, pair.cos_theta), dr.atan2(pair.sin_delta, pair.cos_delta)
    pair = replace(pair, theta=theta, delta=delta)  # not by fast functions
    alphas = (np.float32(material.get("alpha", material.get(name))) for name in ("alpha_u", "alpha_v"))
    tilts = Tilts.along(model.kind(*map(opaque, alphas)), pair.cos_azimuth, pair.sin_azimuth)
    metal, share = indices(model), symmetric if model.symmetric else independent

    def reflected(cos: Any) -> list:
        return [conductor(cos, *index) for index in metal]

    def add(step: Any, *sums: Any) -> tuple:
        k, tau = 2 + step // 2, dr.select(step % 2 == 0, Double(1), -1)
        odd = k % 2 == 1
        way = Way(k, odd, tau * dr.select(odd, theta, delta), dr.select(odd, delta, theta))
        l, aperture, value = share(way, tilts, rule)
        first = way.p + way.q - l  # m apertures on, the sine of this is the cosine of incidence on the m-th image

        def bounce(m: Any, *through: Any) -> tuple:
            once = reflected(dr.clip(pair.length * dr.cos(first + m * aperture), 0, 1))
            return m + 1, *(light * one for light, one in zip(through, once))

        through = dr.while_loop((Index(0), *(Double(1) for _ in metal)), lambda m, *_: (m < k) & (value > 0), bounce)
        return step + 1, *(total + value * light for total, light in zip(sums, (1, *through[1:])))

    start = Index(0), *(dr.zeros(Double, n * rule.count) for _ in (1, *metal))
    several = dr.while_loop(start, lambda step, *_: step < 2 * (Index(model.most) - 1), add)[1:]
    once = tilts.density(pair.sin_theta, pair.cos_theta) * cook_torrance_share(pair)
    once = (once if model.symmetric else single_bounce(pair, tilts)) / rule.count
    through, pole = [1, *reflected(pair.length * pair.cos_delta)], dr.rcp(dr.maximum(pair.sin_theta, POLE))
    found = [(once * light + pole * more) / (4 * i.z * pair.cos_delta) for light, more in zip(through, several)]
    pdf, *value = (x.numpy().reshape(n, -1).sum(1) for x in found)
    return np.stack([*(value or [pdf] * 3), pdf])


class Rule:
    """Gauss-Legendre in each of several pieces of an integral: a lane for every node of ``n`` pairs of directions."""

    def __init__(self, n: int, pieces: int, nodes: int) -> None:
        self.count = pieces * nodes
        self.pieces, self.piece = pieces, Index(np.tile(np.repeat(np.arange(pieces), nodes), n))
        self.node, self.weight = (Double(np.tile(x, pieces * n)) for x in gauss_legendre(nodes))

    def at(self, ends: list) -> tuple[Any, Any]:
        """(node, weight) in pieces between these ends."""
        begin, end = ends[:2]
        for piece in range(1, self.pieces):
            here = self.piece == piece
            begin, end = dr.select(here, ends[piece], begin), dr.select(here, ends[piece + 1], end)
        return begin + (end - begin) * self.node, (end - begin) * self.weight


def symmetric(way: Way, tilts: Tilts, rule: Rule) -> tuple[Any, Any, Any]:
    """(tilt, aperture, sin theta times a term) of the one groove that leads there (`symmetric.py`)."""
    p, q = way.p, way.q
    b = (dr.pi / 2 - p) / way.k
    sin, cos = dr.sincos(b)
    width = dr.minimum(dr.sin(b + p - q), 2 * dr.cos(p) * dr.sin(b - q))
    return dr.pi / 2 - b, 2 * b, tilts.density(cos, sin) * dr.maximum(width, 0) * cos / way.k


def independent(way: Way, tilts: Tilts, rule: Rule) -> tuple[Any, Any, Any]:
    """The same of a groove at each node of the ``rule`` (`nonsymmetric.py`)."""
    low, extent = way.interval()
    even = [low + extent * (piece / rule.pieces) for piece in range(rule.pieces + 1)]
    r, weight = rule.at([dr.select(way.k == 2, *ends) for ends in zip(way.kinks(low, low + extent), even)])
    tilt = way.first_tilt(r)
    l, r = (tilt, dr.sincos(tilt)), (r, dr.sincos(r))
    width = Width(way.odd, dr.sincos(way.p + way.q), dr.sincos(way.p - way.q))(l[1], r[1])
    weight = weight * 2 / dr.select(way.odd, way.k + 1, way.k) / tilts.partner()
    return tilt, dr.pi - tilt - r[0], weight * tilts.product(l[1], r[1]) * l[1][0] * r[1][0] * width


def indices(model: Any) -> list[tuple[Any, Any]]:
    """(eta, k) of a metal in red, green and blue; none of a mirror."""
    if model.metal.mirror:
        return []
    metal = model.metal.reflectance(dr.zeros(mi.SurfaceInteraction3f), True)
    return [tuple(map(opaque, channel)) for channel in zip(*(np.ravel(x) for x in (metal.eta, metal.k)))]


def opaque(number: Any) -> Any:
    """A number that others may take the place of, without a kernel of its own."""
    return dr.opaque(Double, float(number))


def grains(material: dict, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Lambertian grains by a fine rule; the lobe of metal or of a coat, which is closed, in double precision.

    Areas in shadow are closed as well; their angles, by fast functions, are good to 1e-7.
    """
    model = mi.load_dict(material).model
    betas = (np.float32(material.get("beta", material.get(name))) for name in ("beta_x", "beta_y"))
    tau_0, raw = np.float32(material["tau_0"]), Vector(wo.astype(float))
    r = density(llvm.Float(tau_0))[0]  # in float32, since what stands for tau_0 = 1 depends on the precision
    here = Grains(*(Double(np.full(wi.shape[1], x, dtype=float)) for x in (tau_0, r, *betas)))
    i, o = here.lift(Vector(wi.astype(float))), here.lift(raw)
    if model.grains == "metal":
        value, pdf = Specular(here, Material(metal=lambda cos: 1), Shadows.union).eval_pdf(i, o)
        cos = dr.dot(i, dr.normalize(i + o))
        value = value.numpy() * np.array([conductor(cos, *index) for index in indices(model)] or np.ones((3, 1)))
    else:
        eta = opaque(np.float32(material["int_ior"])) if model.grains == "coated" else None
        second = {"height": SecondColour(), "normal": SecondColour(1, 0)}.get(material.get("variation"))
        first, second, pdf = lambertian(here, i, o, eta, second)
        pdf = pdf / here.visible(i)
        value = np.outer(albedo(material, "diffuse_reflectance"), first)
        value = value + np.outer(albedo(material, "diffuse_reflectance_2"), second)
    if model.grains == "coated":
        coated = Material(coat=lambda cos: dielectric(cos, eta), albedo=Double(0.5))
        mirrored, glossy = Specular(here, coated, Shadows.union).eval_pdf(i, o)
        part = coated.diffuse_part(i.z)
        value, pdf = value + mirrored.numpy(), part * pdf + (1 - part) * glossy
    return np.concatenate([value * (raw.z / o.z).numpy(), pdf.numpy()[None]])


def albedo(material: dict, name: str) -> np.ndarray:
    """A colour, or a number for all."""
    given = material.get(name, 0.5)
    return np.broadcast_to(np.float32(given["value"] if isinstance(given, dict) else given), 3)


def dielectric(cos: Any, eta: Any) -> Any:
    """Fresnel's reflectance from outside, from its two amplitudes; eta > 1."""
    g = dr.sqrt(eta * eta - 1 + cos * cos)
    return (dr.square((cos - g) / (cos + g)) + dr.square((eta * eta * cos - g) / (eta * eta * cos + g))) / 2


def lambertian(here: Grains, i: Any, o: Any, eta: Any, second_colour: Any) -> tuple:
    """(f cos_o of the first colour for albedo 1, that of the second, density times tau_i) (Lucas 2024, Eq. 21).

    By Gauss-Legendre in (1 - h)^(1/3), since at grazing only the tops are seen, and around in each lit arc: there in an
    angle t that is more even than the azimuth x if the grain is not round, tan x = k tan t from its axis.
    """
    n = dr.width(i.x)
    t, weight = map(np.array, gauss_legendre(HEIGHTS))
    h, weight = (Double(np.tile(x, n)) for x in (1 - t**3, weight * 3 * t**2))
    wi, wo = (Vector(*(dr.repeat(x, HEIGHTS) for x in w)) for w in (i, o))
    here = Grains(*(dr.repeat(x, HEIGHTS) for x in (here.tau_0, here.r, here.beta_x, here.beta_y)))
    i, o = here.to_sphere(wi), here.to_sphere(wo)
    radius, beta_x, beta_y = dr.sqrt(1 - h * h), here.beta_x, here.beta_y
    k = dr.sqrt(dr.norm(llvm.Array2f64(beta_x * radius, h)) / dr.norm(llvm.Array2f64(beta_y * radius, h)))
    nodes, weights = map(Double, gauss_legendre(AZIMUTHS))

    def straightened(x: Any) -> Any:
        sin, cos = dr.sincos(x)
        return x + dr.atan2((1 - k) * sin * cos, k * cos * cos + sin * sin)

    def around(begin: Any, extent: Any) -> tuple:
        def add(index: Any, first: Any, second: Any, pdf: Any) -> tuple:
            sin, cos = dr.sincos(begin + extent * dr.gather(Double, nodes, index))
            scale = dr.rsqrt(cos * cos + dr.square(k * sin))
            m = Vector(radius * cos * scale, radius * k * sin * scale, h)
            part = dr.gather(Double, weights, index) * extent * k * scale * scale * dr.maximum(dr.dot(i, m), 0)
            m = dr.normalize(Vector(beta_x * m.x, beta_y * m.y, m.z))
            cos_i, cos_o = (dr.maximum(dr.dot(w, m), 0) for w in (wi, wo))
            pdf, value = pdf + part * cos_o, part * cos_o
            if eta is not None:
                value = value * (1 - dielectric(cos_i, eta)) * (1 - dielectric(cos_o, eta))
            share = 0 if second_colour is None else second_colour(h, m)
            return index + 1, first + value * (1 - share), second + value * share, pdf

        start = Index(0), *(dr.zeros(Double, dr.width(h)) for _ in range(3))
        return dr.while_loop(start, lambda index, *_: index < dr.select(extent > 0, Index(AZIMUTHS), 0), add)[1:]

    arcs = [[straightened(end) for end in arc] for arc in lit_arcs(i, o, h, radius)]
    first, second, pdf = map(sum, zip(*(around(begin, end - begin) for begin, end in arcs)))
    exposed, seen = (exposure(here.r, h, area) for area in (Shadows(i, o).union(h), shadow(i, h)))
    scale = weight * here.r / (dr.pi * i.z)
    return tuple(dr.block_sum(scale * x, HEIGHTS) for x in (exposed * first, exposed * second, seen * pdf))


def lit_arcs(i: Any, o: Any, h: Any, radius: Any) -> list[tuple[Any, Any]]:
    """(begin, end) of the azimuths where i.m' and o.m' are positive: two arcs, of which one or both may end first."""

    def arc(w: Any) -> tuple[Any, Any]:
        flat = dr.sqrt(w.x * w.x + w.y * w.y)
        return dr.atan2(w.y, w.x), dr.acos(dr.clip(-w.z * h / dr.maximum(flat * radius, 1e-30), -1, 1))

    (x_i, half_i), (x_o, half_o) = arc(i), arc(o)
    between = x_o - x_i
    between = between - dr.two_pi * dr.round(between / dr.two_pi)
    turn = dr.select(between < 0, -dr.two_pi, dr.two_pi)  # i's arc again, on the other side of o's
    return [
        (x_i + dr.maximum(again - half_i, between - half_o), x_i + dr.minimum(again + half_i, between + half_o))
        for again in (0, turn)
    ]


REFERENCES = {"vgroove": grooves, "micrograin": grains}
"""By the type of a material."""
