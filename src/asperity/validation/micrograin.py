"""The micrograin model against light traced through explicit grains (Lucas et al. 2024, Sec. 5 and 7)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..goniophotometer import Estimate, Hemisphere, Measurement, Window, measure
from ..goniophotometer.masking import measure_masking
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..microfacet.ggx import inclination, to_sphere
from ..models.micrograin import ExplicitGrains, Micrograin
from ..models.micrograin.grains import density, exposure
from ..models.micrograin.shadows import Shadows, shadow, silhouette
from . import figures
from .report import Effort, Finding, Section, Table, agreement, told_apart

INSTRUMENT = 1e-4
"""Relative error that is not noise: float32 in the model, and the clearance of rays in the instrument."""
QUADRATURE = 5e-3
"""Relative error of diffuse grains' fixed quadrature (`diffuse.HEIGHTS`)."""
METAL = {"eta": 1.0152, "k": 6.6273}
DIFFUSE = {"specular": False, "diffuse_reflectance": 0.5}
GRAINS = ((0.5, 1.0, 1.0), (0.2, 2.0, 2.0), (0.4, 0.5, 1.5))
"""(tau_0, beta_x, beta_y): the paper's text does not say those of Fig. 7 and 8."""
MODELS = {
    "micrograin": {"masking": "correlated"},
    "without direction (Eq. 17)": {"masking": "height"},
    "Lucas 2023": {"masking": "smith"},
    "d'Eon 2023": {"type": "deon"},
    "Mérillou 2000": {"type": "merillou"},
}
PUBLISHED = ("Lucas 2023", "d'Eon 2023", "Mérillou 2000")
COARSE = Hemisphere(8, 16)
ENOUGH = 3.2e6
"""Cells, and least number of paths, that tell models apart."""
COVER = 16
"""Directions that cover a cell, squared, when the model is averaged over it."""


def grains(parameters: tuple[float, float, float], **others: Any) -> dict[str, Any]:
    """A scene's description of the model."""
    return {"type": "micrograin"} | dict(zip(("tau_0", "beta_x", "beta_y"), parameters)) | others


def shoot(description: dict[str, Any], angles: Any, effort: Effort, **options: Any) -> Measurement:
    """Measure the explicit grains that the description stands for."""
    options = {"orders": 1} | options
    return measure(
        Micrograin.microgeometry(description),
        angles,
        paths=effort.paths,
        tiles=effort.tiles,
        seed=effort.seed,
        progress=effort.tick,
        **options,
    )


def modelled(description: dict[str, Any], measurement: Measurement, k: int = COVER) -> np.ndarray:
    """A BSDF's means over the cells of a measurement: (directions, cells, channels)."""
    bsdf, sensor = evaluate.load(description), measurement.sensor
    return np.stack([evaluate.cell_means(bsdf, wi, sensor.directions(wi, k)).T for wi in measurement.wi])


def judge(claim: str, measured: Measurement, model: np.ndarray, tolerance: float) -> Finding:
    """Whether a model (directions, cells) agrees in every cell, and in the directional albedo."""
    cells, albedo = measured.summed, measured.total_albedo
    truth = Estimate(*(np.concatenate([a[..., 0], b[:, :1]], axis=1) for a, b in zip(cells, albedo)))
    total = model.sum(axis=1, keepdims=True) * measured.sensor.solid_angle
    return agreement(claim, truth, np.concatenate([model, total], axis=1), len(measured.labels), tolerance)


# --- masking ---------------------------------------------------------------------------------------------------------


def ring_mean(angles: Any, tau_0: float, low: float, high: float, n: int = 64) -> np.ndarray:
    """Mean of G1dist (Lucas 2024, Eq. 16) over the exposed points of spherical grains that face i: (directions,).

    They are at heights in [low, high]; the share of them that faces i depends on the height.
    """
    r = float(-np.log1p(-tau_0) / np.pi)
    heights = low + (np.arange(n) + 0.5) / n * (high - low)
    w, h = evaluate.vectors(np.repeat(directions(angles), n, axis=0)), mi.Float(np.tile(heights, len(angles)))
    sin, cos = inclination(w)
    _, _, gamma = silhouette(sin, cos, h)
    exposed = h * dr.exp(-r * dr.pi * (1 - h * h))  # less what other grains cover
    weight = np.array((dr.pi - gamma) * exposed).reshape(-1, n)
    return (np.array(dr.exp(-r * shadow(w, h))).reshape(-1, n) * weight).sum(axis=1) / weight.sum(axis=1)


