"""The two-scale model against waves over random heights, and against its facets one by one (Holzschuch 2017)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import astuple
from itertools import pairwise
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from ..goniophotometer import Estimate
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..microfacet.distributions import EPD
from ..models.twoscale.microgeometry import Facets, RandomHeights, far_field
from ..scenes import presets
from . import figures
from .report import Effort, Finding, Section, Table, agreement, told_apart

GREEN = 0.55
"""Micrometres: of all that is measured at one wavelength."""
MIRRORED, DIFFRACTED, BOTH = 0, 1, 0xFFFFFFFF
"""Components of the BSDF."""
B, C = 1.2, 2.3
"""Correlation length and exponent, where they stay the same."""


def description(facets: Facets, **others: Any) -> dict[str, Any]:
    """A mirror of these facets, as a scene has it."""
    names = "alpha", "p", "sigma_s", "b", "c"
    return {"type": "twoscale", "material": "none"} | dict(zip(names, map(float, astuple(facets)))) | others


def reflected(
    given: dict[str, Any], i: np.ndarray, o: np.ndarray, component: int = BOTH, wavelength: float = GREEN
) -> np.ndarray:
    """f of pairs of directions (n, 3), at one wavelength in micrometres."""
    bsdf = evaluate.load(given | {"wavelengths": [wavelength] * 3})
    si = evaluate.interaction(evaluate.vectors(i), len(i), [1e3 * wavelength] * len(mi.UnpolarizedSpectrum()))
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), component)
    value = mi.unpolarized_spectrum(bsdf.eval(context, si, evaluate.vectors(o)))
    return evaluate.to_numpy(value, len(i))[0] / o[:, 2]


CELLS, WAVES = 256, 64
"""Of squares of random heights: cells, and wavelengths, along a side. Their highest frequency is 2 per wavelength."""
RINGS, NARROW = (0.1, 0.3, 0.5, 0.7, 0.85, 0.94), 0.004
"""Radii of rings in the disc of directions, along which cos_o is one number, and their half widths times the radius."""
SURFACES = {0.0: (0.01, 0.02, 0.05, 0.1, 0.2), 30.0: (0.02, 0.1), 60.0: (0.02, 0.1), 75.0: (0.02, 0.1)}
"""By the angle of incidence: rms heights, over the wavelength."""
CLAIMED = 0.02
"""Up to this share of the wavelength, what is diffracted is said to be one order of a series in the heights."""
CERTAIN = 0.1
"""Up to this share, A is more than the finite squares' lobe at order 0."""
RING = 1e-3
"""Relative error of taking the lobe over the width of a ring, at most, and of the squares' finite size."""


class Waves(NamedTuple):
    """What random heights make of light: by tile, and directions (orders, 3) of cells that are lists of orders."""

    coherent: np.ndarray
    cells: np.ndarray  # (tiles, cells), per area of the disc of directions
    i: np.ndarray
    o: np.ndarray
    members: list[slice]

    def means(self, values: np.ndarray) -> np.ndarray:
        """Of values at all orders, over cells."""
        return np.array([values[part].mean() for part in self.members])


def estimate(tiles: np.ndarray) -> Estimate:
    """Mean over tiles and its standard error."""
    return Estimate(tiles.mean(axis=0), tiles.std(axis=0, ddof=1) / np.sqrt(len(tiles)))


