"""Interfaced Lambertian microfacets against light traced in explicit cavities (Meneveaux et al. 2018)."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from ..goniophotometer import Estimate, Hemisphere, Measurement, Points, measure
from ..goniophotometer.grooves import Grooves
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..microfacet.distributions import Gaussian
from ..models.interfacedlambertian import InterfacedLambertian
from ..models.interfacedlambertian.body import body_albedo, body_integral
from ..models.interfacedlambertian.facets import DISTRIBUTIONS, SmithFacets
from ..models.interfacedlambertian.microgeometry import ExplicitCavities, InterfacedFacet
from . import figures
from .report import Effort, Finding, Section, Table, agreement

TABLES = 0.01
"""Relative error of the model's tables and sums, cell by cell: tests/models/interfacedlambertian have percentiles."""
POLE = 6.0
"""Degrees about the mirror direction: cells that reach there are not judged. f has a pole that few directions miss."""
COVER = 8
"""Directions that cover a cell, squared, when the model is averaged over it."""
SENSOR = Hemisphere(8, 16)
ANGLES = (20.0, 0.0), (50.0, 0.0), (75.0, 0.0)
TURNED = (20.0, 40.0), (50.0, 250.0), (75.0, 10.0)
"""For anisotropic facets."""
ALBEDOS = 0.2, 0.6, 1.0
"""Of the body, in the three channels."""
ENOUGH = 4e6
"""Paths per direction, at least, where bounces are counted apart: half of them have errors of up to 1 % by noise."""
FIG_7 = {
    0.05: (0.9982, 0.9995),
    0.1: (0.9947, 0.9991),
    0.2: (0.9806, 0.9991),
    0.3: (0.9587, 0.9972),
    0.5: (0.9028, 0.9855),
    0.7: (0.8418, 0.9649),
    1.0: (0.7576, 0.9211),
    1.5: (0.6458, 0.8404),
}
"""By the roughness: reflectances after one bounce and after two, as an independent tracer has them, to 3e-4."""
TRACER = 3e-4
SCATTERING = "single", "double", "multiple"
DOUBLE, MULTIPLE = 0.01, 0.015
"""Root mean square errors over cells."""
THETA_PHI = 60.0, 0.0
OUTGOING = np.arange(-85.0, 90.0, 5.0)
"""Degrees in the plane of incidence, negative towards the light."""
INDICES, ROUGHNESSES = (1.0, 1.3, 1.5), (0.2, 0.6)
COARSE, FACING = 0.02, 0.1
"""Error of ``approximate`` at the 95th percentile, where the cosine exceeds the latter: .6 to 1.3 % were found."""
MANY = 64, 128
"""Rings and azimuths of a sum over normals whose error is far less than that of the model."""


class Surface(NamedTuple):
    """Facets whose bounces are counted, and the error that is allowed of all together; None where there is no claim."""

    distribution: str
    alpha: float | tuple[float, float]
    multiple: float | None = MULTIPLE


SURFACES = (
    *(Surface("beckmann", alpha) for alpha in (0.1, 0.3, 0.6, 1.0)),
    *(Surface("ggx", alpha) for alpha in (0.3, 0.6)),
    Surface("ggx", 1.0, multiple=None),
    *(Surface("gaussian", alpha) for alpha in (0.3, 0.6)),
    Surface("gaussian", 1.0, multiple=None),
    Surface("beckmann", (0.2, 0.8)),
)


def paint(distribution: str, alpha: Any, n: float = 1.5, albedo: tuple[float, ...] = ALBEDOS) -> dict[str, Any]:
    """A scene's description of the model, in V-cavities."""
    alphas = {"alpha_u": alpha[0], "alpha_v": alpha[1]} if isinstance(alpha, tuple) else {"alpha": alpha}
    return {
        "type": "interfacedlambertian",
        "diffuse_reflectance": {"type": "rgb", "value": list(albedo)},
        "int_ior": n,
        "ext_ior": 1.0,
        "distribution": distribution,
        "masking": "vcavity",
        **alphas,
    }