def masking_by_azimuth(effort: Effort) -> Section:
    """Fig. 5: G1 over the azimuth of the normal is the distant term or, turned away, zero."""
    angles, tau_0, rows = [(64.5, 0.0)], 0.5, 28
    measured = measure_masking(
        ExplicitGrains(tau_0),
        angles,
        sensor=Hemisphere(rows, 72),
        points=effort.paths,
        tiles=effort.tiles,
        seed=effort.seed,
        progress=effort.tick,
    )
    ring = int((1 - np.cos(np.radians(50))) * rows)
    low, high = 1 - (ring + 1) / rows, 1 - ring / rows
    distant = ring_mean(angles, tau_0, low, high)[0]
    grain = list(measured.parts).index("grains")
    local, masking = (
        Estimate(*(part[0, grain].reshape(rows, 72)[ring] for part in estimate))
        for estimate in (measured.local, measured.masking)
    )
    facing = local.value == 1
    phi = (np.arange(72) + 0.5) * 5 - 360 * (np.arange(72) >= 36)
    order = np.argsort(phi)
    figure, axes = figures.axes("φ of the normal [°]", "G₁", f"θᵢ 64.5°, θₘ near 50°, τ₀ {tau_0}")
    axes.errorbar(phi[order], masking.value[order], 3 * masking.error[order], fmt=".", label="traced, ±3σ")
    axes.axhline(distant, color="black", linewidth=1, label="G₁dist, Eq. 16")
    axes.legend()
    return Section(
        "Masking by one's own grain, and by others (Fig. 5)",
        "G₁ is the distant term where the normal faces the direction, zero where it is turned away, and in between "
        "only in cells that the border crosses.",
        [
            agreement(
                "G₁ = G₁dist where the normal faces i",
                Estimate(masking.value[facing], masking.error[facing]),
                np.full(facing.sum(), distant),
                effort.tiles,
                INSTRUMENT,
            ),
            Finding(
                "G₁ = 0 where it is turned away",
                f"{masking.value[local.value == 0].max(initial=0):.2g}",
                "0",
                bool(np.all(masking.value[local.value == 0] == 0)),
            ),
        ],
        figures={"fig5": figure},
    )


def distant_masking(effort: Effort) -> Section:
    """Fig. 6: the distant term over the angle of incidence."""
    rows = 16
    angles = [(float(theta), 0.0) for theta in (10, 30, 45, 60, 70, 80, 85, 88)]
    figure, axes = figures.axes("θᵢ [°]", "G₁dist", "spherical grains; lines: Eq. 16, points: traced")
    findings = []
    for tau_0 in (0.2, 0.5, 0.8):
        measured = measure_masking(
            ExplicitGrains(tau_0),
            angles,
            sensor=Hemisphere(rows, 1),
            points=effort.paths / 4,
            tiles=effort.tiles,
            seed=effort.seed,
            progress=effort.tick,
        )
        grain = list(measured.parts).index("grains")
        truth = Estimate(*(part[:, grain] for part in measured.distant))
        model = np.stack(
            [ring_mean(angles, tau_0, 1 - (row + 1) / rows, 1 - row / rows) for row in range(rows)], axis=1
        )
        findings.append(agreement(f"G₁dist at every height, τ₀ {tau_0}", truth, model, effort.tiles, INSTRUMENT))
        for row in (4, 9, 14):
            name = f"τ₀ {tau_0}, θₘ {np.degrees(np.arccos(1 - (row + 0.5) / rows)):.0f}°"
            (line,) = axes.plot([a for a, _ in angles], model[:, row], label=name)
            axes.plot([a for a, _ in angles], truth.value[:, row], "o", color=line.get_color(), markersize=4)
    axes.legend(fontsize=7)
    return Section(
        "The distant term (Fig. 6)",
        f"G₁dist of the exposed points that face i, by their heights in {rows} steps, at {len(angles)} angles.",
        findings,
        figures={"fig6": figure},
    )


