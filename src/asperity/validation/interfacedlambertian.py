"""Interfaced Lambertian microfacets against light traced in explicit cavities (Meneveaux et al. 2018)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import numpy as np

from ..goniophotometer import Estimate, Hemisphere, Measurement, measure
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..microfacet.distributions import Distribution
from ..models.interfacedlambertian.body import body_albedo, body_integral, interface
from ..models.interfacedlambertian.facets import DISTRIBUTIONS, CavityFacets
from ..models.interfacedlambertian.interreflection import EvenTransmittance, More, mirrored_twice, two_bounces
from ..models.interfacedlambertian.microgeometry import ExplicitCavities
from . import figures
from .report import Effort, Section, Table, agreement, told_apart

RULE = 16, 64
"""Rings and azimuths of the sums over normals, whose error counts as `QUADRATURE`."""
QUADRATURE = 0.01
"""Relative error of that rule: 99 % of all values of single scattering (notes of the model), and of two bounces."""
POLE = 6.0
"""Degrees about the mirror direction: cells that reach there are not judged. f has a pole that few directions miss."""
COVER = 8
"""Directions that cover a cell, squared, when the model is averaged over it."""
SENSOR = Hemisphere(8, 16)
ANGLES = (20.0, 0.0), (50.0, 0.0), (75.0, 0.0)
ALBEDOS = 0.2, 0.6, 1.0
"""Of the body, in the three channels: they tell powers of Q apart."""
ROUGHNESSES = 0.1, 0.3, 0.6, 1.0
ENOUGH = 2e6
"""Paths per direction, at least, where bounces are counted apart."""
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


def sections(effort: Effort) -> Iterator[Section]:
    """The report, section by section, as it is measured."""
    yield reflectance(effort)
    yield by_bounce(effort)
    yield distributions(effort)


def shoot(cavities: ExplicitCavities, angles: Any, effort: Effort, **options: Any) -> Measurement:
    """Measure cavities."""
    return measure(
        cavities, angles, paths=effort.paths, tiles=effort.tiles, seed=effort.seed, progress=effort.tick, **options
    )


def reflectance(effort: Effort) -> Section:
    """Fig. 7: hemispherical reflectance of white bodies, after one bounce, two and all."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    cos, weight = (nodes + 1) / 2, (nodes + 1) / 2 * weights
    rows, means, errors, furnace = [], [], [], []
    for alpha in FIG_7:
        incident = [(float(np.degrees(np.arccos(c))), 0.0) for c in cos]
        cavities = ExplicitCavities("beckmann", alpha, alpha, 1.0, 1.5)
        measured = shoot(cavities, incident, effort._replace(paths=effort.paths / 4), apart=3, sensor=Hemisphere(1, 1))
        value, error = measured.albedo
        means.append(np.cumsum(weight @ value[..., 0]))
        errors.append(np.sqrt(np.cumsum(np.square(weight) @ np.square(error[..., 0]))))
        furnace.append(measured.total_albedo)
        rows.append((alpha, *(f"{x:.4f}" for x in means[-1]), *FIG_7[alpha]))
    mean, error = np.array(means), np.hypot(np.array(errors), TRACER)
    truth = Estimate(mean[:, :2], error[:, :2])
    white = Estimate(np.stack([t.value[:, 0] for t in furnace]), np.stack([t.error[:, 0] for t in furnace]))
    figure, axes = figures.axes("σ", "reflectance", "Beckmann, index 1.5, white body (Fig. 7)")
    for k, name in enumerate(("one bounce", "two", "all")):
        axes.plot(list(FIG_7), mean[:, k], marker="o", label=name)
    axes.legend()
    return Section(
        "Reflectance of rough surfaces (Fig. 7)",
        "Beckmann, index 1.5, a body that absorbs nothing, lit from all over the hemisphere; beside them, the same "
        "by an independent tracer.",
        [
            agreement("one bounce and two", truth, np.array(list(FIG_7.values())), effort.tiles, 0),
            agreement("all bounces return all light", white, np.ones(white.value.shape), effort.tiles, 1e-5),
        ],
        [Table(("σ", "one", "two", "all", "one, other tracer", "two, other tracer"), rows)],
        {"fig7": figure},
    )


