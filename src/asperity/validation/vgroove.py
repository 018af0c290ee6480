"""The V-groove model against light traced in explicit grooves (Lee et al. 2018, Sec. 7 and 8)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..goniophotometer import Estimate, Hemisphere, Measurement, measure
from ..goniophotometer.grooves import GrooveRays, Grooves, Shape
from ..goniophotometer.sensors import directions
from ..lab import evaluate
from ..microfacet.distributions import DISTRIBUTIONS
from ..models.vgroove import VGroove
from ..models.vgroove.bounces import LOST, needed_bounces
from ..models.vgroove.kaleidoscope import Groove, exit_angle, leaving_share
from . import figures
from .report import Effort, Finding, Section, Table, agreement, told_apart

FLOAT32 = 1e-4
"""Relative error that is not noise."""
QUADRATURE = 2e-3
"""Mean relative error of the non-symmetric model's fixed quadrature: tests/models/vgroove/test_nonsymmetric.py."""
POLE = 6.0
"""Degrees about the mirror direction: cells that reach there are not judged. f has a pole that few directions miss."""
COVER = 16
"""Directions that cover a cell, squared, when the model is averaged over it."""
EXIT = 1e-4
"""Radians: float32 adds up some hundred bounces, each rounded to 1e-7."""
ALPHAS = (0.3, 0.5, 0.7, 1.0)
ENOUGH = 4e6
"""Paths per direction, at least, where bounces are counted apart: of steep facets, few scatter light three times."""
RAYS = 1000
"""In a groove, stratified; independent ones would have an error of a few percent instead."""
TABLE_2 = {
    "beckmann": ((2, 3, 3), (2, 3, 3), (3, 3, 4)),
    "phong": ((2, 3, 5), (3, 4, 7), (3, 5, 16)),
    "ggx": ((3, 4, 5), (4, 5, 7), (8, 12, 16)),
}
"""Lee 2018, Table 2: rows are 90, 95 and 99 %, columns are alpha .5, .7 and 1."""


# --- one groove ------------------------------------------------------------------------------------------------------


@dr.syntax
def follow(rays: GrooveRays, rng: mi.PCG32, o: mi.Point3f, d: mi.Vector3f) -> tuple[mi.UInt32, mi.Float]:
    """Number of bounces in mirror grooves, and the angle at which a ray leaves."""
    count, active = mi.UInt32(0), mi.Bool(True)
    while active:
        step = rays.step(rng, o, d, active)
        d = dr.select(step.hit, d - 2 * dr.dot(d, step.si.n) * mi.Vector3f(step.si.n), d)
        o = dr.select(step.hit, step.si.p, o)
        count += dr.select(step.hit, mi.UInt32(1), 0)
        active &= ~step.left & (count < 1000)
    return count, dr.atan2(d.x, d.z)


