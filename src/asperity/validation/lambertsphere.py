"""The half space of Lambertian spheres against random walks and against spheres one can hit (d'Eon 2021)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

from ..goniophotometer import Estimate, Points, measure
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..models.lambertsphere.microgeometry import ExplicitSpheres, RandomWalk, Sphere, sphere_cloud
from ..models.lambertsphere.transport import phase_cdf
from . import figures
from .report import CLAIMS, SIGNIFICANCE, Effort, Finding, Section, Table, agreement, told_apart

REFIT = 3e-3
"""Relative error of the refitted modes below 84 degrees, for albedos from .2 on, as tests/models/lambertsphere find."""
FITTED_H = 1.2e-3
"""Relative error of the directional albedo: H is fitted to 6e-4, and stands twice in what is scattered repeatedly."""
ALBEDOS = (0.2, 0.5, 0.8, 0.95, 0.99)
FAR_OFF = (0.2, 0.5, 0.8)
"""Of these, at which `fast` (Eq. 41) errs by more than the noise of few paths."""
INCIDENT = ((5.0, 0.0), (38.0, 0.0), (60.0, 0.0), (80.0, 0.0))
OUTGOING = tuple((theta, phi) for theta in (10.0, 38.0, 60.0, 80.0) for phi in (0.0, 45.0, 90.0, 135.0, 180.0))
BOND = 0.40576
"""Bond albedo of spheres of albedo 0.8."""
VARIANTS = ("accurate", "published", "fast")
SHEET: dict[str, dict[str, Any]] = {
    "Lambert": {"type": "diffuse"},
    "Oren-Nayar, σ 30°": {"type": "orennayar", "sigma": 30.0},
    "Chandrasekhar": {"type": "chandrasekhar"},
    "Lambertian spheres": {"type": "lambertsphere"},
}


def spheres(albedo: float, **others: Any) -> dict[str, Any]:
    """A scene's description of the model."""
    return {"type": "lambertsphere", "albedo": albedo} | others


def phase_function(effort: Effort) -> Section:
    """Fig. 2: how a sphere scatters, by its geometry, against Eq. 1."""
    n = int(effort.paths)
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    drawn, _ = Sphere(1.0).sample(mi.BSDFContext(), si, *evaluate.variates(n, effort.seed), True)
    cos = np.array(drawn.wo.z, dtype=float)
    grid = np.linspace(-1, 1, 65)
    expected = np.diff(np.array(phase_cdf(mi.Float(grid)), dtype=float))
    counts, _ = np.histogram(np.clip(cos, -1, 1), grid)
    chi = stats.chisquare(counts, expected / expected.sum() * counts.sum()).pvalue
    bound = SIGNIFICANCE / CLAIMS
    mean, error = cos.mean(), cos.std() / np.sqrt(n)
    return Section(
        "The phase function (Eq. 1 to 5)",
        f"{n:g} rays onto a Lambertian sphere, by its geometry alone.",
        [
            Finding(
                "distribution of the deflection", f"χ² over 64 cells, p = {chi:.2g}", f"{bound:.2g}", bool(chi > bound)
            ),
            Finding("mean cosine -4/9", f"{mean:.5f}", f"± {4 * error:.1g}", bool(abs(mean + 4 / 9) < 4 * error)),
        ],
    )


def walked(albedo: float, effort: Effort) -> Estimate:
    """f cos θo of a random walk (incident, outgoing)."""
    # Without end for albedo 1, and longer the nearer it is: those get fewer paths.
    paths = effort.paths * (1 if albedo < 0.9 else 0.25)
    measured = measure(
        RandomWalk(albedo),
        INCIDENT,
        sensor=Points(OUTGOING),
        paths=paths,
        tiles=effort.tiles,
        seed=effort.seed,
        progress=effort.tick,
    )
    return Estimate(*(part[..., 0] for part in measured.summed))


def modelled(description: dict[str, Any]) -> np.ndarray:
    """f cos θo of a BSDF (incident, outgoing)."""
    bsdf, wo = evaluate.load(description), directions(OUTGOING)
    return np.stack([evaluate.cell_means(bsdf, wi, wo[:, None])[0] for wi in directions(INCIDENT)])