def rival(surface: Surface) -> dict[str, Any] | None:
    """Mitsuba's model of the same, which knows of no bounce but one; None if it has no such facets."""
    if surface.distribution == "gaussian" or isinstance(surface.alpha, tuple):
        return None
    given = paint(surface.distribution, surface.alpha) | {"type": "roughplastic", "nonlinear": True}
    return {name: value for name, value in given.items() if name != "masking"}


def shoot(cavities: ExplicitCavities, angles: Any, effort: Effort, **options: Any) -> Measurement:
    """Measure cavities."""
    return measure(
        cavities, angles, paths=effort.paths, tiles=effort.tiles, seed=effort.seed, progress=effort.tick, **options
    )


# --- Fig. 7 ----------------------------------------------------------------------------------------------------------


def reflectance(effort: Effort) -> Section:
    """Fig. 7: hemispherical reflectance of white bodies, after one bounce, two and all."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    cos, weight = (nodes + 1) / 2, (nodes + 1) / 2 * weights
    incident = [(float(np.degrees(np.arccos(c))), 0.0) for c in cos]
    rows, means, errors, models, furnace = [], [], [], [], []
    for alpha, published in FIG_7.items():
        white = paint("beckmann", alpha, albedo=(1.0, 1.0, 1.0))
        few = effort._replace(paths=effort.paths / 4)
        measured = shoot(InterfacedLambertian.microgeometry(white), incident, few, apart=3, sensor=Hemisphere(1, 1))
        value, error = measured.albedo
        means.append(np.cumsum(weight @ value[..., 0]))
        errors.append(np.sqrt(np.cumsum(np.square(weight) @ np.square(error[..., 0]))))
        bsdfs = [evaluate.load(white | {"scattering": scattering}) for scattering in SCATTERING]
        models.append([weight @ evaluate.albedo(bsdf, measured.wi, 2**14)[0] for bsdf in bsdfs])
        furnace.append(measured.total_albedo)
        rows.append((alpha, *(f"{x:.4f}" for pair in zip(means[-1], models[-1]) for x in pair), *published))
    mean, error, model = np.array(means), np.array(errors), np.array(models)
    total = Estimate(*(np.stack([part[:, 0] for part in parts]) for parts in zip(*furnace)))
    truth, other = (Estimate(mean[:, :2], np.hypot(error[:, :2], more)) for more in (0, TRACER))
    tiles = effort.tiles
    return Section(
        "Reflectance of rough surfaces (Fig. 7)",
        "Beckmann, index 1.5, a body that absorbs nothing, lit from all over the hemisphere: traced, by the model, and "
        "by an independent tracer.",
        [
            agreement(
                "traced, one bounce and two: the other tracer's", other, np.array(list(FIG_7.values())), tiles, 0
            ),
            agreement("traced, all bounces: all light", total, np.ones(total.value.shape), tiles, 1e-5),
            agreement("`single` and `double`", truth, model[:, :2], tiles, 2e-3),
            agreement("`multiple`", Estimate(mean[:, 2:], error[:, 2:]), model[:, 2:], tiles, 1e-3),
        ],
        [Table(("σ", "one", "`single`", "two", "`double`", "all", "`multiple`", "other, one", "other, two"), rows)],
        {"fig7": reflectances(mean, model)},
    )


def reflectances(traced: np.ndarray, model: np.ndarray) -> Any:
    """Dots are traced, lines are the model's."""
    figure, axes = figures.axes("σ", "reflectance", "Beckmann, index 1.5, white body (Fig. 7)")
    for k, name in enumerate(("one bounce", "two", "all")):
        (line,) = axes.plot(list(FIG_7), model[:, k], label=f"{name}: `{SCATTERING[k]}`")
        axes.plot(list(FIG_7), traced[:, k], "o", color=line.get_color())
    axes.legend()
    return figure


# --- Fig. 9 and 14 ---------------------------------------------------------------------------------------------------


def over_cells(description: dict[str, Any], measured: Measurement) -> np.ndarray:
    """A BSDF's means over cells: (directions, cells, channels)."""
    bsdf, cells = evaluate.load(description), (measured.sensor.directions(wi, COVER) for wi in measured.wi)
    return np.stack([evaluate.cell_means(bsdf, wi, wo).T for wi, wo in zip(measured.wi, cells)])