def traced(psi: np.ndarray, left: np.ndarray, right: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Trace `RAYS` rays across each groove: shares of 1 to ``most`` bounces and more (grooves, most + 1), and exits.

    Exits are each ray's angle and number of bounces, (2, grooves, RAYS). Angles are in radians; a direction's is from
    the normal, positive towards where the left facet tilts.
    """
    n = len(psi)
    across = mi.Vector2f(1, 0)
    tilts = [mi.Float(np.repeat(tilt, RAYS)) for tilt in (left, right)]
    mirror = mi.load_dict({"type": "conductor", "material": "none"})
    rays = Grooves(lambda rng: Shape(across, *tilts), mirror).rays(())
    rng = mi.PCG32(1)
    rays.enter(rng, None, n * RAYS)
    angle = mi.Float(np.repeat(psi, RAYS))
    x = mi.Float(np.tile((np.arange(RAYS) + 0.5) / RAYS, n))
    o, d = mi.Point3f(x, 0, 0), mi.Vector3f(-dr.sin(angle), 0, -dr.cos(angle))

    count, out = (np.array(a).reshape(n, RAYS) for a in follow(rays, rng, o, d))
    capped = np.minimum(count, most + 1)
    shares = np.stack([(capped == k).mean(axis=1) for k in range(1, most + 2)], axis=1)
    return shares, np.stack([out, count])


def predicted(psi: np.ndarray, left: np.ndarray, right: np.ndarray, most: int) -> np.ndarray:
    """The same shares by the kaleidoscope: of what enters, by the facet that it meets first (Lee 2018, Eq. 6, 9)."""
    opening = np.cos(psi) * (1 / np.tan(left) + 1 / np.tan(right))
    total = np.zeros((len(psi), most + 1))
    for sign, first, second in ((1, left, right), (-1, right, left)):
        groove, angle = Groove(mi.Float(first), mi.Float(second)), mi.Float(sign * psi)
        facing = np.maximum(np.cos(sign * psi - first), 0) / np.sin(first) / opening
        for k in range(1, most + 1):
            total[:, k - 1] += facing * np.array(leaving_share(groove, angle, k))
    total[:, most] = np.maximum(1 - total[:, :most].sum(axis=1), 0)
    return total


def kaleidoscope(step: int = 1, tick: Callable[..., None] = lambda *_: None) -> Section:
    """Table 1: shares of light by bounces, for single grooves."""
    rows, findings = [], []
    theta = np.arange(-89, 90, step)
    grids = {
        "symmetric": [(180 - v) / 2 for v in np.arange(1, 181, 5)],
        "non-symmetric": [(left, right) for left in np.arange(5, 90, 5) for right in np.arange(5, 90, 5)],
    }
    published = {"symmetric": (0.003, 0.0005), "non-symmetric": (0.004, 0.0005)}
    for name, grid in grids.items():
        tilts = np.radians([tilt if isinstance(tilt, tuple) else (tilt, tilt) for tilt in grid])
        errors, exits = [], []
        for chunk in np.array_split(tilts, max(len(tilts) * len(theta) // 1000, 1)):
            tick()
            psi = np.tile(np.radians(theta), len(chunk))
            left, right = np.repeat(chunk, len(theta), axis=0).T
            most = min(int(np.ceil(np.pi / (np.pi - left - right).min())), 180)
            shares, (out, count) = traced(psi, left, right, most)
            errors.append(np.abs(shares - predicted(psi, left, right, most)).sum(axis=1))
            exits.append(exit_error(psi, left, right, out, count))
        error = np.concatenate(errors)
        largest = published[name][0]
        rows.append((name, len(error), f"{error.max():.4f}", f"{error.mean():.5f}", *published[name]))
        findings.append(
            Finding(
                f"{name}: shares by bounces", f"L1 error {error.max():.4f}", f"{largest}", bool(error.max() <= largest)
            )
        )
        worst = float(np.max(exits))
        findings.append(Finding(f"{name}: exit angles", f"{worst:.1e} rad", f"{EXIT:g} rad", worst < EXIT))
    return Section(
        "The kaleidoscope (Table 1)",
        f"{RAYS} stratified rays over the opening of a groove. The paper's numbers are for random walks; with as "
        "many independent rays the L1 error would be some percent. Symmetric grooves: incidence -89° to 89°, "
        "apertures 1° to 176° by 5°. Non-symmetric: tilts 5° to 85° by 5° (at 90°, which the paper includes, a facet "
        "has no width).",
        findings,
        [Table(("grooves", "configurations", "max", "mean", "max, paper", "mean, paper"), rows)],
    )


def exit_error(psi: np.ndarray, left: np.ndarray, right: np.ndarray, out: np.ndarray, count: np.ndarray) -> float:
    """Largest error of the exit angle (Eq. 5, 8), whichever facet was met first."""
    candidates = []
    for sign, first, second in ((1, left, right), (-1, right, left)):
        groove = Groove(*(mi.Float(np.repeat(tilt, RAYS)) for tilt in (first, second)))
        k = mi.UInt32(count.ravel().astype(np.uint32))
        angle = sign * np.array(exit_angle(groove, mi.Float(np.repeat(sign * psi, RAYS)), k))
        candidates.append(np.abs(angle.reshape(out.shape) - out))
    return float(np.minimum(*candidates).max())


# --- many grooves ----------------------------------------------------------------------------------------------------


def grooves(alpha: float, **others: Any) -> dict[str, Any]:
    """A scene's description of the model."""
    return {"type": "vgroove", "alpha": alpha} | others


OTHERS: dict[str, dict[str, Any]] = {
    "non-symmetric GGX, α 0.5": grooves(0.5, symmetric=False),
    "non-symmetric GGX, α 1": grooves(1.0, symmetric=False),
    "non-symmetric Beckmann, α 0.7": grooves(0.7, symmetric=False, distribution="beckmann"),
    "symmetric Beckmann, α 0.7": grooves(0.7, distribution="beckmann"),
    "symmetric Phong, α 0.7": grooves(0.7, distribution="phong"),
    "symmetric GGX, α 0.2, 0.8": {"type": "vgroove", "alpha_u": 0.2, "alpha_v": 0.8},
    "non-symmetric GGX, α 0.2, 0.8": {"type": "vgroove", "alpha_u": 0.2, "alpha_v": 0.8, "symmetric": False},
    "symmetric gold, GGX, α 0.5": grooves(0.5, material="Au"),
}
"""Besides symmetric grooves of GGX: what the paper shows in its supplement."""


def shoot(description: dict[str, Any], angles: Any, effort: Effort, **options: Any) -> Measurement:
    """Measure the explicit grooves that the description stands for."""
    geometry = VGroove.microgeometry(description)
    return measure(
        geometry, angles, paths=effort.paths, tiles=effort.tiles, seed=effort.seed, progress=effort.tick, **options
    )


def by_bounce(description: dict[str, Any], measured: Measurement, orders: int) -> np.ndarray:
    """The model's means over cells, a bounce at a time and then the rest: (directions, orders, cells)."""
    limits = [*range(1, orders), None]
    totals = []
    for most in limits:
        bsdf = evaluate.load(description | ({} if most is None else {"max_bounces": most}))
        cells = (measured.sensor.directions(wi, COVER) for wi in measured.wi)
        totals.append([evaluate.cell_means(bsdf, wi, wo)[0] for wi, wo in zip(measured.wi, cells)])
    return np.diff(np.stack(totals, axis=1), axis=1, prepend=0)


def compared(claim: str, measured: Measurement, model: np.ndarray, tolerance: float) -> list[Finding]:
    """A finding a bounce, over all directions of incidence, away from the pole."""
    away, found = off_pole(measured), []
    for n in range(measured.orders):
        truth = Estimate(*(part[:, n, :, 0][away] for part in measured.values))
        name = f"{claim}, {n + 1} bounce{'s' if n else ''}{' and more' if n + 1 == measured.orders else ''}"
        found.append(agreement(name, truth, model[:, n][away], len(measured.labels), tolerance))
    return found


def off_pole(measured: Measurement) -> np.ndarray:
    """Cells (directions, cells) that do not reach within `POLE` of the mirror direction."""
    mirror = directions([(theta, phi + 180) for theta, phi in measured.incident])
    cover = (measured.sensor.directions(wi, COVER) for wi in measured.wi)
    return np.stack([np.all(wo @ m < np.cos(np.radians(POLE)), axis=1) for wo, m in zip(cover, mirror)])


def all_bounces(claim: str, measured: Measurement, model: np.ndarray, tolerance: float) -> list[Finding]:
    """That all bounces together are right, and that one alone, as by Cook and Torrance, is refused."""
    away = off_pole(measured)
    truth = Estimate(*(part[..., 0][away] for part in measured.summed))
    ours, alone = (
        agreement(f"{claim}, all bounces", truth, values[away], len(measured.labels), tolerance)
        for values in (model.sum(axis=1), model[:, 0])
    )
    return [ours, told_apart(f"{claim}: one bounce (Cook-Torrance) is refused", ours, alone)]


def brdf_by_bounce(effort: Effort) -> Section:
    """Fig. 11: the symmetric BRDF, bounce by bounce."""
    findings, pictures, thetas = [], {}, (0.0, 20.0, 40.0, 60.0, 80.0)
    for alpha in ALPHAS:
        description = grooves(alpha)
        measured = shoot(description, [(theta, 0.0) for theta in thetas], effort.at_least(ENOUGH), apart=4)
        model = by_bounce(description, measured, 4)
        findings += compared(f"α {alpha:g}", measured, model, FLOAT32)
        findings += all_bounces(f"α {alpha:g}", measured, model, FLOAT32)
        if alpha in (ALPHAS[0], ALPHAS[-1]):
            name = f"fig11-{alpha:g}"
            pictures[name] = slices_by_bounce(f"symmetric grooves, GGX, α {alpha:g}", measured, model, thetas)
    return Section(
        "The BRDF by bounces (Fig. 11)",
        f"GGX, F = 1, incidence {', '.join(f'{t:g}' for t in thetas)}°. All cells of the hemisphere but those that "
        f"reach within {POLE:g}° of the mirror direction, where f has a pole. At least {ENOUGH:g} paths per direction.",
        findings,
        figures=pictures,
    )


def slices_by_bounce(title: str, measured: Measurement, model: np.ndarray, thetas: tuple[float, ...]) -> Any:
    """The plane of incidence: bars are traced, lines are the model's."""
    sensor = measured.sensor
    assert isinstance(sensor, Hemisphere)
    figure, grid = figures.panels(len(thetas), 4, "θₒ [°], negative towards the light", "f cos θₒ [1/sr]", title)
    forth, back = sensor.columns // 2, 0
    cells = np.concatenate(
        [np.arange(sensor.rows)[::-1] * sensor.columns + back, np.arange(sensor.rows) * sensor.columns + forth]
    )
    edges = np.degrees(np.arccos(1 - np.arange(sensor.rows + 1) / sensor.rows))
    edges = np.concatenate([-edges[::-1], edges[1:]])
    for row, theta in enumerate(thetas):
        for n in range(4):
            axes = grid[row, n]
            axes.stairs(measured.values.value[row, n, cells, 0], edges, fill=True, color="tab:green", alpha=0.5)
            axes.stairs(model[row, n, cells], edges, baseline=None, color="tab:red", linewidth=0.9)
            axes.set_title(f"θᵢ {theta:g}°, {n + 1} bounce{'s' if n else ''}{'+' if n == 3 else ''}", fontsize=8)
    return figure


def nonsymmetric(effort: Effort) -> Section:
    """Non-symmetric grooves, other distributions and anisotropy, which the paper shows in its supplement."""
    findings = []
    for name, description in OTHERS.items():
        measured = shoot(description, [(20.0, 40.0), (60.0, 250.0)], effort.at_least(ENOUGH), apart=3)
        tolerance = QUADRATURE if description.get("symmetric") is False else FLOAT32
        tolerance += 2e-3 * ("material" in description)  # the closed product of reflectances (`fresnel`)
        findings += compared(name, measured, by_bounce(description, measured, 3), tolerance)
    return Section(
        "Other distributions, anisotropy, independent facets",
        f"Incidence (20°, 40°) and (60°, 250°). At least {ENOUGH:g} paths per direction.",
        findings,
    )


def bounces() -> Section:
    """Table 2: how many bounces there are."""
    rows, same = [], 0
    for name, published in TABLE_2.items():
        for share, entries in zip((0.1, 0.05, 0.01), published):
            found = [needed_bounces(DISTRIBUTIONS[name], alpha, share) for alpha in (0.5, 0.7, 1.0)]
            same += sum(a == b for a, b in zip(found, entries))
            rows.append((name, f"{1 - share:.0%}", " ".join(map(str, found)), " ".join(map(str, entries))))
    return Section(
        "Maximum number of bounces (Table 2)",
        "α 0.5, 0.7 and 1: the aperture of the groove at that percentile of the slopes.",
        [Finding("all 27 entries", f"{same} are the paper's", "27", same == 27)],
        [Table(("distribution", "percentile", "here", "paper"), rows)],
    )


def furnace(effort: Effort) -> Section:
    """Fig. 12: energy, with one bounce and with all."""
    thetas, rows, truths, found = (0.0, 30.0, 60.0, 80.0), [], [], []
    worst, fine = 0.0, Hemisphere(128, 256)
    for distribution in DISTRIBUTIONS:
        for symmetric in (True, False):
            for alpha in (0.3, 0.5, 1.0):
                description = grooves(alpha, distribution=distribution, symmetric=symmetric)
                measured = shoot(description, [(theta, 0.0) for theta in thetas], effort, apart=2)
                truths.append(Estimate(*(part[:, 0, 0] for part in measured.albedo)))
                bsdf = evaluate.load(description | {"max_bounces": 1})
                # Integrated, not sampled: one bounce has no pole, and independent facets are sampled by hashed numbers.
                cells = (evaluate.cell_means(bsdf, wi, fine.directions(wi, 4))[0] for wi in measured.wi)
                single = [float(values.sum() * fine.solid_angle) for values in cells]
                every = evaluate.albedo(evaluate.load(description), measured.wi)[0]
                found.append(single)
                worst = max(worst, 1 - min(every))
                kind = "symmetric" if symmetric else "non-symmetric"
                rows.append(
                    (
                        distribution,
                        kind,
                        alpha,
                        *(" ".join(f"{x:.3f}" for x in e) for e in (truths[-1].value, single, every)),
                    )
                )
    bound = LOST + 4 * np.sqrt(LOST / 2**18)  # the default's rule, and four standard errors of that many samples
    return Section(
        "White furnace (Fig. 12)",
        "F = 1; directional albedo at 0, 30, 60 and 80°: of one bounce, traced and modelled, and of all. What is "
        "missing from 1 took more bounces than the default, which 0.1 % of the facets may need.",
        [
            agreement(
                "albedo of one bounce", Estimate(*np.stack(truths, axis=1)), np.array(found), effort.tiles, FLOAT32
            ),
            Finding("energy of all bounces", f"{worst:.3%} missing at most", f"{bound:.3%}", bool(worst <= bound)),
        ],
        [Table(("distribution", "grooves", "α", "one bounce, traced", "one bounce", "all"), rows)],
        {"fig12": furnace_spheres(tick=effort.tick)},
    )


def furnace_spheres(size: int = 128, spp: int = 128, tick: Callable[..., None] = lambda *_: None) -> Any:
    """Spheres in a white furnace, GGX, alpha 0.5: what is seen is what is lost."""
    figure, grid = figures.panels(1, 4, "", "", "white furnace, GGX, α 0.5")
    cases: dict[str, dict[str, Any]] = {
        "symmetric, one bounce (Cook-Torrance)": {"max_bounces": 1},
        "symmetric, all": {},
        "non-symmetric, one bounce": {"symmetric": False, "max_bounces": 1},
        "non-symmetric, all": {"symmetric": False},
    }
    for axes, (name, changes) in zip(grid[0], cases.items()):
        tick()
        scene = {
            "type": "scene",
            "integrator": {"type": "path"},
            "light": {"type": "constant"},
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": size, "height": size},
            },
            "sphere": {"type": "sphere", "bsdf": grooves(0.5) | changes},
        }
        image = mi.render(mi.load_dict(scene, parallel=False), spp=spp)
        axes.imshow(np.array(image)[..., 0], cmap="gray", vmin=0, vmax=1.25)
        axes.set_title(name, fontsize=8)
        axes.set_axis_off()
    return figure


SECTIONS: dict[str, Callable[[Effort], Section]] = {
    "kaleidoscope": lambda effort: kaleidoscope(tick=effort.tick),
    "bounces": brdf_by_bounce,
    "nonsymmetric": nonsymmetric,
    "number": lambda effort: bounces(),
    "furnace": furnace,
}
"""The report, section by section, in its order."""