def brdf(effort: Effort) -> Section:
    """Fig. 4 to 8: all variants against the random walk."""
    findings, rows, figure_rows = [], [], {}
    for albedo in ALBEDOS:
        truth = walked(albedo, effort)
        found = {variant: modelled(spheres(albedo, variant=variant)) for variant in VARIANTS}
        ours, fast = (
            agreement(f"{variant}, c {albedo:g}", truth, found[variant], effort.tiles, REFIT)
            for variant in ("accurate", "fast")
        )
        findings.append(ours)
        if albedo in FAR_OFF:
            findings.append(told_apart(f"fast is refused, c {albedo:g}", ours, fast))
        noise = float(np.median(truth.error / truth.value))
        relative = {name: model / truth.value - 1 for name, model in found.items()}
        errors = (f"{np.sqrt(np.mean(e**2)):.2%} / {np.abs(e).max():.1%}" for e in relative.values())
        rows.append((albedo, f"{noise:.2%}", *errors))
        figure_rows[albedo] = truth, found
    figure, grid = figures.panels(
        1, 3, "φ between wi and wo [°]; 0: against the light", "f cos θₒ [1/sr]", "60° to 60°"
    )
    row = INCIDENT.index((60.0, 0.0))
    columns = [k for k, (theta, _) in enumerate(OUTGOING) if theta == 60]
    for axes, albedo in zip(grid[0], (0.2, 0.8, 0.99)):
        truth, found = figure_rows[albedo]
        phi = [OUTGOING[k][1] for k in columns]
        axes.errorbar(
            phi, truth.value[row, columns], 3 * truth.error[row, columns], fmt="o", markersize=3, color="black"
        )
        for name, style in zip(VARIANTS, ("-", "--", ":")):
            axes.plot(phi, found[name][row, columns], style, label=name)
        axes.set_title(f"c {albedo:g}", fontsize=9)
        axes.legend(fontsize=7)
    return Section(
        "The BRDF and its variants (Fig. 4 to 8)",
        "Random walks with next-event estimation; incidence 5, 38, 60, 80°, twenty outgoing directions. Relative "
        "errors: rms and largest, noise included. `fast` (Eq. 41) is clamped to zero over wide angles below "
        "c .25, and gains energy above .98.",
        findings,
        [Table(("c", "noise", *VARIANTS), rows)],
        {"slices": figure},
    )


def energy(effort: Effort) -> Section:
    """Directional albedo, and the white furnace."""
    cosines = (0.1, 0.3, 0.6, 1.0)
    incident = [(float(np.degrees(np.arccos(mu))), 0.0) for mu in cosines]
    rows, findings = [], []
    for albedo in ALBEDOS:
        paths = effort.paths * (1 if albedo < 0.9 else 0.25)
        measured = measure(
            RandomWalk(albedo), incident, paths=paths, tiles=effort.tiles, seed=effort.seed, progress=effort.tick
        )
        truth = Estimate(*(part[:, 0] for part in measured.total_albedo))
        found = {v: evaluate.albedo(evaluate.load(spheres(albedo, variant=v)), measured.wi)[0] for v in VARIANTS}
        findings.append(
            agreement(f"albedo of accurate, c {albedo:g}", truth, found["accurate"], effort.tiles, FITTED_H)
        )
        rows.append((albedo, *(" ".join(f"{x:.4f}" for x in values) for values in (truth.value, *found.values()))))
    white = evaluate.albedo(evaluate.load(spheres(1.0)), directions([(t, 0.0) for t in (0, 30, 60, 80, 88, 89.5)]))[0]
    findings.append(
        Finding(
            "white furnace, c = 1, 0 to 89.5°",
            f"|1 - albedo| up to {np.abs(white - 1).max():.2%}",
            "0.3 %",
            bool(np.abs(white - 1).max() < 3e-3),
        )
    )
    return Section(
        "Energy",
        "Directional albedo at cosines .1, .3, .6 and 1.",
        findings,
        [Table(("c", "random walk", *VARIANTS), rows)],
    )


