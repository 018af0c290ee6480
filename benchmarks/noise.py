"""Variance times time of ways to sample a model: `python benchmarks/noise.py [--plastic | --diffracting]`.

Relative variance of the albedo, times the seconds of a *preview* frame with that sampler at the same parameters. Of the
mirror grains, against sampling the NDF (Lucas 2024, Eq. 13 to 15). With ``--plastic``, of interfaced facets, against
the published scheme (Meneveaux et al. 2018, Sec. 4.1) and against Mitsuba's `roughplastic`, whose albedo is another.
Products below 1 are better. With ``--diffracting``, deviations of `twoscale`: of its mixture, of visible normals alone,
and of the cosine.
"""

from __future__ import annotations

import argparse
import itertools

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
from baselines import register
from rich.console import Console
from rich.table import Table

from asperity.lab.bench.timing import finish, medians
from asperity.scenes.preview import preview

SETS = {  # (tau_0, beta_x, beta_y): elevations in degrees; the table of the model's notes, section 6
    (0.10, 0.3, 0.3): (75, 89),
    (0.37, 1.0, 1.0): (45, 85, 89),
    (0.50, 0.1, 0.1): (45, 85, 89),
    (0.62, 0.8, 1.7): (5, 75, 89),
    (0.20, 2.5, 0.6): (75, 85),
    (0.90, 0.5, 0.5): (5, 45, 85),
}
SAMPLERS = {"NDF": "micrograin_ndf", "GGX visible": "micrograin_ggx", "exact": "micrograin"}
PLASTICS = {"ours": "interfacedlambertian", "published": "interfacedlambertian_published"}
MASKINGS = {"Smith": {}, "V-cavities": {"masking": "vcavity"}}
ALPHAS, BODIES, VIEWS = (0.1, 0.3, 0.6, 1.0), (1.0, 0.5), (10, 60, 85)
TWO_SCALES = ((0.1, 0.7, 0.05, 1.2), (0.3, 1.0, 0.08, 0.5), (0.05, 3.0, 0.05, 2.0), (0.1, 1.0, 0.05, 20.0))
"""alpha, p, sigma_s and b."""
N = 1 << 21


def incident(theta: float) -> tuple[mi.SurfaceInteraction3f, mi.Float, mi.Point2f]:
    """Light at this angle, and random numbers."""
    rng, theta = mi.PCG32(size=N), np.radians(theta)
    si = dr.zeros(mi.SurfaceInteraction3f, N)
    si.wi = mi.Vector3f(float(np.sin(theta) * np.cos(0.3)), float(np.sin(theta) * np.sin(0.3)), float(np.cos(theta)))
    return si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())


def variance_of(weight: mi.Float) -> float:
    weight = np.asarray(weight, dtype=float)
    return weight.var() / weight.mean() ** 2


def relative_variance(bsdf: mi.BSDF, theta: float) -> float:
    return variance_of(bsdf.sample(mi.BSDFContext(), *incident(theta))[1].x)


def frame_seconds(materials: dict) -> dict:
    """Of a *preview* frame with each material."""
    scenes = {
        name: mi.load_dict(preview(material, size=(192, 192), spp=36), parallel=False)
        for name, material in materials.items()
    }
    return medians({name: lambda scene=scene: finish(mi.render(scene)) for name, scene in scenes.items()}, 7)


def grains() -> Table:
    table = Table(
        "tau_0, beta_x, beta_y", "degrees", *(f"{name}: variance" for name in SAMPLERS), "GGX x time", "exact x time"
    )
    for (tau_0, beta_x, beta_y), elevations in SETS.items():
        given = {"tau_0": tau_0, "beta_x": beta_x, "beta_y": beta_y}
        materials = {name: {"type": plugin, **given} for name, plugin in SAMPLERS.items()}
        seconds, bsdfs = frame_seconds(materials), {name: mi.load_dict(one) for name, one in materials.items()}
        for theta in elevations:
            variance = {name: relative_variance(bsdf, theta) for name, bsdf in bsdfs.items()}
            product = {name: variance[name] * seconds[name] for name in SAMPLERS}
            table.add_row(
                f"{tau_0}, {beta_x}, {beta_y}",
                str(theta),
                *(f"{v:.3g}" for v in variance.values()),
                *(f"{product[name] / product['NDF']:.3g}" for name in ("GGX visible", "exact")),
            )
    return table


def plastic() -> Table:
    columns = [f"{masking}, {name}" for masking in MASKINGS for name in PLASTICS] + ["roughplastic"]
    products = [f"{masking} x time, over {of}" for masking in MASKINGS for of in ("published", "roughplastic")]
    table, frames = Table("alpha", "body", "degrees", *(f"{name}: deviation" for name in columns), *products), []
    for alpha, body in itertools.product(ALPHAS, BODIES):
        given = {"alpha": alpha, "diffuse_reflectance": body}
        kinds = [{"type": plugin, **masking} for masking in MASKINGS.values() for plugin in PLASTICS.values()]
        materials = {name: {**kind, **given} for name, kind in zip(columns, [*kinds, {"type": "roughplastic"}])}
        seconds, bsdfs = frame_seconds(materials), {name: mi.load_dict(one) for name, one in materials.items()}
        frames.append([seconds[name] / seconds["roughplastic"] for name in columns])
        for theta in VIEWS:
            variance = {name: relative_variance(bsdf, theta) for name, bsdf in bsdfs.items()}
            product = {name: variance[name] * seconds[name] for name in columns}
            ratios = [
                product[f"{masking}, ours"] / product[other]
                for masking in MASKINGS
                for other in (f"{masking}, published", "roughplastic")
            ]
            numbers = *(v**0.5 for v in variance.values()), *ratios
            table.add_row(str(alpha), str(body), str(theta), *(f"{number:.2g}" for number in numbers))
    times = zip(columns, np.median(frames, axis=0))
    table.caption = "Frame over roughplastic's: " + ", ".join(f"{name} {time:.2f}" for name, time in times)
    return table


def diffracting() -> Table:
    table = Table("alpha, p, sigma_s, b", "degrees", "mixture", "visible normals", "cosine")
    for alpha, p, sigma_s, b in TWO_SCALES:
        bsdf = mi.load_dict({"type": "twoscale", "alpha": alpha, "p": p, "sigma_s": sigma_s, "b": b})
        for theta in VIEWS:
            si, u, v = incident(theta)
            mirrored = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), 0)
            facet, cosine = bsdf.sample(mirrored, si, u, v)[0], mi.warp.square_to_cosine_hemisphere(v)
            whole = [bsdf.eval(mi.BSDFContext(), si, wo).x for wo in (facet.wo, cosine)]
            alone = dr.select(facet.pdf > 0, whole[0] / facet.pdf, 0), whole[1] * dr.pi / cosine.z
            found = relative_variance(bsdf, theta), *map(variance_of, alone)
            table.add_row(f"{alpha}, {p}, {sigma_s}, {b}", str(theta), *(f"{v**0.5:.2g}" for v in found))
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plastic", action="store_true", help="interfaced ones, against `roughplastic`")
    parser.add_argument("--diffracting", action="store_true", help="`twoscale`")
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    register()
    asked = parser.parse_args()
    Console(width=130).print(plastic() if asked.plastic else diffracting() if asked.diffracting else grains())


if __name__ == "__main__":
    main()
