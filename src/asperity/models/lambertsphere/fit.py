"""How the tables of `transport` are made, from an exact solution: ``python -m asperity.models.lambertsphere.fit``.

Prints them, ready to paste, with their errors and with those of the digits in transport.py. Needs half a minute;
nothing imports this module when rendering.

The digits in transport.py, but for LOGARITHM and ONCE, are not those printed: they are of an earlier fit of the same
forms, whose script is lost. Those printed have the smallest largest error that the forms allow: .5 to 35 % smaller for
H, up to a factor of three for the constants. They are no better in the BRDF, where scattering of higher order is a
difference that is small for small c: at c = .99 it errs by .05 % rms instead of .07 %, but at c = .2 by .10 % instead
of .05 %, and at the horizon there by 5 % instead of 2 %. So the old digits stay.

Paper (d'Eon 2021)            Here
c, s = sqrt(1 - c)            ``c``, `S`: everything is smooth in s, and is solved at these
mu                            ``mu``, `MU`
A_k (Eqs. 2 to 4)             `expansion`
(0), (1), (2) above symbols   ``mode``; m in the formulas below
Psi (Eqs. 13 to 15)           `characteristic`
K, H (Eqs. 16, 17)            ``k`` in `h_function`, `h_function`
A to F, l, m (Eqs. 22, 30)    `constants`
k_d (Eqs. 39, 40)             `bond_albedo`

What the paper takes from Horak and Chandrasekhar (1961) follows here from functions psi_l of each mode, for any phase
function. Mode m of the BRDF, 2 - [m = 0] times cos(m phi), is

    f = 1 / (4 pi (u + v)) sum_l (-1)^l c A_l (l - m)! / (l + m)! psi_l(u) psi_l(v),    where

    psi_l(u) = P_l^m(u) + u / 2 sum_k (-1)^(l + k) c A_k (k - m)! / (k + m)! psi_k(u) I_kl(u),
    I_kl(u) = int_0^1 psi_k(t) P_l^m(t) / (u + t) dt.

With three terms, psi_l is H times a polynomial. Directional albedo is 1 - psi_1(mu) / mu, of mode 0.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple

import drjit as dr
import numpy as np
from numpy.polynomial.polynomial import polyfit
from scipy.optimize import linprog
from scipy.special import hyp2f1, lpmv

from . import transport

S = np.sin(np.linspace(0.003, np.pi / 2 - 0.003, 41)) ** 2
"""Roots s, denser at both ends, where a polynomial's error is largest; 1e-5 from 0, where the solution is double."""
MU = np.linspace(0.01, 1, 50) ** 2
"""Cosines, from GRAZING on."""
TRUNCATED = {0: 1.0, 1: -4 / 3, 2: 5 / 16}
"""A_k of the paper's phase function p3, of three terms."""
ISOTROPIC = {0: 1.0, 1: 0.0}
"""A_k of isotropic scatterers."""


# The exact solution.


def gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in [0, 1], which crowd at 0 for functions like mu log(mu), and their weights."""
    x, weights = np.polynomial.legendre.leggauss(n)
    x, weights = (x + 1) / 2, weights / 2
    return x**3, weights * 3 * x**2


NODES, WEIGHTS = gauss(28)


def expansion(degree: int) -> dict[int, float]:
    """A_k of Lambertian spheres (Eq. 3), but for those of odd k > 1, which are 0. Gauss-Legendre in the angle."""
    x, weights = np.polynomial.legendre.leggauss(200)
    angle = np.pi / 2 * (1 + x)
    cos, sin = np.cos(angle), np.sin(angle)
    p = 2 * (sin - cos * angle) / (3 * np.pi**2)
    orders = [k for k in range(degree + 1) if k < 2 or k % 2 == 0]
    return {k: float(np.pi**2 * (2 * k + 1) * (p * lpmv(0, k, cos) * sin * weights).sum()) for k in orders}


def psi(phase: dict[int, float], c: float, mode: int, mu: np.ndarray) -> np.ndarray:
    """psi_l(mu) of a mode, a row for every l of ``phase`` (its A_l) from ``mode`` on. Needs c < 1.

    By Newton's method at the nodes, from P_l on; then once more by the equation, which is linear in psi(mu).
    """
    orders = [k for k in phase if k >= mode]
    p, size = legendre(orders, mode, NODES), len(orders) * len(NODES)
    factors = (-1.0) ** np.add.outer(orders, orders) * strengths(phase, c, mode)

    def kernel(x: np.ndarray) -> np.ndarray:
        return x[:, None] / 2 * WEIGHTS / np.add.outer(x, NODES)

    def matrix(x: np.ndarray) -> np.ndarray:
        """What psi_k(x) is multiplied by in the equation for psi_l(x): (x, l, k)."""
        return np.einsum("lk,xt,kt,lt->xlk", factors, kernel(x), found, p, optimize=True)

    found, step = p, np.ones_like(p)
    while np.abs(step).max() > 1e-10:
        error = found - p - np.einsum("xlk,kx->lx", matrix(NODES), found)
        slope = np.einsum("xlk,xt->lxkt", matrix(NODES), np.eye(len(NODES)))
        slope += np.einsum("lk,kx,xt,lt->lxkt", factors, found, kernel(NODES), p, optimize=True)
        step = np.linalg.solve(np.eye(size) - slope.reshape(size, size), error.ravel()).reshape(p.shape)
        found = found - step
    return np.linalg.solve(np.eye(len(orders)) - matrix(mu), legendre(orders, mode, mu).T[:, :, None])[:, :, 0].T


def legendre(orders: list[int], mode: int, mu: np.ndarray) -> np.ndarray:
    """P_l^m(mu), a row for every l, positive for l = m."""
    return (-1.0) ** mode * np.stack([lpmv(mode, k, mu) for k in orders])


def strengths(phase: dict[int, float], c: float, mode: int) -> np.ndarray:
    """c A_k (k - m)! / (k + m)! for k from m on."""
    return c * np.array([a * factorial(k - mode) / factorial(k + mode) for k, a in phase.items() if k >= mode])


def brdf_mode(phase: dict[int, float], c: float, mode: int, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """What multiplies cos(m phi) in the BRDF, less its single scattering, at pairs of cosines; per steradian."""
    orders = [k for k in phase if k >= mode]
    many = psi(phase, c, mode, u) * psi(phase, c, mode, v) - legendre(orders, mode, u) * legendre(orders, mode, v)
    signs = (-1.0) ** np.array(orders) * (1 if mode == 0 else 2)
    return (signs * strengths(phase, c, mode)) @ many / (4 * np.pi * (u + v))


def characteristic(c: float, mode: int) -> np.ndarray:
    """Psi (Eqs. 13 to 15), by its coefficients of 1, mu^2, mu^4."""
    if mode == 0:
        return c / 384 * np.array([207, c * (20 * c + 281) - 346, -15 * (c - 1) * (4 * c + 9)])
    if mode == 1:
        return -c / 192 * np.convolve([-1, 1], [-64, 5 * (4 * c + 9)])
    return 15 / 256 * c * np.array([1, -2, 1])


def h_function(coefficients: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """H(mu) of a characteristic function, given as above (Eq. 16); c < 1. Sum of even steps in log(t).

    Eqs. 18 to 20 cancel at small t. Here int_0^1 x^(2 j) / (1 + x^2 t^2) dx, of Eq. 17 with x = 1 / s, is a
    hypergeometric function.
    """
    t, step = np.exp(np.arange(-40, 40, 0.05)), 0.05
    k = 1 - 2 * sum(a / (2 * j + 1) * hyp2f1(1, j + 0.5, j + 1.5, -t * t) for j, a in enumerate(coefficients))
    return np.exp(-mu / np.pi * (t * np.log(k) * step / (1 + np.multiply.outer(mu, t) ** 2)).sum(axis=-1))


def quotients(c: float, mode: int) -> np.ndarray:
    """psi_l / (H (1 - mu^2)^(m / 2)) of three terms: polynomials in mu, of degree 2 - m, a row for every l.

    Mode 1: 1 + l mu, and 3 sqrt(m) mu with the paper's l and m. Mode 2: 3.
    """
    factor = h_function(characteristic(c, mode), NODES) * (1 - NODES**2) ** (mode / 2)
    return polyfit(NODES, (psi(TRUNCATED, c, mode, NODES) / factor).T, 2 - mode).T


def constants(c: float) -> dict[str, float]:
    """A to F of Eq. 30, l and m of Eq. 22."""
    q, factors = quotients(c, 0), (-1.0) ** np.arange(3) * strengths(TRUNCATED, c, 0) / 2
    (a, b, f), (_, c_, d), (_, _, e) = np.einsum("l,lj,lk->jk", factors, q, q)
    first, second = quotients(c, 1)
    return {"A": a, "B": b, "C": c_, "D": d, "E": e, "F": f, "l": first[1], "m": (second[1] / 3) ** 2}


def directional_albedo(phase: dict[int, float], c: float, mu: np.ndarray) -> np.ndarray:
    """Reflected share of the light along ``mu``."""
    return 1 - psi(phase, c, 0, mu)[1] / mu


def bond_albedo(phase: dict[int, float], c: float) -> float:
    """k_d: the reflected share of uniform light."""
    return 2 * WEIGHTS @ (NODES * directional_albedo(phase, c, NODES))


# The fits.


class Fit(NamedTuple):
    """Rows of coefficients, and the largest error."""

    rows: transport.Table
    error: float
    present: float  # the error with the digits in transport.py


def tables() -> dict[str, list[Fit]]:
    """The tables of transport.py by their names: of `transport.CONSTANTS` and `transport.ESCAPE`, a fit of each row."""
    cs = 1 - S**2
    b_to_m = np.array([[x["B"], x["C"], x["D"], x["F"], x["l"], x["m"] - 1] for x in map(constants, cs)])
    escape = np.array([quotients(c, 0)[1, 1:] for c in cs]) - [1, 0]  # 1 + c Q1, c Q2
    bond, isotropic_bond = (np.array([bond_albedo(phase, c) for c in cs]) for phase in (expansion(10), ISOTROPIC))
    return {
        "H0": [fit_h([characteristic(c, 0) for c in cs], transport.H0)],
        "H1": [fit_h([characteristic(c, 1) for c in cs], transport.H1)],
        "H2": [fit_h([characteristic(c, 2) for c in cs], transport.H2)],
        "ISOTROPIC": [fit_h([np.array([c / 2]) for c in cs], transport.ISOTROPIC)],
        "CONSTANTS": [fit_over_c(values, row) for values, row in zip(b_to_m.T, transport.CONSTANTS)],
        "ESCAPE": [fit_over_c(values, row) for values, row in zip(escape.T, transport.ESCAPE)],
        "ROOT": [fit_rational(bond, S, transport.ROOT)],
        "BOND_ALBEDO": [fit_rational(S, bond, transport.BOND_ALBEDO)],
        "ISOTROPIC_ROOT": [fit_rational(isotropic_bond, S, transport.ISOTROPIC_ROOT)],
        "ISOTROPIC_BOND_ALBEDO": [fit_rational(S, isotropic_bond, transport.ISOTROPIC_BOND_ALBEDO)],
        "LOGARITHM": [fit_logarithm(transport.LOGARITHM)],
        "ONCE": [fit_once(transport.ONCE)],
        "INVERSE": [fit_inverse(transport.INVERSE)],
    }


def fit_h(characteristics: list[np.ndarray], table: transport.Table) -> Fit:
    """H at every s of `S`; the error of its logarithm, which is the relative one."""
    values = np.concatenate([np.log(h_function(psi, MU)) for psi in characteristics])
    log = MU * np.log(1 + 1 / MU)
    powers = [((1 - S**2) * S**j, f) for f, row in zip((log, MU, log * MU, MU**2), table) for j in range(len(row))]
    return linear(np.stack([np.outer(*pair).ravel() for pair in powers], axis=1), values, table)


def fit_over_c(values: np.ndarray, row: tuple[float, ...]) -> Fit:
    """c times a polynomial in s."""
    return linear((1 - S**2)[:, None] * np.vander(S, len(row), increasing=True), values, (row,))


def fit_logarithm(table: transport.Table) -> Fit:
    """mu log(1 + 1 / mu) over sqrt(mu), by powers of mu^(1/4)."""
    root = 0.55 - 0.45 * np.cos(np.linspace(0, np.pi, 400))  # from GRAZING^(1/4) on
    values = root**4 * np.log(1 + root**-4)
    return linear(root[:, None] ** 2 * np.vander(root, len(table[0]), increasing=True), values, table)


def fit_once(table: transport.Table) -> Fit:
    """(sin x - x cos x) / y^(3/2) by powers of y = 1 - cos x, which is an integral of sqrt(t (1 - y t / 2))."""
    y = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 400))
    values = 8**0.5 / 3 * hyp2f1(0.5, 0.5, 2.5, y / 2)
    return linear(np.vander(y, len(table[0]), increasing=True) / values[:, None], np.ones_like(y), table)


def fit_inverse(table: transport.Table) -> Fit:
    """1 - cos by powers of y = (1 - u)^(2/5), u the probability of a smaller cosine."""
    cos = np.cos(np.linspace(0, np.pi, 400))
    y = np.array([max(1 - transport.phase_cdf(float(x)), 0) for x in cos]) ** 0.4
    return linear(y[:, None] * np.vander(y, len(table[0]), increasing=True), 1 - cos, table)


def fit_rational(x: np.ndarray, values: np.ndarray, table: transport.Table) -> Fit:
    """Both polynomials of `transport.rational`, 1 at 0. Multiplied by the lower one, the problem is linear.

    Divided by that of the round before, its error is what is to be small.
    """
    powers, bottom = np.vander(x, 4, increasing=True), np.ones_like(x)
    for _ in range(6):
        columns = np.hstack([(1 - x)[:, None] * powers[:, 1:], -values[:, None] * powers[:, 1:]]) / bottom[:, None]
        best = rounded(chebyshev(columns, (values - (1 - x)) / bottom))
        rows = tuple((1.0, *half) for half in np.split(best, 2))
        bottom = powers @ rows[1]
    at = dr.scalar.ArrayXf64(x)
    error, present = (float(np.abs(np.array(transport.rational(at, pair)) - values).max()) for pair in (rows, table))
    return Fit(rows, error, present)


def linear(columns: np.ndarray, values: np.ndarray, table: transport.Table) -> Fit:
    """Of columns (n, k), for which ``table`` has the k factors, in rows."""
    best = rounded(chebyshev(columns, values))
    error, present = (float(np.abs(columns @ x - values).max()) for x in (best, np.concatenate(table)))
    return Fit(tuple(map(tuple, np.split(best, np.cumsum([len(row) for row in table])[:-1]))), error, present)


def chebyshev(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Factors of columns (n, k) whose sum has the smallest largest error against values (n,).

    By linear programming, in units of the error that was left by the round before: its own tolerance is 1e-7.
    """
    factors, ones = np.linalg.lstsq(columns, values, rcond=None)[0], np.ones((len(values), 1))
    within, goal = np.block([[columns, -ones], [-columns, -ones]]), np.append(np.zeros(columns.shape[1]), 1)
    for _ in range(2):
        rest = values - columns @ factors
        unit = np.abs(rest).max()
        factors = factors + unit * linprog(goal, within, np.append(rest, -rest) / unit, bounds=(None, None)).x[:-1]
    return factors


def rounded(factors: np.ndarray) -> np.ndarray:
    """To ten digits, which the smallest errors need."""
    return np.array([float(f"{x:.10g}") for x in factors])


def main() -> None:
    """Print the tables, each with its errors here and now."""
    for name, found in tables().items():
        print(f"{name}: Table = (")
        for row in (row for fit in found for row in fit.rows):
            print(f"    ({', '.join(f'{x:.10g}' for x in row)}),")
        print(f")  # errors: {', '.join(f'{fit.error:.2g}' for fit in found)}")
        print(f"# of transport.py: {', '.join(f'{fit.present:.2g}' for fit in found)}\n")


if __name__ == "__main__":
    main()