def explicit(effort: Effort) -> Section:
    """Fig. 1 and 10: spheres one can hit, ever further apart."""
    incident, albedo = [(38.0, 0.0)], 0.8
    sensor = Points(((38, 0), (41, 0), (48, 0), (60, 90), (60, 180), (80, 90)))
    model = evaluate.cell_means(
        evaluate.load(spheres(albedo)), directions(incident)[0], sensor.directions(directions(incident)[0])
    )[0]
    rows, off = [], []
    for fraction in (0.2, 0.07, 0.02):
        geometry = ExplicitSpheres(albedo, fraction, width=min(6.0, 240 * fraction))
        measured = measure(
            geometry,
            incident,
            sensor=sensor,
            paths=effort.paths / 2,
            tiles=max(effort.tiles // 2, 4),
            seed=effort.seed,
            progress=effort.tick,
        )
        ratio = measured.summed.value[0, :, 0] / model
        error = measured.summed.error[0, :, 0] / model
        total = Estimate(*(part[0, 0] for part in measured.total_albedo))
        columns = (f"{r:.3f} ± {e:.3f}" for r, e in zip(ratio, error))
        rows.append((f"{fraction:.0%}", *columns, f"{total.value:.4f} ± {total.error:.4f}"))
        off.append(np.abs(ratio[3:] - 1).mean())
    return Section(
        "Spheres one can hit (Fig. 1, 10)",
        "f cos θₒ over the model's, c 0.8, incidence 38°, spheres at independent places in a slab of 12 mean free "
        "paths. Away from retro-reflection they come to the model in proportion to the share of the volume that they "
        "fill. At exact retro-reflection single scattering is doubled for any share: the way back is free where the "
        "way in was. That hot spot narrows with the share; classical transport, and so the model, has none.",
        [
            Finding(
                "deviation away from retro-reflection falls with the share of the volume",
                ", ".join(f"{x:.1%}" for x in off),
                "falling",
                bool(off[0] > off[1] > off[2]),
            )
        ],
        [Table(("volume", "retro", "3° off", "10° off", "60°, 90°", "60°, 180°", "80°, 90°", "albedo"), rows)],
    )


def slab(effort: Effort) -> Section:
    """A thick slab of the volume with the phase function, through Mitsuba's own path tracer for volumes."""
    rows, findings, albedo = [], [], 0.8
    bsdf = evaluate.load(spheres(albedo))
    samples = int(min(effort.paths, 2**20))
    for (theta, phi), (out, azimuth) in (((38, 0), (60, 180)), ((60, 0), (30, 90)), ((38, 0), (48, 0))):
        wi, wo = directions([(theta, phi), (out, azimuth)])
        scene = {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": 2000, "rr_depth": 50},
            "slab": {
                "type": "cube",
                "to_world": mi.ScalarTransform4f().translate([0, 0, -50]).scale([500, 500, 50]),
                "bsdf": {"type": "null"},
                "interior": {
                    "type": "homogeneous",
                    "sigma_t": 1.0,
                    "albedo": albedo,
                    "phase": {"type": "lambertsphere_phase"},
                },
            },
            "light": {"type": "directional", "direction": (-wi).tolist(), "irradiance": 1.0},
            "sensor": {
                "type": "distant",
                "direction": (-wo).tolist(),
                "target": [0, 0, 0],
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent"},
            },
        }
        loaded, runs = mi.load_dict(scene, parallel=False), []
        for k in range(16):
            effort.tick()
            image = np.array(mi.render(loaded, spp=samples // 16, seed=16 * effort.seed + k))
            runs.append(float(image[0, 0, 0]))
        truth = Estimate(np.array([np.mean(runs)]), np.array([np.std(runs, ddof=1) / 4]))
        model = evaluate.cell_means(bsdf, wi, wo[None, None])[0] * wi[2] / wo[2]  # radiance for unit irradiance
        name = f"({theta}°, {phi}°) to ({out}°, {azimuth}°)"
        findings.append(agreement(name, truth, model, 16, REFIT))
        rows.append((name, f"{truth.value[0]:.5f} ± {truth.error[0]:.5f}", f"{model[0]:.5f}"))
    return Section(
        "Dust cloud and dusty surface",
        "Radiance of a slab, 100 mean free paths deep, of Mitsuba's homogeneous medium with the phase function "
        "`lambertsphere_phase`, by `volpath`, and of the model; c 0.8.",
        findings,
        [Table(("directions", "volpath", "model"), rows)],
    )


def ball(effort: Effort, radius: float = 150.0, fraction: float = 0.07, size: int = 96) -> Section:
    """Fig. 1: a ball of spheres, and a smooth ball with the model."""
    rng = np.random.default_rng(effort.seed)
    count = int(fraction * radius**3)
    centres = rng.normal(size=(count, 3))
    centres *= radius * rng.random((count, 1)) ** (1 / 3) / np.linalg.norm(centres, axis=1, keepdims=True)
    albedo, spp = 0.8, int(np.clip(effort.paths / size**2 / 4, 4, 128))
    shapes = {
        f"{count} spheres": sphere_cloud(centres) | {"bsdf": {"type": "diffuse", "reflectance": albedo}},
        "model": {"type": "sphere", "radius": radius, "bsdf": spheres(albedo)},
        "Lambert, same Bond albedo": {
            "type": "sphere",
            "radius": radius,
            "bsdf": {"type": "diffuse", "reflectance": BOND},
        },
    }
    figure, grid = figures.panels(
        2, len(shapes), "", "", f"c {albedo}, {fraction:.0%} of the volume; front and side light"
    )
    rows = []
    for row, angle in zip(grid, (0, 90)):
        images = {name: lit(shape, angle, 1.1 * radius, size, spp, effort.tick) for name, shape in shapes.items()}
        for axes, (name, image) in zip(row, images.items()):
            axes.imshow(np.clip(image, 0, 1) ** (1 / 2.2), cmap="gray", vmin=0, vmax=1)
            axes.set_title(name, fontsize=8)
            axes.set_axis_off()
        truth, *others = images.values()
        rows.append((f"{angle}°", *(f"{np.abs(image - truth).mean() / truth.mean():.1%}" for image in others)))
    return Section(
        "A ball of spheres (Fig. 1)",
        "Mean difference of the pictures to that of the spheres, over the mean. In front light the "
        "hot spot of spheres that are not infinitely far apart makes them brighter than the model.",
        tables=[Table(("light from", "model", "Lambert"), rows)],
        figures={"ball": figure},
    )


def lit(
    shape: dict[str, Any], angle: float, scale: float, size: int, spp: int, tick: Callable[..., None]
) -> np.ndarray:
    """A picture (size, size) of a shape about the origin, light from the side by ``angle`` in degrees."""
    tick()
    light = [-np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle))]
    camera = mi.ScalarTransform4f().look_at([0, 0, 5 * scale], [0, 0, 0], [0, 1, 0]).scale([scale, scale, 1])
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 64, "rr_depth": 16},
        "light": {"type": "directional", "direction": light, "irradiance": np.pi},
        "sensor": {
            "type": "orthographic",
            "to_world": camera,
            "film": {"type": "hdrfilm", "width": size, "height": size},
        },
        "shape": shape,
    }
    return np.array(mi.render(mi.load_dict(scene, parallel=False), spp=spp))[..., 0]


def sheet(effort: Effort, size: int = 128, spp: int = 64) -> Section:
    """Fig. 9 and 11: spheres under front, side and back light."""
    figure, grid = figures.panels(3, len(SHEET), "", "", "front, side and back light; reflectance 0.5")
    for row, angle in zip(grid, (0, 90, 150)):
        for axes, (name, material) in zip(row, SHEET.items()):
            image = lit({"type": "sphere", "bsdf": material | {"reflectance": 0.5}}, angle, 1.1, size, spp, effort.tick)
            axes.imshow(np.clip(image, 0, 1) ** (1 / 2.2), cmap="gray", vmin=0, vmax=1)
            axes.set_title(name, fontsize=8)
            axes.set_axis_off()
    return Section(
        "Comparison (Fig. 9, 11)",
        "Lambertian spheres are flat in front light, like the full moon, and brighter than Lambert's law at the edge.",
        figures={"sheet": figure},
    )


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "phase": phase_function,
    "brdf": brdf,
    "energy": energy,
    "explicit": explicit,
    "slab": slab,
    "ball": ball,
    "sheet": sheet,
}
"""The report, section by section, in its order."""
