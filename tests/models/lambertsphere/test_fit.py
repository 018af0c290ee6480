"""The exact solution, against what is known of it; the tables of transport.py and those made anew, against it.

"Notes" are our own (shared/notes/lambertsphere.md): from an earlier solution, checked by random walks.
"""

import asperity  # noqa: F401  isort: skip
from functools import cache

import numpy as np
import pytest
from helpers import float64
from numpy.polynomial.polynomial import polyval

from asperity.models.lambertsphere import fit, transport

ERRORS = {  # as the docstrings of transport.py have them; of both roots, that of c, too
    "H0": 6.2e-4, "H1": 1.9e-4, "H2": 4.7e-4, "ISOTROPIC": 4.7e-4, "CONSTANTS": (9e-6, 22e-6, 3e-6, 11e-6, 5e-5, 5e-5),
    "ESCAPE": 6e-6, "ROOT": (5e-7, 9.1e-7), "BOND_ALBEDO": 1.1e-7, "ISOTROPIC_ROOT": (4.1e-9, 7e-9),
    "ISOTROPIC_BOND_ALBEDO": 2e-9, "LOGARITHM": 1e-5, "ONCE": 1.1e-6, "INVERSE": 8e-5,
}  # fmt: skip

# The exact solution.


@pytest.mark.parametrize(
    "c, exact",
    [
        (0.05, (0.000331, 0.031666, 0.000080, -0.005775, -0.002944, 1.02221)),
        (0.5, (0.023443, 0.167788, 0.013135, -0.046640, -0.030647, 1.22089)),
        (0.8, (0.030551, 0.121920, 0.035235, -0.051956, -0.050155, 1.35198)),
        (0.99, (-0.043558, 0.091400, 0.020637, -0.016443, -0.062878, 1.43438)),
    ],
)
def test_constants(c, exact):
    """Notes, section 4, to their six decimals; A and E of Eq. 33, to the error of 28 nodes."""
    found = fit.constants(c)
    assert [found[x] for x in "BCDFlm"] == pytest.approx(exact, abs=6e-6)
    assert found["A"] == pytest.approx(69 / 128 * c, abs=1e-8)
    assert found["E"] == pytest.approx(15 / 128 * (1 - c) * c * (4 * c / 3 + 3), abs=1e-8)


@pytest.mark.parametrize("c", [0.05, 0.5, 0.99, 1 - 1e-10])
def test_h_functions_and_psi_functions_agree(c):
    """Eq. 16 and the equation for psi_l share nothing; H at infinity is that of Eq. 32."""
    assert fit.quotients(c, 2)[0] == pytest.approx(3, abs=1e-7)
    assert [fit.quotients(c, m)[0, 0] for m in (0, 1)] == pytest.approx([1, 1], abs=1e-7)
    mu = fit.NODES
    isotropic = np.sqrt(1 - c) * fit.h_function(np.array([c / 2]), mu)
    assert fit.directional_albedo(fit.ISOTROPIC, c, mu) == pytest.approx(1 - isotropic, abs=1e-8)
    if c < 0.999:  # nearer to 1, infinity is farther
        infinite = 12 / np.sqrt((16 - c) * (1 - c) * (4 * c + 9))
        assert fit.h_function(fit.characteristic(c, 0), np.array([1e9])) == pytest.approx(infinite, rel=1e-7)


def test_expansion():
    """Eq. 4."""
    known = {0: 1, 1: -4 / 3, 2: 5 / 16, 4: 1 / 64, 6: 13 / 4096}
    assert fit.expansion(6) == pytest.approx(known, abs=1e-10)


def test_what_is_absorbed_and_reflected():
    """Notes, section 5: directional albedo at mu = .02, .1, .3, .6, 1, and that of uniform light."""
    lambert, mu = fit.expansion(10), np.array([0.02, 0.1, 0.3, 0.6, 1.0])
    exact = (0.78912, 0.76085, 0.71054, 0.65580, 0.60281)
    assert fit.directional_albedo(lambert, 0.95, mu) == pytest.approx(exact, abs=5.1e-6)
    assert fit.bond_albedo(lambert, 0.95) == pytest.approx(0.64979, abs=5.1e-6)


# The tables.