def orders(distribution: Distribution, n: float, measured: Measurement, many: More) -> np.ndarray:
    """The model's means over cells, of one bounce, two and more: (directions, orders, cells, channels)."""
    index, tau, sensor = mi.Float(n), EvenTransmittance.made(mi.Float(n)), measured.sensor
    facets, found = CavityFacets(), []
    q = np.array([float(body_albedo(albedo, n)) for albedo in ALBEDOS])
    for wi in measured.wi:
        wo = sensor.directions(wi, COVER)
        i, o = evaluate.vectors(np.broadcast_to(wi, (wo.size // 3, 3))), evaluate.vectors(wo.reshape(-1, 3))
        body = body_integral(distribution, facets, index, i, o, *RULE) * (o.z / np.pi)
        once, twice = two_bounces(distribution, index, tau, i, o, *RULE)
        parts = (body, interface(distribution, facets, index, i, o), once * o.z, twice * o.z)
        body, mirror, once, twice = (np.array(part)[:, None] for part in parts)
        mirrors = np.array(mirrored_twice(distribution, index, i, o)[0])[:, None]
        more = np.stack(
            [np.array(many(i, o, mi.Float(float(one))) * o.z) for one in q / float(body_albedo(1, n))], axis=1
        )
        values = np.stack([mirror + body * q, mirrors + once * q + twice * q**2, more])
        found.append(values.reshape(3, *wo.shape[:2], 3).mean(axis=2))
    return np.array(found)


def remainder(distribution: Distribution, n: float) -> More:
    """What bounces more than twice, of isotropic facets."""
    index = mi.Float(n)
    tau, white = EvenTransmittance.made(index), body_albedo(mi.Float(1), index)

    def body(wi: Any, wo: Any) -> Any:
        once, twice = two_bounces(distribution, index, tau, wi, wo)
        single = body_integral(distribution, CavityFacets(), index, wi, wo, *RULE) / np.pi
        return white * (single + once + white * twice)

    return More.made(distribution, index, body, mi.Vector3f, True)


def off_pole(measured: Measurement) -> np.ndarray:
    """Cells (directions, cells) that do not reach within `POLE` of the mirror direction."""
    mirror = directions([(theta, phi + 180) for theta, phi in measured.incident])
    cover = (measured.sensor.directions(wi, COVER) for wi in measured.wi)
    return np.stack([np.all(wo @ m < np.cos(np.radians(POLE)), axis=1) for wo, m in zip(cover, mirror)])


def roughplastic(alpha: float, n: float, measured: Measurement) -> np.ndarray:
    """Mitsuba's model of the same, over cells: (directions, cells, channels)."""
    bsdf = evaluate.load(
        {
            "type": "roughplastic",
            "alpha": alpha,
            "int_ior": n,
            "ext_ior": 1.0,
            "nonlinear": True,
            "diffuse_reflectance": {"type": "rgb", "value": list(ALBEDOS)},
        }
    )
    found = []
    for wi in measured.wi:
        wo = measured.sensor.directions(wi, COVER)
        si = evaluate.interaction(evaluate.vectors(np.broadcast_to(wi, (wo.size // 3, 3))))
        values = np.array(bsdf.eval(mi.BSDFContext(), si, evaluate.vectors(wo.reshape(-1, 3)))).T
        found.append(values.reshape(*wo.shape[:2], 3).mean(axis=1))
    return np.array(found)


def by_bounce(effort: Effort) -> Section:
    """Fig. 9: one bounce, two and all, by roughness; `roughplastic`, which knows of none but one, is refused."""
    findings, rows, pictures = [], [], {}
    for alpha in ROUGHNESSES:
        distribution = DISTRIBUTIONS["beckmann"](mi.Float(alpha), mi.Float(alpha))
        cavities = ExplicitCavities("beckmann", alpha, alpha, ALBEDOS, 1.5)
        measured = shoot(cavities, ANGLES, effort.at_least(ENOUGH), apart=3, sensor=SENSOR)
        model, away = orders(distribution, 1.5, measured, remainder(distribution, 1.5)), off_pole(measured)
        for k, name in enumerate(("one bounce", "two bounces")):
            truth = Estimate(*(part[:, k][away] for part in measured.values))
            findings.append(agreement(f"α {alpha:g}, {name}", truth, model[:, k][away], effort.tiles, QUADRATURE))
            sums = Estimate(*together(measured, k, away))
            found = (model[:, k] * away[..., None]).sum(axis=1)
            findings.append(agreement(f"α {alpha:g}, {name}, cells together", sums, found, effort.tiles, QUADRATURE))
        rival = roughplastic(alpha, 1.5, measured)
        for name, values, traced in (
            ("double", model[:, :2].sum(axis=1), Estimate(*_first(measured, 2))),
            ("multiple", model.sum(axis=1), measured.summed),
            ("roughplastic", rival, measured.summed),
        ):
            error = (values[away] - traced.value[away]) / traced.value[away]
            known = traced.error[away] < 0.01 * traced.value[away]
            rms = np.sqrt(np.mean(np.square(error), axis=0, where=known))
            rows.append((name, alpha, *(f"{x:.2%}" for x in rms)))
        truth = Estimate(*(part[away] for part in measured.summed))
        ours, other = (
            agreement(f"α {alpha:g}, {name}", truth, values[away], effort.tiles, 3 * QUADRATURE)
            for name, values in (("all bounces", model.sum(axis=1)), ("roughplastic", rival))
        )
        findings.append(told_apart(f"α {alpha:g}: roughplastic is refused", ours, other))
        if alpha == ROUGHNESSES[-1]:
            pictures["fig9"] = plane(f"Beckmann, σ {alpha:g}, K_d 1 (Fig. 9)", measured, model)
    return Section(
        "One bounce, two, and all (Fig. 9)",
        f"Beckmann, index 1.5, K_d {', '.join(map(str, ALBEDOS))}; all cells but those that reach within {POLE:g}° of "
        "the mirror direction. The table has errors, root mean squares over cells known to 1 %, of each K_d.",
        findings,
        [Table(("model", "α", *(f"K_d {albedo:g}" for albedo in ALBEDOS)), rows)],
        pictures,
    )


def together(measured: Measurement, order: int, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and error of the sum over these cells, whose errors are all but independent: (directions, channels)."""
    value, error = (part[:, order] * cells[..., None] for part in measured.values)
    return value.sum(axis=1), np.sqrt(np.square(error).sum(axis=1))


def _first(measured: Measurement, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Value and error of the first orders together; errors of orders add up at most."""
    value, error = (part[:, :count] for part in measured.values)
    return value.sum(axis=1), np.sqrt(np.square(error).sum(axis=1))


def plane(title: str, measured: Measurement, model: np.ndarray) -> Any:
    """The plane of incidence: bars are traced, lines are the model's."""
    sensor = measured.sensor
    assert isinstance(sensor, Hemisphere)
    names = "one bounce", "two", "more"
    figure, grid = figures.panels(len(ANGLES), 3, "θₒ [°], negative towards the light", "f cos θₒ [1/sr]", title)
    rows = np.arange(sensor.rows)
    cells = np.concatenate([rows[::-1] * sensor.columns, rows * sensor.columns + sensor.columns // 2])
    edges = np.degrees(np.arccos(1 - np.arange(sensor.rows + 1) / sensor.rows))
    edges = np.concatenate([-edges[::-1], edges[1:]])
    for row, (theta, _) in enumerate(ANGLES):
        for k, name in enumerate(names):
            axes = grid[row, k]
            axes.stairs(measured.values.value[row, k, cells, -1], edges, fill=True, color="tab:green", alpha=0.5)
            axes.stairs(model[row, k, cells, -1], edges, baseline=None, color="tab:red", linewidth=0.9)
            axes.set_title(f"θᵢ {theta:g}°, {name}", fontsize=8)
    return figure


def distributions(effort: Effort) -> Section:
    """Fig. 10: distributions of normals, index and roughness, at 60°, one bounce."""
    findings = []
    for name, kind in DISTRIBUTIONS.items():
        for n in (1.0, 1.3, 1.5):
            for alpha in (0.2, 0.6):
                distribution = kind(mi.Float(alpha), mi.Float(alpha))
                cavities = ExplicitCavities(name, alpha, alpha, ALBEDOS, n)
                measured = shoot(cavities, [(60.0, 0.0)], effort.at_least(ENOUGH), orders=1, sensor=SENSOR)
                index, wi = mi.Float(n), measured.wi[0]
                wo = SENSOR.directions(wi, COVER)
                i, o = evaluate.vectors(np.broadcast_to(wi, (wo.size // 3, 3))), evaluate.vectors(wo.reshape(-1, 3))
                body = np.array(body_integral(distribution, CavityFacets(), index, i, o, *RULE) * (o.z / np.pi))
                mirror = np.array(interface(distribution, CavityFacets(), index, i, o))
                q = np.array([float(body_albedo(albedo, n)) for albedo in ALBEDOS])
                model = (mirror[:, None] + body[:, None] * q).reshape(*wo.shape[:2], 3).mean(axis=1)
                truth = Estimate(*(part[0] for part in measured.summed))
                findings.append(agreement(f"{name}, index {n:g}, α {alpha:g}", truth, model, effort.tiles, QUADRATURE))
    return Section("Distributions (Fig. 10)", "One bounce, incidence 60°, all cells of the hemisphere.", findings)