def pores(effort: Effort) -> Section:
    """The base that two directions see, V_p (Eq. 23)."""
    pairs = [((t, 20.0), (u, p)) for t in (31.0, 60.0, 76.0) for u, p in ((t, 20.0), (t, 200.0), (50.0, 90.0))]
    findings, rows = [], []
    for tau_0, beta_x, beta_y in ((0.37, 1.0, 1.0), (0.62, 0.8, 1.7), (0.2, 2.5, 0.6), (0.85, 0.35, 0.35)):
        measured = measure_masking(
            ExplicitGrains(tau_0, beta_x, beta_y),
            *zip(*pairs),
            sensor=Hemisphere(1, 1),
            points=effort.paths / 4,
            tiles=effort.tiles,
            seed=effort.seed,
            progress=effort.tick,
        )
        truth = measured.visible("base")
        i, o = (to_sphere(evaluate.vectors(directions(ws)), beta_x, beta_y) for ws in zip(*pairs))
        r = density(mi.Float(tau_0))
        model = {
            name: np.array(exposure(r, 0, shaded(Shadows(i, o), 0)))
            for name, shaded in (("correlated", Shadows.union), ("height", Shadows.sum))
        }
        name = f"τ₀ {tau_0}, β {beta_x}, {beta_y}"
        ours, rival = (agreement(f"V_p, {name}", truth, one, effort.tiles, INSTRUMENT) for one in model.values())
        findings += [ours, told_apart(f"V_p, {name}: Eq. 17 is refused", ours, rival)]
        traced = (f"{truth.value[k]:.5f} ± {truth.error[k]:.5f}" for k in (6, 7))
        rows.append((name, *traced, *(f"{values[k]:.5f}" for values in model.values() for k in (6, 7))))
    head = ("76°", "retro, traced", "opposite, traced", *(f"{w}, {m}" for m in ("Eq. 18", "Eq. 17") for w in "ro"))
    return Section(
        "Visibility of the pores (Eq. 23)",
        "Nine pairs of directions each, at retro-reflection, on opposite sides, and out of plane. "
        "In the table, r and o: retro and opposite.",
        findings,
        [Table(head, rows)],
    )


# --- reflection ------------------------------------------------------------------------------------------------------


def slices(figure: str, kind: str, material: dict[str, Any], tolerance: float, effort: Effort) -> Section:
    """Fig. 7 and 8: the whole hemisphere at 86 degrees of incidence, with and without direction correlation."""
    findings, pictures = [], {}
    for parameters in GRAINS:
        description = grains(parameters, **material)
        measured = shoot(description, [(86.0, 0.0)], effort)
        truth = Estimate(*(part[..., 0] for part in measured.summed))
        found = {m: modelled(description | {"masking": m}, measured)[..., 0] for m in ("correlated", "height")}
        name = "τ₀ {:g}, β {:g}, {:g}".format(*parameters)
        findings.append(judge(f"{name}: Eq. 18", measured, found["correlated"], tolerance))
        across = shoot(description, [(86.0, 90.0)], effort.at_least(ENOUGH), sensor=COARSE)
        ours, rival = (
            judge(
                f"{name}, from across: Eq. 18",
                across,
                modelled(description | {"masking": m}, across)[..., 0],
                tolerance,
            )
            for m in found
        )
        findings += [ours, told_apart(f"{name}, from across: Eq. 17 is refused", ours, rival)]
        key = f"fig{figure}-" + "-".join(f"{p:g}" for p in parameters)
        pictures[key] = figures.slices(f"{kind} grains, θᵢ 86°, {name}", measured.sensor, truth, found)
    return Section(
        f"Slices at 86°, {kind} grains on black (Fig. {figure})",
        "Every cell of the hemisphere, and the albedo. The map of relative errors is white where the model is right. "
        f"From across, φᵢ 90°, where Eq. 17 errs the most, in {COARSE.cells} cells, at least {ENOUGH:g} paths.",
        findings,
        figures=pictures,
    )


def bases(effort: Effort) -> Section:
    """Anisotropic grains on a Lambertian base, with both grains and base reflecting."""
    findings = []
    base = {"base": {"type": "diffuse", "reflectance": 0.5}}
    for name, material, tolerance in (("metal", METAL, INSTRUMENT), ("diffuse", DIFFUSE, QUADRATURE)):
        for parameters in GRAINS:
            description = grains(parameters, **material, **base)
            measured = shoot(description, [(30.0, 40.0), (70.0, 250.0)], effort)
            claim = "{}: τ₀ {:g}, β {:g}, {:g}".format(name, *parameters)
            findings.append(judge(claim, measured, modelled(description, measured)[..., 0], tolerance))
    return Section(
        "Grains on a Lambertian base", "Incidence (30°, 40°) and (70°, 250°); all cells, and the albedo.", findings
    )


