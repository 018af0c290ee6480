"""Noise of the V-groove model, like Fig. 13 of Lee et al. 2018: `python benchmarks/convergence.py`.

First table: relative variance of the albedo of mirror facets, sampled as the paper's Section 6 does (a facet by D cos,
then a number of bounces by its share G_k) and as `vgroove` does. Second: whole frames of the *preview* scene, gold,
against Mitsuba's `roughconductor`, which scatters once: relative variance of a pixel at one sample, and times seconds.
"""

from __future__ import annotations

import asperity  # noqa: F401  isort: skip
import time

import drjit as dr
import mitsuba as mi
import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.lab import evaluate
from asperity.microfacet.distributions import DISTRIBUTIONS
from asperity.models.vgroove.kaleidoscope import Groove, leaving_share
from asperity.scenes.preview import preview

N, BOUNCES = 2**20, 60
SETS = (("ggx", 0.2, 75), ("ggx", 0.7, 45), ("ggx", 0.7, 75), ("ggx", 0.7, 85), ("beckmann", 0.7, 75), ("ggx", 1.0, 85))
ALPHAS, SEEDS, SPP, SIZE = (0.1, 0.3, 0.5, 1.0), 12, 16, 192


def published(distribution: str, alpha: float, theta: float) -> list[np.ndarray]:
    """Weights of mirror facets, for which it leaves no trace which k is chosen: the paper's, and its authors' code's.

    The paper takes k with probability G_k, and |i.s| / (cos_i cos_s) if there is one; the code takes it by its share
    G_k / sum G, and the sum into the weight.
    """
    u, azimuth = evaluate.variates(N, 1)
    sin, cos = DISTRIBUTIONS[distribution].sample_tilt(mi.Float(alpha), u)
    tilt, i = dr.maximum(dr.atan2(sin, cos), 1e-4), evaluate.direction(theta, 0)
    across = i.x * dr.cos(2 * dr.pi * azimuth.x)
    psi, length = dr.atan2(across, i.z), dr.sqrt(across * across + i.z * i.z)
    groove = Groove(tilt, tilt)
    leaves = sum(leaving_share(groove, psi, k) for k in range(1, BOUNCES + 1))
    facing = dr.maximum(length * dr.cos(psi - tilt), 0) / (i.z * cos)
    weights = dr.select(azimuth.y < leaves, facing, 0), facing * leaves
    return [np.array(weight, dtype=float) for weight in weights]


def ours(distribution: str, alpha: float, theta: float) -> np.ndarray:
    """Weights of the model."""
    bsdf = evaluate.load({"type": "vgroove", "distribution": distribution, "alpha": alpha, "max_bounces": BOUNCES})
    _, weight = evaluate.sample(bsdf, evaluate.direction(theta, 20), *evaluate.variates(N, 2))
    return evaluate.to_numpy(weight, N)[0]


def frames(material: dict) -> tuple[float, float]:
    """(relative variance of a pixel for one sample, seconds of a frame)."""
    scene = mi.load_dict(preview(material, size=(SIZE, SIZE), spp=SPP), parallel=False)
    images, seconds = [], []
    for seed in range(SEEDS):
        start = time.perf_counter()
        images.append(np.array(mi.render(scene, seed=seed, spp=SPP))[..., :3])
        seconds.append(time.perf_counter() - start)
    stack = np.stack(images)
    variance = np.median(stack.var(axis=0, ddof=1)) * SPP  # the median: few pixels hold fireflies of the scene's own
    return float(variance / np.median(stack.mean(axis=0)) ** 2), float(np.median(seconds[1:]))


def main() -> None:
    """Print both tables."""
    mi.set_variant("llvm_ad_rgb")
    console = Console(width=130)
    names = ("paper", "authors' code", "vgroove")
    table = Table("distribution", "alpha", "degrees", *(f"{name}: mean, variance, largest" for name in names))
    for distribution, alpha, theta in SETS:
        every = [*published(distribution, alpha, theta), ours(distribution, alpha, theta)]
        numbers = (f"{w.mean():.4f}  {w.var() / w.mean() ** 2:.3g}  {w.max():.3g}" for w in every)
        table.add_row(distribution, f"{alpha:g}", f"{theta}", *numbers)
    console.print(table)

    table = Table("alpha", "variance, roughconductor", "vgroove", "non-symmetric", "x seconds: ratio", "non-symmetric")
    for alpha in ALPHAS:
        gold = {"material": "Au", "alpha": alpha}
        single = frames({"type": "roughconductor", "distribution": "ggx"} | gold)
        found = [frames({"type": "vgroove", "symmetric": symmetric} | gold) for symmetric in (True, False)]
        variances = (f"{variance:.3g}" for variance, _ in (single, *found))
        ratios = (f"{variance * seconds / (single[0] * single[1]):.2f}" for variance, seconds in found)
        table.add_row(f"{alpha:g}", *variances, *ratios)
    console.print(table)


if __name__ == "__main__":
    main()