def off_pole(measured: Measurement) -> np.ndarray:
    """Cells (directions, cells) that do not reach within `POLE` of the mirror direction."""
    mirror = directions([(theta, phi + 180) for theta, phi in measured.incident])
    cover = (measured.sensor.directions(wi, COVER) for wi in measured.wi)
    return np.stack([np.all(wo @ m < np.cos(np.radians(POLE)), axis=1) for wo, m in zip(cover, mirror)])


def rms(truth: Estimate, model: np.ndarray) -> np.ndarray:
    """Root mean square of relative errors by channel, over cells known to 3 %, less what is noise of the truth's.

    By a standard error too large, or noise might leave nothing of a small one.
    """
    known = truth.error < 0.03 * truth.value
    value = np.where(known, truth.value, 1)
    squares = np.square(model / value - 1) - np.square(truth.error / value)
    mean, spread = (f(squares, axis=0, where=known) for f in (np.mean, np.std))
    return np.sqrt(np.maximum(mean, 0) + spread / np.sqrt(known.sum(axis=0)))


def first(measured: Measurement, count: int) -> Estimate:
    """The first orders together; a path is counted in one order, and so errors are all but independent."""
    value, error = (part[:, :count] for part in measured.values)
    return Estimate(value.sum(axis=1), np.sqrt(np.square(error).sum(axis=1)))


def together(measured: Measurement, order: int, cells: np.ndarray) -> Estimate:
    """The sum over these cells, whose errors are all but independent: (directions, channels)."""
    value, error = (part[:, order] * cells[..., None] for part in measured.values)
    return Estimate(value.sum(axis=1), np.sqrt(np.square(error).sum(axis=1)))


def by_bounce(effort: Effort) -> Section:
    """Fig. 9: one bounce, two and all; `roughplastic`, which knows of none but one, is refused."""
    findings, rows, pictures = [], [], {}
    for surface in SURFACES:
        description, name = paint(surface.distribution, surface.alpha), f"{surface.distribution}, α {surface.alpha}"
        angles = TURNED if isinstance(surface.alpha, tuple) else ANGLES
        measured = shoot(
            InterfacedLambertian.microgeometry(description), angles, effort.at_least(ENOUGH), apart=3, sensor=SENSOR
        )
        away = off_pole(measured)
        totals = np.stack([over_cells(description | {"scattering": s}, measured) for s in SCATTERING], axis=1)
        model = np.diff(totals, axis=1, prepend=0)
        for k, bounces in enumerate(("one bounce", "two bounces")):
            truth = Estimate(*(part[:, k][away] for part in measured.values))
            claim = f"{name}: {bounces}"
            findings.append(agreement(claim, truth, model[:, k][away], effort.tiles, TABLES))
            sums, found = together(measured, k, away), (model[:, k] * away[..., None]).sum(axis=1)
            findings.append(agreement(f"{claim}, cells together", sums, found, effort.tiles, TABLES))
        two, every = (Estimate(*(part[away] for part in whole)) for whole in (first(measured, 2), measured.summed))
        double, multiple = rms(two, totals[:, 1][away]), rms(every, totals[:, 2][away])
        findings.append(bounded(f"{name}: `double`", double, DOUBLE))
        findings.append(bounded(f"{name}: `multiple`", multiple, surface.multiple))
        if mitsubas := rival(surface):
            plastic = rms(every, over_cells(mitsubas, measured)[away])
            refused = bool(np.all(plastic > np.maximum(2 * multiple, MULTIPLE)))
            limit = f"more than {MULTIPLE:.1%}, and twice ours"
            findings.append(Finding(f"{name}: `roughplastic` is refused", f"RMS {plastic.min():.2%}", limit, refused))
        last = f"{plastic[-1]:.1%}" if mitsubas else "-"
        rows.append((name, *(f"{x:.2%}" for x in (*double, *multiple)), last))
        if surface == Surface("beckmann", 1.0):
            pictures["fig9"] = plane(f"{name}, K_d 1 (Fig. 9)", measured, model)
    shades = [f"`{name}`, K_d {albedo:g}" for name in SCATTERING[1:] for albedo in ALBEDOS]
    return Section(
        "One bounce, two, and all (Fig. 9), also of anisotropic facets (Fig. 14)",
        f"Index 1.5, K_d {', '.join(map(str, ALBEDOS))}; all cells but those that reach within {POLE:g}° of the mirror "
        "direction. The table has errors: root mean squares over cells known to 3 %, less noise of the tracing, and a "
        "standard error more.",
        findings,
        [Table(("facets", *shades, "`roughplastic`, K_d 1"), rows)],
        pictures,
    )