def models(effort: Effort) -> Section:
    """Fig. 9: four models of the same grains."""
    description = grains((0.5, 1.0, 1.0), **METAL)
    rows, findings, pictures = [], [], {}
    for theta in (30.0, 60.0, 86.0):
        measured = shoot(description, [(theta, 0.0)], effort, sensor=COARSE)
        truth = measured.summed.value[..., 0]
        error = {
            name: float(np.abs(modelled(description | other, measured)[..., 0] - truth).sum() / truth.sum())
            for name, other in MODELS.items()
        }
        noise = float(measured.summed.error[..., 0].sum() / truth.sum())
        rows.append((f"{theta:g}°", f"{noise:.1%}", *(f"{x:.1%}" for x in error.values())))
        ours, others = error["micrograin"], min(error[name] for name in PUBLISHED)
        findings.append(
            Finding(f"nearer than any other at {theta:g}°", f"{ours:.1%} against {others:.1%}", "less", ours < others)
        )
    fine = shoot(description, [(86.0, 0.0)], effort)
    found = {name: modelled(description | other, fine)[..., 0] for name, other in MODELS.items()}
    traced = Estimate(*(part[..., 0] for part in fine.summed))
    pictures["fig9"] = figures.slices("metal grains, θᵢ 86°, τ₀ 0.5, β 1", fine.sensor, traced, found)
    return Section(
        "Models of the same grains (Fig. 9)",
        "Single scattering by metal grains, τ₀ 0.5, β 1, on black; the others get the roughness of Eq. 28, and assume "
        "other microgeometries. Of d'Eon 2023 and Mérillou 2000 only the paper's description was at hand: see "
        "their pages. The table: mean error over 128 cells of the hemisphere, over the mean value; noise is one "
        "standard error.",
        findings,
        [Table(("θᵢ", "noise", *MODELS), rows)],
        pictures,
    )


def retro(effort: Effort) -> Section:
    """Fig. 11: exact retro-reflection of metal grains on a Lambertian base."""
    thetas, rows, findings = (45.0, 75.0, 85.0), [], []
    named = {name: other for name, other in MODELS.items() if "masking" in other}
    more = effort._replace(paths=8 * effort.paths)  # a small window catches few of them
    for beta in (0.5, 1.0, 2.0):
        description = grains((0.2, beta, beta), **METAL, base={"type": "diffuse", "reflectance": 0.5})
        measured = shoot(description, [(theta, 0.0) for theta in thetas], more, sensor=Window("retro", 1.5, 1))
        truth = Estimate(*(part[:, 0, 0] for part in measured.summed))
        found = {name: modelled(description | other, measured, 64)[:, 0, 0] for name, other in named.items()}
        judged = {
            name: agreement(f"β {beta:g}", truth, model, effort.tiles, INSTRUMENT) for name, model in found.items()
        }
        ours = judged.pop("micrograin")
        findings.append(ours)
        if beta >= 1:  # flatter grains hide less of each other, and need more paths to tell
            findings += [told_apart(f"β {beta:g}: {name} is refused", ours, rival) for name, rival in judged.items()]
        for k, theta in enumerate(thetas):
            traced = f"{truth.value[k]:.5f} ± {truth.error[k]:.5f}"
            rows.append((beta, f"{theta:g}°", traced, *(f"{value[k]:.5f}" for value in found.values())))
    return Section(
        "Retro-reflection (Fig. 11)",
        "f cos θₒ over a square of 3° about wi: metal grains, τ₀ 0.2, on a Lambertian base of albedo 0.5.",
        findings,
        [Table(("β", "θ", "traced", *named), rows)],
    )


# --- all orders ------------------------------------------------------------------------------------------------------

THETAS = (5.0, 45.0, 70.0, 85.0)