def scatter(sigma: float, theta: float, effort: Effort) -> Waves:
    """Light from ``theta`` degrees, rounded to an order, on surfaces of the rms height ``sigma`` wavelengths."""
    step = 1 / WAVES
    s = round(np.sin(np.radians(theta)) / step) * step
    cos_i = np.sqrt(1 - s * s)
    surface = RandomHeights(sigma * GREEN, B, C, WAVES * GREEN, CELLS, (1 + s) / GREEN)
    x, y = np.broadcast_arrays(*(f * GREEN for f in surface.orders))
    x = x - s  # the mirror direction is that of the order 0
    radius, turn = np.hypot(x, y), np.degrees(np.arctan2(np.abs(y), -x)) // 45 * (s > 0)
    parts = [
        (ring, np.flatnonzero((np.abs(radius - ring) < NARROW / ring) & (turn == sector) & (np.hypot(x + s, y) > 0)))
        for ring in RINGS
        for sector in range(4)
    ]
    parts = [(ring, orders) for ring, orders in parts if len(orders)]
    tiles, coherent = np.zeros((effort.tiles, len(parts))), np.zeros(effort.tiles)
    rng, surfaces = np.random.default_rng(effort.seed), max(2, int(effort.paths / 1e5))
    for tile in range(effort.tiles):
        for _ in range(surfaces):
            effort.tick()
            drawn = surface.heights(rng)
            coherent[tile] += far_field(drawn, 4 * np.pi * cos_i / GREEN)[0, 0] / surfaces
            for ring in RINGS:
                sent = far_field(drawn, 2 * np.pi * (cos_i + np.sqrt(1 - ring**2)) / GREEN).ravel()
                for n, (of, orders) in enumerate(parts):
                    if of == ring:
                        tiles[tile, n] += sent[orders].mean() / step**2 / surfaces
    ends = np.cumsum([0] + [len(orders) for _, orders in parts])
    orders = np.concatenate([orders for _, orders in parts])
    o = np.stack([x.ravel()[orders], y.ravel()[orders]], axis=1)
    o = np.column_stack([o, np.sqrt(1 - np.square(o).sum(axis=1))])
    i = np.broadcast_to([s, 0, cos_i], o.shape)
    return Waves(coherent, tiles, i, o, [slice(a, b) for a, b in pairwise(ends)])


def heights(effort: Effort) -> Section:
    """Eq. 19 and 25: smooth facets, whose finer roughness is a surface of random heights."""
    findings, rows, lines = [], [], {}
    for theta, sigma in ((theta, sigma) for theta, sigmas in SURFACES.items() for sigma in sigmas):
        waves, smooth = scatter(sigma, theta, effort), Facets(1e-3, 1.0, sigma * GREEN, B, C)
        truth, coherent = estimate(waves.cells), estimate(waves.coherent[:, None])
        lobe, A = reflected(description(smooth), waves.i, waves.o, DIFFRACTED), mirrored(smooth, waves.i[:1])
        name = f"σ/λ {sigma:g}, θi {theta:g}°"
        if sigma <= CLAIMED:
            rivals = sigma == SURFACES[0.0][0]
            findings += judged(name, sigma, waves, lobe, effort.tiles, rivals)
        if theta == 0 and sigma <= CERTAIN:
            claim = f"{name}: A, what stays in the mirror direction"
            findings.append(agreement(claim, coherent, A, effort.tiles, RING))
        off = waves.means(lobe) / truth.value - 1
        shares = f"{A[0]:.4f}", f"{coherent.value[0]:.4f} ± {coherent.error[0]:.4f}" if theta == 0 else "-"
        rows.append((sigma, theta, *shares, *(f"{x:+.1%}" for x in (np.median(off), off.min(), off.max()))))
        if theta == 0:
            lines[sigma] = waves, lobe, truth
    return Section(
        "Waves over random heights (Eq. 16, 19, 25)",
        f"A smooth mirror, b {B:g} µm, c {C:g}, λ {GREEN:g} µm: Gaussian surfaces of the power spectrum, squares of "
        f"{WAVES} wavelengths. Each delays a scalar wave by its heights; a Fourier transform adds up the rest, which "
        "are compared in rings around the normal, for oblique light in parts of them. The model's lobe is of first "
        "order in the heights. What is diffracted twice would be spread once more: that is at most 1 - exp(-(4πσ/λ)²) "
        f"of it, which claims allow, up to σ/λ {CLAIMED:g}. A is compared at normal incidence: of oblique light, waves "
        "of the surface along it turn more than waves against it to real directions, but surfaces have both alike. "
        "Least and largest have the noise of the surfaces.",
        findings,
        [Table(("σ/λ", "θi", "A", "A of the waves", "lobe / waves - 1, median", "least", "largest"), rows)],
        {"heights": lobes_of_heights(lines)},
    )


def mirrored(facets: Facets, i: np.ndarray) -> np.ndarray:
    """A of the model: what the finer roughness leaves in the mirror direction."""
    kept, every = (
        reflected(given, i, i * [-1, -1, 1], MIRRORED)
        for given in (description(facets), description(facets, sigma_s=0.0))
    )
    return kept / every


