"""Speed of the virtual goniophotometer beside Mitsuba's own rate of rays, and its growth with the number of grains.

python benchmarks/goniophotometer.py [--quick]
"""

import asperity  # noqa: F401  isort: skip  (before Mitsuba)
import argparse
import time

import drjit as dr
import mitsuba as mi
import numpy as np

from asperity.goniophotometer import Hemisphere
from asperity.goniophotometer.sensors import directions
from asperity.goniophotometer.tile import opaque
from asperity.goniophotometer.tracer import UNIT, Settings, generator, trace
from asperity.models.micrograin import ExplicitGrains

PATHS, ORDERS, THETA = 2**20, 64, 60.0
WHITE = {"type": "diffuse", "reflectance": 1.0}


def timed(run, repeats):
    """Best time in seconds; the first run compiles."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def paths(tile, orders, repeats):
    """(paths/s, rays/s): a path that is scattered k times takes k + 1 rays, and those that cross the tile's sides."""
    wi, settings = directions([(THETA, 20.0)])[0], Settings(10_000 if orders > 1 else 1, ORDERS)
    energy = trace(tile, Hemisphere(), wi, settings, np.random.SeedSequence(1), PATHS)[..., 0].sum(axis=1) * UNIT
    rays = (energy * np.arange(2, ORDERS + 2)).sum()
    seconds = timed(lambda: trace(tile, Hemisphere(), wi, settings, np.random.SeedSequence(1), PATHS), repeats)
    return PATHS / seconds, rays / seconds


def intersections(tile, repeats):
    """Mitsuba's rays/s: those by which paths enter, as the instrument orders them, hitting `tile.scene`."""
    box = tile.rays()

    def run():
        rng, corner = generator(np.random.SeedSequence(1), PATHS)
        o, d = box.enter(rng, corner, PATHS), -opaque(mi.Vector3f, *directions([(THETA, 20.0)])[0])
        dr.eval(dr.sum(tile.scene.ray_intersect(mi.Ray3f(o, d)).n.z))
        dr.sync_thread()

    return PATHS / timed(run, repeats)


def meshed(geometry, seed, rings=6, sectors=16):
    """The same tile as a mesh: each grain of 192 triangles."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi / 2, rings + 1), np.arange(sectors) * 2 * np.pi / sectors, indexing="ij"
    )
    grain = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings) * sectors, np.arange(sectors), indexing="ij"))
    a, b = i + j, i + (j + 1) % sectors
    faces = np.concatenate([np.c_[a, a + sectors, b + sectors], np.c_[a, b + sectors, b]])
    centres = geometry.centres(np.random.default_rng(seed))
    vertices = (np.c_[centres, np.zeros(len(centres))][:, None] + grain).reshape(-1, 3)
    faces = (np.arange(len(centres))[:, None, None] * len(grain) + faces).reshape(-1, 3)
    mesh = mi.Mesh("grains", len(vertices), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"], parameters["faces"] = np.float32(vertices).ravel(), np.uint32(faces).ravel()
    parameters.update()
    tile = geometry.piece(np.random.default_rng(seed))
    base = {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale([tile.width, tile.depth, 1])}
    return tile._replace(scene=mi.load_dict({"type": "scene", "grains": mesh, "base": base}))


def main():
    """Print both tables."""
    mi.set_variant("llvm_ad_rgb")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="up to 10^5 grains, one repetition")
    quick = parser.parse_args().quick
    repeats = 1 if quick else 5
    print(f"incidence {THETA:g} degrees, tau_0 0.5, beta 1, mirror grains on a white base, {PATHS} paths a batch")
    print("  grains  tile, s |  Mpaths/s  Mrays/s |  order 1 | Mitsuba's Mrays/s, and on a mesh")
    for grains in (10**3, 4096, 10**4, 10**5, *([] if quick else [10**6])):
        geometry = ExplicitGrains(0.5, base=WHITE, grains=grains)
        start = time.perf_counter()
        tile = geometry.piece(np.random.default_rng(1))
        built = time.perf_counter() - start
        every, rays = paths(tile, 2, repeats)
        first, _ = paths(tile, 1, repeats)
        native = intersections(tile, repeats)
        mesh = intersections(meshed(geometry, 1), repeats) if grains <= 10**5 else np.nan
        print(
            f"{grains:8d} {built:8.2f} | {every / 1e6:9.1f} {rays / 1e6:8.1f} | {first / 1e6:8.1f} | "
            f"{native / 1e6:.1f} {mesh / 1e6:.1f}"
        )


if __name__ == "__main__":
    main()