def furnace(effort: Effort) -> Section:
    """Fig. 17 and 18: what single scattering loses."""
    white, ratio, truths, found = [], [], [], []
    angles = [(theta, 0.0) for theta in THETAS]
    for tau_0 in (0.2, 0.5, 0.8):
        for beta in (0.1, 0.5, 1.0, 2.0):
            description = grains((tau_0, beta, beta), base={"type": "diffuse", "reflectance": 1.0})
            measured = shoot(description, angles, effort, orders=None, apart=2)
            single = Estimate(*(part[:, 0, 0] for part in measured.albedo))
            total = measured.total_albedo.value[:, 0] + measured.cut.value[:, 0]
            truths.append(single)
            found.append(evaluate.albedo(evaluate.load(description), directions(angles))[0])
            white.append((tau_0, beta, *(f"{s:.3f}" for s in single.value), f"{np.abs(total - 1).max():.1e}"))

            grey = description | {"eta": 1.0152, "k": 6.6273, "base": {"type": "diffuse", "reflectance": 0.5}}
            measured = shoot(grey, angles, effort, orders=None, apart=2)
            ratio.append(
                (tau_0, beta, *(f"{x:.3f}" for x in measured.albedo.value[:, 0, 0] / measured.total_albedo.value[:, 0]))
            )
    head = ("τ₀", "β", *(f"{theta:g}°" for theta in THETAS))
    return Section(
        "Energy of single scattering (Fig. 17, 18)",
        "First table: mirror grains on a white Lambertian base, the albedo of the first order, and how far all orders "
        "are from 1. Second: conductor grains on a base of albedo 0.5, the share of the first order in all.\n\n"
        "The paper says of Fig. 18 that what scatters more than once grows with τ₀, with β and with the angle of "
        "incidence, and is little again at extreme grazing. With β it does. With the angle it grows for flat grains "
        "(β 0.1) only; for the others the share of the first order grows towards grazing, after a small dip at most. "
        "With τ₀ it grows near the normal, and shrinks at 85°.",
        [
            agreement(
                "albedo of the first order, white furnace",
                Estimate(*np.stack(truths, axis=1)),
                np.array(found),
                effort.tiles,
                INSTRUMENT,
            )
        ],
        [Table((*head, "|1 - all orders|"), white), Table(head, ratio)],
    )


def multiple(effort: Effort) -> Section:
    """`scattering: multiple` against all orders."""
    thetas, rows = (5.0, 45.0, 75.0), []
    worst: dict[bool, float] = {}
    half = {"eta": 1.0, "k": 2.0}  # reflects a half at normal incidence
    for parameters, metal, base in (
        ((0.2, 0.5, 0.5), METAL, 0.5),
        ((0.5, 1.0, 1.0), METAL, 0.5),
        ((0.5, 2.0, 2.0), METAL, 0.5),
        ((0.8, 2.0, 2.0), METAL, 0.5),
        ((0.5, 0.2, 2.0), METAL, 0.5),
        ((0.5, 1.0, 1.0), half, 0.5),
        ((0.5, 2.0, 2.0), half, 0.9),
        ((0.5, 2.0, 2.0), METAL, 0.0),
    ):
        description = grains(parameters, **metal, base={"type": "diffuse", "reflectance": base})
        measured = shoot(description, [(theta, 0.0) for theta in thetas], effort, orders=None, apart=2)
        truth = measured.total_albedo.value[:, 0]
        found = {
            name: evaluate.albedo(evaluate.load(description | {"scattering": name}), measured.wi)[0]
            for name in ("single", "multiple")
        }
        error = np.abs(found["multiple"] / truth - 1).max()
        worst[base > 0] = max(worst.get(base > 0, 0.0), error)
        name = "τ₀ {:g}, β {:g}, {:g}".format(*parameters)
        columns = (" ".join(f"{x:.3f}" for x in values) for values in (truth, found["multiple"], found["single"]))
        rows.append((name, "0.5" if metal is half else "0.91", base, *columns, f"{error:.1%}"))
    return Section(
        "`scattering: multiple` against all orders",
        "Directional albedo at 5, 45 and 75°. F: the metal's reflectance at normal incidence; R: the Lambertian "
        "base's. This lobe is an approximation: it is reported, not judged.",
        [
            Finding("largest error on a base that reflects", f"{worst[True]:.1%}"),
            Finding("largest error on a black base", f"{worst[False]:.1%}"),
        ],
        [Table(("grains", "F", "R", "traced", "`multiple`", "`single`", "error of `multiple`"), rows)],
    )


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "masking": masking_by_azimuth,
    "distant": distant_masking,
    "pores": pores,
    "conductors": partial(slices, "7", "conductor", METAL, INSTRUMENT),
    "diffuse": partial(slices, "8", "diffuse", DIFFUSE, QUADRATURE),
    "bases": bases,
    "models": models,
    "retro": retro,
    "furnace": furnace,
    "multiple": multiple,
}
"""The report, section by section, in its order."""