def judged(name: str, sigma: float, waves: Waves, lobe: np.ndarray, tiles: int, rivals: bool) -> list[Finding]:
    """Whether waves agree with a lobe; and whether they refuse others."""
    tolerance = RING - np.expm1(-((4 * np.pi * sigma) ** 2))

    def compared(claim: str, values: np.ndarray) -> Finding:
        return agreement(claim, estimate(waves.cells), waves.means(values), tiles, tolerance)

    ours = compared(f"{name}: lobe", lobe)
    if not rivals:
        return [ours]
    facing = np.square((waves.i + waves.o)[:, 2]) / np.square(waves.i + waves.o).sum(axis=1)
    others = {"twice the lobe, as in the authors' plugin,": 2 * lobe, "a lobe without (h.m)²": lobe / facing}
    return [ours, *(told_apart(f"{rival} is refused", ours, compared("", values)) for rival, values in others.items())]


def lobes_of_heights(lines: dict[float, tuple[Waves, np.ndarray, Estimate]]) -> Any:
    """Normal incidence: bars are waves, lines are the model's."""
    figure, grid = figures.panels(1, len(lines), "sin θₒ", "f [1/sr]", "waves over random heights, normal incidence")
    for axes, (sigma, (waves, lobe, truth)) in zip(grid[0], lines.items()):
        radius = np.hypot(waves.o[:, 0], waves.o[:, 1])
        order = np.argsort(radius)
        axes.plot(radius[order], lobe[order], color="tab:red", linewidth=0.9, label="model")
        axes.errorbar(RINGS, truth.value, 3 * truth.error, fmt="o", markersize=3, color="black", label="waves")
        axes.set_title(f"σ/λ {sigma:g}", fontsize=9)
        axes.set_yscale("log")
    grid[0, 0].legend(fontsize=7)
    return figure


MATERIALS = {
    Facets(0.02, 1, 0.01, 1.2, 2.3): (0.004, 0.009, 0.013),
    Facets(0.05, 0.8, 0.02, 2, 2): (0.026, 0.056, 0.075),
    Facets(0.1, 0.7, 0.01, 1.2, 2.3): (0.054, 0.11, 0.15),
    Facets(0.1, 0.7, 0.06, 1.2, 2.3): (0.15, 0.35, 0.44),
    Facets(0.2, 1, 0.02, 1.2, 2.3): (0.08, 0.19, 0.22),
    Facets(0.3, 1, 0.02, 1.2, 2.3): (0.09, 0.30, 0.46),
    Facets(0.3, 0.6, 0.02, 0.6, 2.9): (0.16, 0.52, 0.88),
}
"""With |ln(separated / by facet)|, its median, 90th percentile and largest of 150 pairs below 60 degrees, as another
implementation of the same integrals found them."""
SMALL, CLOSE = 0.05, 0.08
"""Widths of facets up to which the paper's separation is claimed to be good, and how good, of 90 % of directions."""
PAIRS, PERCENTILE = 150, 1.7
"""So many pairs below 60 degrees, at least: their 90th percentile and its own deviate by .12, and four times that."""
LIMITS = 60.0, 75.0, 85.0
WHOLE = 4e-3, 0.012
"""Relative error of the lobe's value, 99th percentile and worst: those of the tables (`tables`) together."""


