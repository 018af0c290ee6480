"""Variance times time of three ways to sample the specular grains: `python benchmarks/noise.py`.

Relative variance of the mirror grains' albedo, times the seconds of a *preview* frame with that sampler at the same
parameters. Numbers below 1 are better than sampling the NDF (Lucas 2024, Eq. 13 to 15).
"""

from __future__ import annotations

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
from baselines import register
from rich.console import Console
from rich.table import Table
from speed import finish, medians

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
N = 1 << 21


def relative_variance(material: dict, theta: float) -> float:
    bsdf, rng = mi.load_dict(material), mi.PCG32(size=N)
    theta = np.radians(theta)
    si = dr.zeros(mi.SurfaceInteraction3f, N)
    si.wi = mi.Vector3f(float(np.sin(theta) * np.cos(0.3)), float(np.sin(theta) * np.sin(0.3)), float(np.cos(theta)))
    _, weight = bsdf.sample(
        mi.BSDFContext(), si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    )
    weight = np.asarray(weight.x, dtype=float)
    return weight.var() / weight.mean() ** 2


def main() -> None:
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    register()
    table = Table(
        "tau_0, beta_x, beta_y", "degrees", *(f"{name}: variance" for name in SAMPLERS), "GGX x time", "exact x time"
    )
    for (tau_0, beta_x, beta_y), elevations in SETS.items():
        grains = {"tau_0": tau_0, "beta_x": beta_x, "beta_y": beta_y}
        scenes = {
            name: mi.load_dict(preview({"type": plugin, **grains}, size=(192, 192), spp=36), parallel=False)
            for name, plugin in SAMPLERS.items()
        }
        seconds = medians({name: lambda scene=scene: finish(mi.render(scene)) for name, scene in scenes.items()}, 7)
        for theta in elevations:
            variance = {name: relative_variance({"type": plugin, **grains}, theta) for name, plugin in SAMPLERS.items()}
            product = {name: variance[name] * seconds[name] for name in SAMPLERS}
            table.add_row(
                f"{tau_0}, {beta_x}, {beta_y}",
                str(theta),
                *(f"{v:.3g}" for v in variance.values()),
                *(f"{product[name] / product['NDF']:.3g}" for name in ("GGX visible", "exact")),
            )
    Console(width=130).print(table)


if __name__ == "__main__":
    main()