def test_linear_programme_finds_the_chebyshev_polynomial():
    """T_4 / 8 is the smallest quartic with x^4: what is left of x^4 after the best cubic, here in units of 1e-9."""
    x = np.cos(np.linspace(0, np.pi, 201))
    factors = fit.chebyshev(np.vander(x, 4, increasing=True), 1e-9 * x**4)
    assert factors == pytest.approx(1e-9 * np.array([-1 / 8, 0, 1, 0]), abs=1e-15)


@cache
def fits():
    return fit.tables()


@cache
def exact():
    """On a grid that is not that of `fit`: s, mu, H of each table, constants over c and escape, both Bond albedos."""
    s, mu = np.sin(np.linspace(0.003, np.pi / 2 - 0.003, 62)) ** 2, np.linspace(0.01, 1, 87) ** 2
    cs = 1 - s * s
    h = {f"H{m}": np.array([fit.h_function(fit.characteristic(c, m), mu) for c in cs]) for m in range(3)}
    h["ISOTROPIC"] = np.array([fit.h_function(np.array([c / 2]), mu) for c in cs])
    constants = np.array([[x[name] - (name == "m") for name in "BCDFlm"] for x in map(fit.constants, cs)]).T
    escape = np.array([fit.quotients(c, 0)[1, 1:] - [1, 0] for c in cs]).T
    bond = [np.array([fit.bond_albedo(phase, c) for c in cs]) for phase in (fit.expansion(10), fit.ISOTROPIC)]
    return s, mu, h, constants, escape, *bond


def errors(tables):
    """The largest of each table, by the functions of `transport`; of CONSTANTS and ESCAPE, of each row."""
    s, mu, h, constants, escape, bond, isotropic = exact()
    c, log, cos = 1 - s * s, mu * np.log(1 + 1 / mu), np.cos(np.linspace(0, np.pi, 1000))
    y = np.array([max(1 - transport.phase_cdf(x), 0) for x in cos.tolist()]) ** 0.4
    x = np.linspace(0.01, np.pi / 2, 1000)
    once = (1 - np.cos(x)) ** 1.5

    def logarithm(table):
        *features, roots = (float64(x.ravel()) for x in np.broadcast_arrays(log, mu, log * mu, mu * mu, s[:, None]))
        return np.array(transport.log_h(features, roots, table)).reshape(len(s), len(mu))

    def rational(x, table):
        return np.array(transport.rational(float64(x), table))

    def over_c(name, exact):
        return np.array([np.abs(c * polyval(s, row) - x).max() for row, x in zip(tables[name], exact)])

    def of_root(name, bond):
        found = rational(bond, tables[name])
        return np.array([np.abs(found - s).max(), np.abs(found**2 - s**2).max()])

    return {name: np.abs(np.exp(logarithm(tables[name])) / exact - 1).max() for name, exact in h.items()} | {
        "CONSTANTS": over_c("CONSTANTS", constants),
        "ESCAPE": over_c("ESCAPE", escape),
        "ROOT": of_root("ROOT", bond),
        "BOND_ALBEDO": np.abs(rational(s, tables["BOND_ALBEDO"]) - bond).max(),
        "ISOTROPIC_ROOT": of_root("ISOTROPIC_ROOT", isotropic),
        "ISOTROPIC_BOND_ALBEDO": np.abs(rational(s, tables["ISOTROPIC_BOND_ALBEDO"]) - isotropic).max(),
        "LOGARITHM": np.abs(np.sqrt(mu) * polyval(mu**0.25, tables["LOGARITHM"][0]) - log).max(),
        "ONCE": np.abs(once * polyval(1 - np.cos(x), tables["ONCE"][0]) / (np.sin(x) - x * np.cos(x)) - 1).max(),
        "INVERSE": np.abs(y * polyval(y, tables["INVERSE"][0]) - (1 - cos)).max(),
    }


@pytest.mark.slow
def test_tables_have_the_errors_that_docstrings_say():
    """And not much smaller ones: what is said is at most 15 % more, by rounding up."""
    found = errors({name: getattr(transport, name) for name in ERRORS})
    for name, said in ERRORS.items():
        assert np.all(found[name] < said), name
        assert np.all(found[name] > 0.85 * np.array(said)), name


@pytest.mark.slow
def test_tables_made_anew_have_them_too():
    """Between the points where they are fitted, too; there, they are no worse than those of transport.py."""
    found = errors({name: [row for each in some for row in each.rows] for name, some in fits().items()})
    for name, said in ERRORS.items():
        assert np.all(found[name] < said), name
        assert all(each.error <= each.present for each in fits()[name]), name