def pairs(rng: np.random.Generator, n: int, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3), even over the hemisphere below ``limit`` degrees."""
    theta = np.degrees(np.arccos(rng.uniform(np.cos(np.radians(limit)), 1, (2, n))))
    phi = rng.uniform(0, 360, (2, n))
    i, o = (directions(list(zip(*angles))) for angles in zip(theta, phi))
    return i, o


def shadowing(facets: Facets, i: np.ndarray, o: np.ndarray) -> float:
    """G, correlated by height."""
    return 1 / (1 + facets.smith_lambda(i) + facets.smith_lambda(o))


def facet_by_facet(effort: Effort) -> Section:
    """How far the paper's separation of D and S from masking and obliquity is from the integral over facets."""
    findings, rows, off = [], [], []
    rng, count = np.random.default_rng(effort.seed), int(effort.paths / 1e4)
    for facets, known in MATERIALS.items():
        row: list[Any] = [f"{x:g}" for x in astuple(facets)]
        for limit in LIMITS:
            i, o = pairs(rng, max(count, PAIRS) if limit == LIMITS[0] else count, limit)
            effort.tick()
            separated, truth = np.array([facets.diffracted(*pair, GREEN) for pair in zip(i, o)]).T
            lobe = reflected(description(facets, masking="height"), i, o, DIFFRACTED)
            G = np.array([shadowing(facets, *pair) for pair in zip(i, o)])
            off.append(np.abs(lobe / (separated * G) - 1))
            error = np.abs(np.log(lobe / (truth * G)))
            found = np.median(error), np.quantile(error, 0.9), error.max()
            row.append(" / ".join(f"{x:.2g}" for x in found))
            if limit == LIMITS[0]:
                name, ratio = f"α {facets.alpha:g}, p {facets.p:g}, σ {facets.sigma_s:g}", found[1] / known[1]
                findings.append(
                    Finding(
                        f"{name}: 90 % of errors below {limit:g}°",
                        f"{found[1]:.2g}; another implementation: {known[1]:g}",
                        f"a factor of {PERCENTILE:g}",
                        bool(1 / PERCENTILE < ratio < PERCENTILE),
                    )
                )
                if facets.alpha <= SMALL:
                    close = bool(found[1] <= CLOSE)
                    findings.append(Finding(f"{name}: close to the integral", f"{found[1]:.1%}", f"{CLOSE:.0%}", close))
                i, o = i[: count // 4], o[: count // 4]
                own = [facets.diffracted(*pair, GREEN, own=True)[1] for pair in zip(i, o)]
                change = np.abs(np.log(own / truth[: count // 4]))
        rows.append((*row, f"{np.quantile(change, 0.9):.2g}"))
    errors = np.concatenate(off)
    p99, worst = np.quantile(errors, 0.99), errors.max()
    findings.insert(
        0,
        Finding(
            f"the plugin is the separated integral, {len(errors)} pairs",
            f"99 %: {p99:.2%}, worst: {worst:.2%}",
            f"{WHOLE[0]:.1%}, {WHOLE[1]:.1%}",
            bool(p99 < WHOLE[0] and worst < WHOLE[1]),
        ),
    )
    angles = (f"below {limit:g}°" for limit in LIMITS)
    return Section(
        "Facets one by one (Eq. 32 and the integral before it)",
        "What facets diffract, F = 1: by each facet's normal, with the light that falls on it and the share of it that "
        "is seen, against the model, where D and S are convolved without them. |ln(model / facets)|, median / 90 % / "
        f"largest of {max(count, PAIRS)} pairs of directions below 60°, and of {count} below the others. Facets take R "
        "at θd, as the paper does; the last column is what it changes to take it at their own incidence. The model is "
        "too bright where light grazes in the mirror direction, too dark where one direction is steep; with large σ "
        "it is too dark away from it.",
        findings,
        [Table(("α", "p", "σ", "b", "c", *angles, "own R"), rows)],
        {"facets": plane_of_incidence()},
    )


def plane_of_incidence() -> Any:
    """The lobe in the plane of incidence: dots are facets one by one, lines the model's."""
    chosen = [list(MATERIALS)[n] for n in (0, 1, 2, 5)]
    title = "what facets diffract, λ 0.55 µm"
    figure, grid = figures.panels(3, len(chosen), "θₒ [°], negative towards the light", "f cos θₒ [1/sr]", title)
    theta = np.linspace(-85, 85, 35)
    o = directions([(abs(t), 180.0 * (t > 0)) for t in theta])
    for row, incidence in enumerate((10.0, 50.0, 75.0)):
        i = np.broadcast_to(directions([(incidence, 0.0)])[0], o.shape)
        for axes, facets in zip(grid[row], chosen):
            lobe = reflected(description(facets, masking="height"), i, o, DIFFRACTED)
            G = np.array([shadowing(facets, *pair) for pair in zip(i, o)])
            truth = G * [facets.diffracted(*pair, GREEN)[1] for pair in zip(i, o)]
            axes.plot(theta, truth * o[:, 2], "o", markersize=2.5, color="tab:green")
            axes.plot(theta, lobe * o[:, 2], color="tab:red", linewidth=0.9)
            axes.set_title(f"θᵢ {incidence:g}°, α {facets.alpha:g} p {facets.p:g} σ {facets.sigma_s:g}", fontsize=8)
            axes.set_yscale("log")
    return figure


EXPONENTS = [0.2, 0.4, 0.6, 0.8, 1, 1.4, 2, 3, 4, 5]
WIDEST = [0.015, 0.261, 0.448, 0.461, 0.348, 0.153, 0.104, 0.085, 0.068, 0.058]
"""Largest width of facets for an exponent that the authors have tables of."""
LOOKED_UP = {"S * D": (3e-3, 1e-2), "R": (3e-3, 1e-2), "1 + Λ": (3e-3, 1e-2)}
"""Relative errors, 99th percentile and worst."""


def any_material(rng: np.random.Generator) -> Facets:
    """Within the range of the authors' tables."""
    p = np.exp(rng.uniform(*np.log([0.2, 5])))
    alpha = max(np.interp(p, EXPONENTS, WIDEST) * rng.uniform(0.05, 1), 1e-3)
    b = np.exp(rng.uniform(*np.log([0.05, 20])))
    numbers = np.array([alpha, p, 0.03, b, rng.uniform(1.02, 3.02)], dtype=np.float32)
    return Facets(*map(float, numbers))


def tables(effort: Effort) -> Section:
    """Eq. 19, 32 and 36 to 38: what is looked up, against quadrature."""
    rng, count = np.random.default_rng(effort.seed), 24
    materials = 10 * int(np.sqrt(effort.paths / 1e5))
    errors: dict[str, list[float]] = {name: [] for name in LOOKED_UP}
    for _ in range(materials):
        effort.tick()
        facets = any_material(rng)
        known = evaluate.load(description(facets, wavelengths=[GREEN] * 3)).model.known.result
        theta = tilts(rng, count, facets.alpha)
        h = np.stack([np.sin(theta), np.zeros(count), np.cos(theta)], axis=1)
        cos_d = rng.uniform(0.01, 1, count)
        bands, c = known.bands, mi.Float(facets.c)
        wavelength = bands.at(evaluate.interaction(mi.Vector3f(0, 0, 1), 1, [1e3 * GREEN] * 4))
        u = mi.UnpolarizedSpectrum(facets.b * mi.Float(cos_d) / wavelength)
        V = evaluate.to_numpy(known.convolved.at(c, u, evaluate.vectors(h)), count)[0]
        R = evaluate.to_numpy(known.R.at(wavelength, mi.Float(cos_d)), count)[0]
        w = np.column_stack([h[:, :2], np.maximum(h[:, 2], 1e-3)])
        epd = EPD(mi.Float(facets.alpha), mi.Float(facets.alpha), known.power)
        found = evaluate.to_numpy(epd.smith_lambda(evaluate.vectors(w)), count)[0]
        for n in range(count):
            frequency = facets.b * cos_d[n] / GREEN
            errors["S * D"].append(V[n] / facets.convolution(h[n], frequency) - 1)
            errors["R"].append(R[n] / facets.propagating(np.sqrt(1 - cos_d[n] ** 2), GREEN) - 1)
            errors["1 + Λ"].append((1 + found[n]) / (1 + facets.smith_lambda(w[n])) - 1)
    findings = []
    for name, values in errors.items():
        p99, worst = np.quantile(np.abs(values), 0.99), np.abs(values).max()
        low, high = LOOKED_UP[name]
        measured, bound = f"99 %: {p99:.2%}, worst: {worst:.2%}", f"{low:.1%}, {high:.0%}"
        findings.append(Finding(name, measured, bound, bool(p99 < low and worst < high)))
    return Section(
        "What is looked up (Eq. 19, 32, 36 to 38)",
        f"{materials} materials within the range of the authors' tables, {count} tilts each, from the normal to the "
        "horizon: against quadrature in double precision that shares nothing with the model's.",
        findings,
    )


def tilts(rng: np.random.Generator, n: int, alpha: float) -> np.ndarray:
    """Angles of half vectors: evenly, a quarter among most facets, a quarter next to the horizon, and both ends."""
    theta = rng.uniform(0, np.pi / 2, n)
    theta[: n // 4] = 4 * alpha * rng.random(n // 4)
    theta[n // 4 : n // 2] = np.pi / 2 - 0.2 * rng.random(n // 2 - n // 4) ** 2
    theta[-2:] = 0, np.pi / 2
    return np.clip(theta, 0, np.pi / 2)


RATIOS = 0.02, 0.05, 0.1, 0.15, 0.25
"""Of sigma to the wavelength."""
SMOOTH = 2e-3
"""Roughness of facets that counts as none."""
SAMPLED = 1e-3
"""Error of an albedo: tables leave .15 % of what is diffracted, and 2^14 points of Sobol's sequence less."""
CONSERVED = 1.005
INCIDENCE = 0.0, 30.0, 57.3, 75.0, 83.0


def energy(effort: Effort) -> Section:
    """What mirrors return, as published and with energy conserved."""
    rows, findings, wi, most = [], [], directions([(theta, 0.0) for theta in INCIDENCE]), 0.0
    figure, axes = figures.axes("θᵢ [°]", "albedo", "smooth mirrors, b 1.2 µm, c 2.3; dashed: published")
    axes.axhline(1, color="black", linewidth=0.5)
    for n, ratio in enumerate(RATIOS):
        for alpha, p in ((SMOOTH, 1.0), (0.1, 0.7)):
            effort.tick()
            facets = Facets(alpha, p, ratio * GREEN, B, C)
            published, conserving = (albedo(facets, kind, wi) for kind in ("published", "conserving"))
            most = max(most, conserving.max())
            rows.append((ratio, alpha, p, *(" ".join(f"{x:.3f}" for x in found) for found in (published, conserving))))
            if alpha == SMOOTH:
                truth = np.array([sum(facets.smooth_albedo(np.hypot(w[0], w[1]), GREEN)) for w in wi])
                off = np.abs(published - truth).max()
                bound = f"{SAMPLED:g}"
                claim = f"σ/λ {ratio:g}, smooth: as by quadrature"
                findings.append(Finding(claim, f"within {off:.2g}", bound, bool(off <= SAMPLED)))
                axes.plot(INCIDENCE, published, "--", color=f"C{n}")
                axes.plot(INCIDENCE, conserving, color=f"C{n}", label=f"σ/λ {ratio:g}")
    axes.legend(fontsize=7)
    findings.append(Finding("`energy: conserving`", f"at most {most:.4f}", f"{CONSERVED:g}", bool(most <= CONSERVED)))
    return Section(
        "Energy",
        "Albedo of mirrors at " + ", ".join(f"{theta:g}°" for theta in INCIDENCE) + ", where 1 would be all light; "
        "rough facets lose some, as they reflect but once. Harvey and Shack's theory does not conserve energy, and is "
        "integrated as it is by quadrature; `energy: conserving` mirrors what is not diffracted.",
        findings,
        [Table(("σ/λ", "α", "p", "published", "conserving"), rows)],
        {"energy": figure},
    )


def albedo(facets: Facets, kind: str, wi: np.ndarray) -> np.ndarray:
    """Of mirrors, by the kind of energy."""
    bsdf = evaluate.load(description(facets, energy=kind, wavelengths=[GREEN] * 3))
    return evaluate.albedo(bsdf, wi, 2**14, [1e3 * GREEN] * len(mi.UnpolarizedSpectrum()))[0]


LINES = 0.45, 0.55, 0.65
"""Micrometres."""
SAMPLES, ENDS = 30, (380.0, 720.0)
"""Wavelengths in the middle of bins between these, in nm."""
METALS = {
    "mirror": {"type": "twoscale", "material": "none", "alpha": 0.05},
    **{name: presets.load(name).material for name in ("nickel", "aluminium", "hematite")},
    "copper": {"type": "twoscale", "material": "Cu", "alpha": 0.05},
}
HAZY = {"sigma_s": 0.04}
"""Of all of them, so that much is diffracted."""
LIGHT = np.array([0, 0.6, 0.8])
SIZE, FINER, BANDS = 48, 4, 6
"""Of a picture: pixels along a side, points along the side of a pixel, and bands of rows."""
LUMINANCE = np.array([0.212671, 0.71516, 0.072169])
PICTURE = 5e-3
"""Relative error of bands of a picture: thirty bins are good to .1 % of the lobe, but an index has steps."""


@contextmanager
def colours(kind: str) -> Iterator[None]:
    """The active variant's relative with colours of this kind."""
    before = evaluate.active_variant()
    backend = before.split("_")[0]
    try:
        mi.set_variant(f"scalar_{kind}" if backend == "scalar" else f"{backend}_ad_{kind}")
        yield
    finally:
        mi.set_variant(before)


def wavelengths(effort: Effort) -> Section:
    """Slides, last pages: colours of the lobe; RGB, thirty wavelengths, and a spectral render."""
    figure, rows = lobes_by_wavelength()
    findings, errors, pictures = [], [], {}
    for name, metal in METALS.items():
        effort.tick()
        rgb, many = in_rgb(metal | HAZY), by_wavelength(metal | HAZY)
        luminance = many @ LUMINANCE
        lit = luminance > 1e-3 * luminance.max()
        off = np.linalg.norm(rgb - many, axis=-1)[lit] / np.sqrt(3) / luminance[lit]
        errors.append((name, *(f"{np.quantile(off, share):.1%}" for share in (0.5, 0.9, 1))))
        pictures[name] = rgb, many
    for name in ("copper", "hematite"):
        truth = estimate(np.stack([bands(picture) for picture in traced(METALS[name] | HAZY, effort)]))
        claim = f"{name}: the spectral picture of the path tracer is that of {SAMPLES} wavelengths"
        findings.append(agreement(claim, truth, bands(pictures[name][1]), effort.tiles, PICTURE))
    return Section(
        "Wavelengths",
        "A mirror of α 0.05, p 0.7, σ 0.03 µm, lit from 30°, and its haze where it is next to the mirror direction and "
        "farther off, f cos θo. Then spheres with σ 0.04 µm in white light (D65) from one direction: in RGB; by "
        f"{SAMPLES} wavelengths of {ENDS[0]:g} to {ENDS[1]:g} nm, each with its own index; and five times the "
        "difference. Errors are root mean squares of the three colours, by the luminance. The mirror's are those of "
        "the three wavelengths; a metal's are those of its index too, of which RGB has three values.",
        findings,
        [
            Table(("wavelength", "A at 0°", "haze, 5° off", "15°", "30°", "60°"), rows),
            Table(("RGB against 30 wavelengths", "median", "90 %", "largest"), errors),
        ],
        {"wavelengths": figure, "spheres": spheres(pictures)},
    )


def lobes_by_wavelength() -> tuple[Any, list[tuple[Any, ...]]]:
    """Figure and table of the lobe at three wavelengths."""
    facets = Facets(0.05, 0.7, 0.03, B, C)
    figure, axes = figures.axes(
        "θₒ [°], negative towards the light", "f cos θₒ [1/sr]", "α 0.05, p 0.7, σ 0.03 µm, F 1"
    )
    theta, rows = np.linspace(-88, 88, 353), []
    o = directions([(abs(t), 180.0 * (t > 0)) for t in theta])
    i = np.broadcast_to(directions([(30.0, 0.0)])[0], o.shape)
    up = np.array([[0.0, 0.0, 1.0]])
    for line, colour in zip(LINES, ("tab:blue", "tab:green", "tab:red")):
        whole, haze = (reflected(description(facets), i, o, part, line) * o[:, 2] for part in (BOTH, DIFFRACTED))
        axes.plot(theta, whole, color=colour, label=f"{1e3 * line:g} nm")
        axes.plot(theta, haze, ":", color=colour)
        kept, every = (reflected(description(facets, sigma_s=s), up, up, MIRRORED, line)[0] for s in (0.03, 0.0))
        rows.append(
            (f"{1e3 * line:g} nm", f"{kept / every:.3f}", *map(float, np.interp([35, 45, 60, -30], theta, haze)))
        )
    axes.set_yscale("log")
    axes.legend(title="dotted: diffracted", fontsize=8)
    return figure, rows


def sphere() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points of a picture that are lit, directions to the eye and to the light there, in frames of the normal)."""
    at = (np.arange(SIZE * FINER) + 0.5) / (SIZE * FINER) * 2 - 1
    x, y = np.meshgrid(at, -at)
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    lit = (z > 1e-3) & (y * LIGHT[1] + z * LIGHT[2] > 1e-3)
    n = np.stack([x[lit], y[lit], z[lit]], axis=1)
    s = np.cross(n, [1.0, 0.3, 0.1])
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    frame = np.stack([s, np.cross(n, s), n], axis=1)
    return lit, frame @ [0.0, 0.0, 1.0], frame @ LIGHT


def pixels(lit: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means over the points of each pixel, (size, size, channels), of values at the lit ones (channels, points)."""
    points = np.zeros((*lit.shape, len(values)))
    points[lit] = values.T
    return points.reshape(SIZE, FINER, SIZE, FINER, -1).mean(axis=(1, 3))


def in_rgb(metal: dict[str, Any]) -> np.ndarray:
    """A sphere by its three colours."""
    lit, eye, light = sphere()
    with colours("rgb"):
        return pixels(lit, evaluate.at_pairs(evaluate.load(metal), eye, light)[:3])


def by_wavelength(metal: dict[str, Any]) -> np.ndarray:
    """A sphere in linear sRGB, by `SAMPLES` wavelengths, white where all light is reflected."""
    lit, eye, light = sphere()
    nm = ENDS[0] + (np.arange(SAMPLES) + 0.5) / SAMPLES * (ENDS[1] - ENDS[0])
    with colours("spectral"):
        bsdf, four = evaluate.load(metal), np.resize(nm, (-(-SAMPLES // 4), 4))
        values = np.concatenate([evaluate.at_pairs(bsdf, eye, light, some)[:4] for some in four])[:SAMPLES]
        weights = np.array(mi.cie1931_xyz(mi.Float(nm))) * np.array(mi.cie_d65(mi.Float(nm)))
        rgb = np.array(mi.xyz_to_srgb(mi.Color3f(*(mi.Float(row) for row in weights))), dtype=float)
    return pixels(lit, (rgb / rgb.sum(axis=1, keepdims=True)) @ values)


def traced(metal: dict[str, Any], effort: Effort) -> Iterator[np.ndarray]:
    """The same by Mitsuba's path tracer in a spectral variant, again and again."""
    look_at = mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    with colours("spectral"):
        scene = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "light": {"type": "directional", "direction": list(-LIGHT), "irradiance": {"type": "d65"}},
            "sensor": {
                "type": "orthographic",
                "to_world": look_at,
                "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}},
            },
            "sphere": {"type": "sphere", "bsdf": metal},
        }
        loaded = mi.load_dict(scene, parallel=False)
        for seed in range(effort.tiles):
            effort.tick()
            yield np.array(mi.render(loaded, spp=64, seed=effort.seed + seed), dtype=float)


def bands(picture: np.ndarray) -> np.ndarray:
    """Means over bands of rows, of each colour."""
    return picture.reshape(BANDS, -1, 3).mean(axis=1)


def spheres(pictures: dict[str, tuple[np.ndarray, np.ndarray]]) -> Any:
    """Spheres in RGB, by wavelength, and the difference."""
    figure, grid = figures.panels(3, len(pictures), "", "", f"RGB, {SAMPLES} wavelengths, five times the difference")
    for column, (name, (rgb, many)) in zip(grid.T, pictures.items()):
        exposure = 1 / np.quantile(many, 0.97)
        column[0].set_title(name, fontsize=9)
        for axes, values in zip(column, (rgb * exposure, many * exposure, 0.2 + 5 * (rgb - many) * exposure)):
            axes.imshow(np.clip(values, 0, 1) ** (1 / 2.2))
            axes.set_axis_off()
    return figure


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "heights": heights,
    "facets": facet_by_facet,
    "tables": tables,
    "energy": energy,
    "wavelengths": wavelengths,
}
"""The report, section by section, in its order."""
