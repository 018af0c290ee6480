"""Light in a half space of sparse particles: phase function, H functions, azimuthal modes, albedos (d'Eon 2021).

Paper                   Here
c, s = sqrt(1 - c)      ``s``, which is what functions take: everything is smooth in s; c is the particles' albedo
k_d                     ``bond``: the share that the half space reflects of uniform light
mu_i, mu_o              ``pair.u``, ``pair.v``: cosines with the normal, u and v below; ``mu`` is either
S^2, S cos(phi)         ``pair.sin2``, ``pair.q``: phi = 0 is the side of retro-reflection
p (Eq. 1)               `phase`
f_1 (Eq. 10)            c `_once` / (u + v)
H (Eq. 16)              exp of `log_h`, with `H0`, `H1`, `H2` for modes 0, 1, 2
A, E (Eq. 33)           ``a``, ``e`` in `_modes`
B, C, D, F, l, m        `CONSTANTS`; ``b, c_, d, f, l, m_1`` in `_modes`, where m_1 = m - 1
f_m (Eqs. 12, 28, 38)   `_modes`

Albedos are in [0, 1], BRDFs per steradian. Arguments are Dr.Jit arrays of any precision; where nothing else is said,
plain floats too.

Coefficients without an equation number were fitted anew to the exact solution, which `fit` has: there their digits can
be made again, and their errors measured.
Corrected errors of the paper: Eqs. 22 and 28 are half of what they should be; Eqs. 23 and 24 multiply where they should
raise to a power; Eqs. 39 and 40 leave [0, 1].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import drjit as dr

from ...microfacet.fast import exp_of_moderate, greater, lesser, polynomial
from ...microfacet.numerics import clamp, keep

GRAZING = 1e-4
ONE_BELOW = 1 - 2**-24
SMALL = 1e-7

Table = tuple[tuple[float, ...], ...]

H0: Table = (
    (0.4698889, -0.06962957, 0.4756948, -0.2693934, -0.02007905),
    (1.3459, -1.794902, -0.8563564, 0.4835933, 0.3142143),
    (-0.670716, -0.5507468, 3.959011, -2.268695, 0.01416739),
    (-0.116668, 0.1845958, 0.2516144, -0.6561857, 0.3467337),
)
"""H of mode 0, for `log_h`: relative error 6.2e-4. The same for H1: 1.9e-4, H2: 4.7e-4, ISOTROPIC: 4.7e-4."""
H1: Table = (
    (-0.3488419, -0.008101413, -0.003119808),
    (0.392435, 0.03027921, -0.08813923),
    (-0.3919895, -0.03105733, 0.08990126),
)
H2: Table = ((0.04541158, -0.0003056805), (-0.006832692, 0.00008838767))
ISOTROPIC: Table = (
    (0.4421373, -0.0217839, 0.1544406, -0.2880447, 0.2811988),
    (1.314256, -1.642788, 0.5888855, 0.01988604, -0.4511726),
    (-0.6159772, -0.1748392, 1.010695, -0.7045692, 0.6962103),
    (-0.1267904, 0.0648593, 0.6446986, -0.9590598, 0.3633427),
)
CONSTANTS: Table = (
    (-0.083314682, 0.43016137, -0.37714949, 0.067687571, -0.037316368),
    (0.11716652, -0.34572999, 0.98125835, -0.059965432, -0.026145183),
    (1.8617844e-6, 0.2437524, -0.35823194, 0.042340088, 0.072229976),
    (-1.0489498e-5, -0.172865, 0.072660423, -0.029982717, 0.012969076),
    (-0.063507178, -0.00073576944, 0.0055756383),
    (0.43865626, 0.00068466831, 0.0051653013),
)
"""B, C, D, F, l and m - 1 over c, as polynomials in s: absolute errors 9e-6, 22e-6, 3e-6, 11e-6, 5e-5, 5e-5."""
ESCAPE: Table = (
    (-0.99999552, 0.81466529, -0.55740698, 0.38109997, -0.18620909, 0.047981157),
    (4.5876755e-6, -0.00046424277, -0.085057181, 0.10728903, -0.074855383, 0.023900579),
)
"""Q1 and Q2 of `directional_albedo`, as polynomials in s: absolute error of c Q1 and c Q2 6e-6."""
ROOT: Table = ((1, 1.7659757, 1.7549035, 0.0132454), (1, 2.3798487, 3.5173734, 1.8152825))
BOND_ALBEDO: Table = ((1, 0.0889736, -0.0481792, -0.0303401), (1, 1.0105177, -0.1646072, -0.2152096))
ISOTROPIC_ROOT: Table = ((1, 1.9115577, 0.72979103, 0.0055024459), (1, 3.3557257, 3.2437232, 0.8225901))
ISOTROPIC_BOND_ALBEDO: Table = ((1, 0.87528568, 0.16378542, -0.00030203756), (1, 2.1846868, 1.4920327, 0.30637573))
"""Numerator and denominator of the functions of these names."""
LOGARITHM: Table = (
    (-0.02054921058, 0.6862471607, 5.357096823, -10.15702137, 4.894946201, 0.7190951803, -0.7866775426),
)
"""mu log(1 + 1 / mu) over sqrt(mu), as a polynomial in mu^(1/4), from GRAZING on: the product errs by 1e-5."""
ONCE: Table = ((0.9428100524, 0.0470934052, 0.007922268521, 0.0008930825907, 0.001280119134),)
"""(sin x - x cos x) / y^(3/2), as a polynomial in y = 1 - cos x in [0, 1]: relative error 1.1e-6."""
INVERSE: Table = ((2.08307335, -0.0772235339, 0.0236680126, -0.0294406505),)
"""(1 - cos) / y of `invert_phase`, as a polynomial in y = (1 - u)^(2/5): absolute error of cos 8e-5."""


class Directions(NamedTuple):
    """Two directions away from the surface, as BRDFs need them."""

    u: Any  # cosine of the first, at least GRAZING
    v: Any  # cosine of the second
    q: Any  # sin sin cos(phi); positive on the side of retro-reflection
    sin2: Any  # (sin sin)^2

    @classmethod
    def of(cls, wi: Any, wo: Any) -> Directions:
        """Those of two vectors; those below the horizon are meaningless, and masked by the caller."""
        sin2 = (dr.square(wi.x) + dr.square(wi.y)) * (dr.square(wo.x) + dr.square(wo.y))
        return cls(greater(wi.z, GRAZING), greater(wo.z, GRAZING), wi.x * wo.x + wi.y * wo.y, sin2)


# The particles.


def phase(cos: Any) -> Any:
    """Density per steradian of the cosine between propagation directions; Lambertian spheres (Eq. 1).

    p(-1) = 2 / (3 pi) is retro-reflection, p(1) = 0. Mean cosine -4/9.
    """
    cos = dr.clip(cos, -1, 1)
    return (dr.safe_sqrt(1 - cos * cos) - cos * dr.safe_acos(cos)) * (2 / (3 * dr.pi**2))


def fast_phase(cos: Any) -> Any:
    """`phase` without an arc cosine, for BRDFs: relative error 1.1e-6, and none of the rounding near cos = 1.

    g(cos x) = sin x - x cos x obeys g(c) = g(-c) - pi c, so that only the half without the singularity is needed.
    """
    y = greater(1 - dr.abs(cos), 0)
    return (y * dr.sqrt(y) * polynomial(y, ONCE[0]) - dr.pi * lesser(cos, 0)) * (2 / (3 * dr.pi**2))


def phase_cdf(cos: Any) -> Any:
    """Probability of a smaller cosine: the integral of Eq. 1."""
    cos = dr.clip(cos, -1, 1)
    angle = dr.safe_acos(cos)
    primitive = 0.75 * cos * dr.safe_sqrt(1 - cos * cos) - (0.25 + 0.5 * cos * cos) * angle
    return 1 + primitive * (4 / (3 * dr.pi))


def sample_phase(u: Any, v: Any, w: Any) -> Any:
    """Cosine from three uniform numbers, exactly: a point of the lit disc, then a cosine lobe there (Eq. 5)."""
    return dr.sqrt((1 - u) * (1 - v)) * dr.sin(2 * dr.pi * w) - dr.sqrt(u * v)


def sample_phase_approximately(u: Any) -> Any:
    """Cosine from one uniform number, to within 6e-4 (Eq. 6, which says 5e-4). Its density is off by up to 6 %."""
    rest = 1 - dr.power(dr.maximum(u, SMALL), 0.0401885 * u + 1.01938)
    return 1 - 2 * dr.power(dr.maximum(rest, SMALL), 0.397225)


def invert_phase(u: Any) -> Any:
    """Cosine from one uniform number, to rounding: all that Mitsuba has to spare.

    1 - cos is y times a smooth function of y = (1 - u)^(2/5), fitted to within 8e-5; then a step of Newton's.
    """
    y = dr.power(dr.maximum(1 - u, SMALL), 0.4)
    cos = dr.maximum(1 - y * polynomial(y, INVERSE[0]), -1)
    step = (phase_cdf(cos) - u) / (2 * dr.pi * dr.maximum(phase(cos), 1e-9))
    # Near cos = 1 the density vanishes, and rounding takes over.
    return dr.clip(cos - dr.clip(step, -1e-4, 1e-4), -1, 1)


def like_phase(cos: Any) -> Any:
    """Density per steradian, 3 / (16 pi) (1 - cos)^2, like that of `phase` and cheaper: for BSDFs to sample with."""
    return dr.square(1 - cos) * (3 / (16 * dr.pi))


def sample_like_phase(u: Any) -> Any:
    """Cosine with the density `like_phase`, from one uniform number."""
    return 1 - 2 * dr.cbrt(1 - u)


# Albedos.


def root(bond: Any) -> Any:
    """s = sqrt(1 - c) of the particles that make a half space of this Bond albedo: absolute error 5e-7, of c 9.1e-7."""
    return rational(bond, ROOT)


def bond_albedo(s: Any) -> Any:
    """Reflected share of uniform light, k_d, in [0, 1]: absolute error 1.1e-7. The inverse of `root`."""
    return rational(s, BOND_ALBEDO)


def isotropic_root(bond: Any) -> Any:
    """`root` for isotropic scatterers: absolute error 4.1e-9, of c 7e-9."""
    return rational(bond, ISOTROPIC_ROOT)


def isotropic_bond_albedo(s: Any) -> Any:
    """`bond_albedo` for isotropic scatterers: absolute error 2e-9."""
    return rational(s, ISOTROPIC_BOND_ALBEDO)


def rational(x: Any, table: Sequence[Sequence[Any]]) -> Any:
    """(1 - x) times a quotient of polynomials: 1 at 0 and 0 at 1, exactly."""
    top, bottom = table
    return (1 - x) * polynomial(x, top) / polynomial(x, bottom)


def published_root(bond: Any) -> Any:
    """s from k_d by Eq. 39, kept in [0, 1]: k_d is off by up to .033, 3.9 %."""
    rest = dr.maximum(1 - bond, SMALL)
    top, bottom = 1 - 1.00425 * dr.power(rest, 2.67103), 1 - 0.219924 * dr.power(rest, 2.44559)
    return dr.sqrt(keep(1 - top / bottom, SMALL, 1))


def published_bond_albedo(s: Any) -> Any:
    """k_d from s (Eq. 40), kept in [0, 1]: absolute error .0023."""
    return dr.clip((1 - 0.544162 * s - 0.453029 * s * s) / (1 + 1.42931 * s), 0, 1)


def directional_albedo(mu: Any, s: Any) -> Any:
    """Reflected share of the light along ``mu``, 1 - H0 (1 + c Q1 + c Q2 mu): absolute error 3e-4."""
    c = 1 - s * s
    first, second = (polynomial(s, row) for row in ESCAPE)
    return 1 - dr.exp(log_h(features(mu), s, H0)) * (1 + c * (first + second * mu))


def isotropic_directional_albedo(mu: Any, s: Any) -> Any:
    """The same for isotropic scatterers, 1 - s H: exact but for H."""
    return 1 - s * dr.exp(log_h(features(mu), s, ISOTROPIC))


# H functions.


def features(mu: Any) -> tuple[Any, ...]:
    """What log H is linear in: L = mu log(1 + 1 / mu), but for an error of 1e-5, mu, L mu, mu^2."""
    mu = greater(mu, GRAZING)
    square = dr.sqrt(mu)
    log = square * polynomial(dr.sqrt(square), LOGARITHM[0])
    return log, mu, log * mu, mu * mu


def log_h(features: Iterable[Any], s: Any, table: Table) -> Any:
    """Logarithm of H(mu). Of the sum of the features of two directions, that of H(u) H(v)."""
    total = 0
    for feature, row in zip(features, table):
        total = dr.fma(feature, polynomial(s, row), total)
    return (1 - s * s) * total


# BRDFs. With p3 = 1 - 4/3 P1 + 5/16 P2 for phase function, the half space reflects f0 + f1 cos(phi) + f2 cos(2 phi)
# (Horak and Chandrasekhar 1961). What of it was scattered once gives way to the exact single scattering (Eq. 11).


def accurate(pair: Directions, s: Any) -> Any:
    """Exact single scattering, and the three modes of the rest by new fits of H and constants.

    Relative error .04 to .07 % rms for c >= .2; 2 % at most, where both directions are at 89.5 degrees.
    """
    c, both = 1 - s * s, tuple(a + b for a, b in zip(features(pair.u), features(pair.v)))
    h0, h1 = (exp_of_moderate(log_h(both, s, table)) for table in (H0, H1))
    x = log_h(both, s, H2)
    return _modes(pair, c, h0, h1, x + x * x / 2, [c * polynomial(s, row) for row in CONSTANTS])


def published(pair: Directions, s: Any) -> Any:
    """The paper's fits, its errors corrected, without mode 2 (Eq. 21).

    Relative error .4 % rms at c = .5, 1.8 % at c = 1, 10 % at most; H0 1 %, H1 .3 %. Not 0 but 3e-5 at c = 0.
    """
    s = dr.maximum(s, SMALL)
    c = 1 - s * s
    h0, h1 = (f(pair.u, c, s) * f(pair.v, c, s) for f in (_published_h0, _published_h1))
    constants = [
        polynomial(s, top) / polynomial(s, bottom)
        for top, bottom in (
            ((-0.084463, 0.515357, -0.777574, 0.346689), (0.964893, -0.665502, 0.182602)),  # Eq. 34
            ((682.848, -2567.74, 7487.99, -5602.45), (5850.6, -4008.33, 1480.25)),  # Eq. 35
            ((0.285529, 160.397, -327.428, 166.883), (674.191, -412.984, 596.423)),  # Eq. 36
            ((-1.9209, -242.16, -21.9141, 266.063), (1499.9, 457.42, 215.773)),  # Eq. 37
        )
    ]
    constants += [-c * (0.0589037 + 0.00473696 * c), 0.44038 * c]  # Eqs. 26 and 27
    return clamp(_modes(pair, c, h0, h1, 0, constants), 0, dr.inf)


def fast(pair: Directions, s: Any) -> Any:
    """One formula for all that is scattered more than once (Eq. 41). Useful for .3 < c < .96, where it errs by 5 % rms.

    It is zero at many directions for c < .25, and reflects more than it gets for k_d > .8. acos(S) / S is left
    unevaluated where S = sin sin vanishes.
    """
    c, bond, sin = 1 - s * s, bond_albedo(s), dr.sqrt(dr.maximum(pair.sin2, SMALL**2))
    azimuth = dr.safe_acos(dr.clip(pair.q / sin, -1, 1))
    shape = (azimuth + dr.sqrt(pair.u * pair.v)) * sin / (dr.safe_acos(dr.minimum(sin, ONE_BELOW)) + 0.113706 * sin)
    many = 0.0151829 * (c - 0.249978) * shape + 0.234459 * dr.power(dr.maximum(bond, SMALL), 1.85432)
    return clamp(c * _once(pair) / (pair.u + pair.v) + many, 0, dr.inf)


def isotropic(pair: Directions, s: Any) -> Any:
    """Isotropic scatterers (Chandrasekhar 1960): c H(u) H(v) / (4 pi (u + v)). Relative error 1e-3."""
    both = (a + b for a, b in zip(features(pair.u), features(pair.v)))
    return (1 - s * s) * exp_of_moderate(log_h(both, s, ISOTROPIC)) / (4 * dr.pi * (pair.u + pair.v))


def _once(pair: Directions) -> Any:
    """Phase function from the one direction to the other (Eq. 10)."""
    return fast_phase(-pair.q - pair.u * pair.v)


def _modes(pair: Directions, c: Any, h0: Any, h1: Any, h2: Any, constants: Sequence[Any]) -> Any:
    """Exact single scattering (Eq. 10), mode 0 (Eqs. 30, 33, 38), mode 1 (Eqs. 22, 28, doubled) and mode 2.

    ``h0`` and ``h1`` are H(u) H(v), ``h2`` is H(u) H(v) - 1; mode 2 is that of p3, exactly. ``constants``: see
    CONSTANTS. u^2 + v^2 is (u + v)^2 - 2 u v, which makes everything a polynomial in sum and product.
    """
    (b, c_, d, f, l, m_1), total, product = constants, pair.u + pair.v, pair.u * pair.v
    a, e = 69 / 128 * c, 15 / 128 * (1 - c) * c * (4 / 3 * c + 3)
    many0 = polynomial(product, (polynomial(total, (a, b, f)), polynomial(total, (c_ - 2 * f, d)), e))
    once0 = polynomial(product, (polynomial(total, (207, 0, -45)), 256 + 2 * 45, 135))
    many1 = polynomial(product, (polynomial(total, (1, l)), l * l + 45 / 64 * (1 + m_1)))
    once1 = polynomial(product, (64, 45))
    mode1 = pair.q * (h1 * many1 / (3 * dr.pi) - once1 / (192 * dr.pi))
    mode2 = h2 * ((2 * dr.square(pair.q) - pair.sin2) * (15 / (256 * dr.pi)))
    return (h0 * many0 / (2 * dr.pi) + c * (_once(pair) - once0 / (768 * dr.pi) + mode1 + mode2)) / total


def _published_h0(mu: Any, c: Any, s: Any) -> Any:
    """H of mode 0 (Eqs. 31 and 32), its value at infinity without cancellation."""
    a = (1.50112 * dr.power(s, 6.05435) + 8.21644) / (4.17593 - 1.21222 * s)
    d = (7.7731 - 0.565811 * dr.power(s, 0.961546)) / (8.65912 - 0.159974 * s**7)
    x = a * dr.power(mu, d)
    return (1 + x) / (1 + x * s * dr.sqrt((16 - c) * (4 * c + 9)) / 12)


def _published_h1(mu: Any, c: Any, s: Any) -> Any:
    """H of mode 1: Eqs. 23 to 25 with the power that they mean."""
    power = polynomial(mu, (0.459442, -1.07879, 1.85728, -1.12831))
    return dr.exp((0.0242851 * c - 0.144839) * c * dr.power(mu, power))