def bounded(claim: str, error: np.ndarray, bound: float | None) -> Finding:
    """That root mean square errors are below a bound, in all channels."""
    if bound is None:
        return Finding(claim, f"RMS {error.max():.2%}")
    return Finding(claim, f"RMS {error.max():.2%}", f"{bound:.1%}", bool(error.max() < bound))


def plane(title: str, measured: Measurement, model: np.ndarray) -> Any:
    """The plane of incidence: bars are traced, lines are the model's."""
    sensor = measured.sensor
    assert isinstance(sensor, Hemisphere)
    figure, grid = figures.panels(len(ANGLES), 3, "θₒ [°], negative towards the light", "f cos θₒ [1/sr]", title)
    rows = np.arange(sensor.rows)
    cells = np.concatenate([rows[::-1] * sensor.columns, rows * sensor.columns + sensor.columns // 2])
    edges = np.degrees(np.arccos(1 - np.arange(sensor.rows + 1) / sensor.rows))
    edges = np.concatenate([-edges[::-1], edges[1:]])
    for row, (theta, _) in enumerate(ANGLES):
        for k, name in enumerate(("one bounce", "two", "more")):
            axes = grid[row, k]
            axes.stairs(measured.values.value[row, k, cells, -1], edges, fill=True, color="tab:green", alpha=0.5)
            axes.stairs(model[row, k, cells, -1], edges, baseline=None, color="tab:red", linewidth=0.9)
            axes.set_title(f"θᵢ {theta:g}°, {name}", fontsize=8)
    return figure


# --- Fig. 10 and 15 --------------------------------------------------------------------------------------------------


class UnmirroredFacet(InterfacedFacet):
    """A facet whose interface mirrors nothing, if light is followed to its first facet: it can be aimed at."""

    def flags(self) -> int:
        """A diffuse lobe alone."""
        return int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide)


class UnmirroredCavities(ExplicitCavities):
    """Cavities of such facets."""

    def piece(self, rng: np.random.Generator) -> Grooves:
        """Always the same."""
        return Grooves(self.draw, UnmirroredFacet(self.albedo, self.eta))


def curves(effort: Effort) -> Section:
    """Fig. 10 and 15: light from the bodies after one bounce, of all distributions and maskings, and a coarse sum."""
    cos = np.cos(np.radians(OUTGOING))[:, None]
    findings, coarse, smith, drawn = [], [], [], {}
    for kind, n, alpha in itertools.product(DISTRIBUTIONS, INDICES, ROUGHNESSES):
        truth, lines = curve(kind, n, alpha, effort)
        model, claim = lines["V-cavities"], f"{kind}, V-cavities, index {n:g}, σ {alpha:g}"
        findings.append(agreement(claim, truth, model, effort.tiles, TABLES))
        coarse.append(np.abs(lines["`approximate`"] / model - 1)[cos[:, 0] > FACING])
        smith += [np.abs(lines["Smith"] / lines["summed"] - 1)] if "Smith" in lines else []
        drawn[kind, n, alpha] = {
            name: (values / cos)[:, -1] for name, values in (lines | {"traced": truth.value}).items()
        }
    worst, rough = float(np.max(smith)), float(np.percentile(coarse, 95))
    summed = "Smith's masking, which no explicit surface has: a sum over many facets"
    percentile = f"`approximate`, V-cavities, cosines above {FACING:g}, 95th percentile"
    findings += [
        Finding(summed, f"{worst:.2%}", f"{TABLES:.0%}", worst < TABLES),
        Finding(percentile, f"{rough:.1%}", f"{COARSE:.0%}", rough < COARSE),
    ]
    return Section(
        "Distributions, and the coarse rule (Fig. 10 and 15)",
        f"Light from the bodies after one bounce, in the plane of incidence, {THETA_PHI[0]:g}° from the normal. Of "
        "K_d 1 in the pictures: blue for Beckmann, orange for GGX, green for Gaussian facets; dots are traced.",
        findings,
        figures={
            "fig10": diagrams("Body, V-cavities, and dashed Smith's masking (Fig. 10)", drawn, "Smith"),
            "fig15": diagrams("Body, V-cavities, and dashed `approximate` (Fig. 15)", drawn, "`approximate`"),
        },
    )


def curve(kind: str, n: float, alpha: float, effort: Effort) -> tuple[Estimate, dict[str, np.ndarray]]:
    """f cos_o along the plane of incidence, traced and by the models: (directions, channels)."""
    points = Points(tuple((abs(theta), 0.0 if theta < 0 else 180.0) for theta in OUTGOING))
    measured = shoot(UnmirroredCavities(kind, alpha, alpha, ALBEDOS, n), [THETA_PHI], effort, orders=1, sensor=points)
    description, wi, wo = paint(kind, alpha, n), measured.wi[0], measured.sensor.directions(measured.wi[0])[:, 0]
    kinds: dict[str, dict[str, Any]] = {"V-cavities": {}, "`approximate`": {"approximate": True}}
    if kind != "gaussian" or alpha <= Gaussian.largest_smith:
        kinds["Smith"] = {"masking": "smith"}
    lines = {name: body(description | options, wi, wo) for name, options in kinds.items()}
    if "Smith" in lines:
        lines["summed"] = summed(kind, alpha, n, wi, wo)
    return Estimate(*(part[0] for part in measured.summed)), lines


def body(description: dict[str, Any], wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f cos_o of the light from below the interface: (directions, channels)."""
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), 1)
    si = evaluate.interaction(evaluate.vectors(wi[None]), len(wo))
    return evaluate.to_numpy(evaluate.load(description).eval(context, si, evaluate.vectors(wo)), len(wo)).T


def summed(kind: str, alpha: float, n: float, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """The same with Smith's masking, by a sum over normals with many nodes."""
    i, o = evaluate.vectors(np.broadcast_to(wi, wo.shape)), evaluate.vectors(wo)
    normals = DISTRIBUTIONS[kind](mi.Float(alpha), mi.Float(alpha))
    value = np.array(body_integral(normals, SmithFacets(), mi.Float(n), i, o, *MANY) * (o.z / np.pi))
    return value[:, None] * [float(body_albedo(albedo, n)) for albedo in ALBEDOS]


def diagrams(title: str, drawn: dict[tuple, dict[str, np.ndarray]], dashed: str) -> Any:
    """A diagram for each index and roughness."""
    shape = len(INDICES), len(ROUGHNESSES)
    figure, grid = figures.panels(*shape, "θₒ [°], negative towards the light", "f [1/sr]", title)
    colours = dict(zip(DISTRIBUTIONS, ("tab:blue", "tab:orange", "tab:green")))
    places = dict(zip(itertools.product(INDICES, ROUGHNESSES), grid.flat))
    for (kind, n, alpha), lines in drawn.items():
        axes = places[n, alpha]
        axes.semilogy(OUTGOING, lines["V-cavities"], color=colours[kind], linewidth=0.9)
        axes.semilogy(OUTGOING, lines["traced"], ".", color=colours[kind], markersize=4)
        if dashed in lines:
            axes.semilogy(OUTGOING, lines[dashed], "--", color=colours[kind], linewidth=0.9)
        axes.set_title(f"index {n:g}, σ {alpha:g}", fontsize=8)
    return figure


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "reflectance": reflectance,
    "bounces": by_bounce,
    "curves": curves,
}
"""The report, section by section, in its order."""
