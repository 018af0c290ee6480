"""Speed against Mitsuba's own `roughconductor` (GGX), in one process: `python benchmarks/speed.py [--quick]`.

Ratios of the medians of interleaved runs; two noisy cores leave some 2 % of doubt. Three scenes: *bare* (a sphere on a
plane, constant light and a point light: little tracing, so the BSDF is much of the frame), *preview* (the default
object of `asperity render` under an environment map: what a user feels), and *filled* (the same, the floor of the same
material, so that the BSDF is most of the frame).
"""

from __future__ import annotations

import argparse
import time

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
from baselines import register
from rich.console import Console
from rich.table import Table

from asperity.scenes.preview import preview

GRAINS = {"material": "Au", "tau_0": 0.4, "beta": 0.5}
MATERIALS = {
    "roughconductor, GGX": {"type": "roughconductor", "material": "Au", "alpha": 0.3, "distribution": "ggx"},
    "height masking, NDF sampling": {"type": "micrograin_ndf", "masking": "height", **GRAINS},
    "correlated, NDF sampling": {"type": "micrograin_ndf", **GRAINS},
    "correlated, GGX visible normals": {"type": "micrograin_ggx", **GRAINS},
    "micrograin (exact visible normals)": {"type": "micrograin", **GRAINS},
    "micrograin on a diffuse base": {"type": "micrograin", **GRAINS, "base": {"type": "diffuse"}},
    "micrograin, scattering: multiple": {"type": "micrograin", **GRAINS, "scattering": "multiple"},
    "micrograin, diffuse grains": {"type": "micrograin", "tau_0": 0.4, "beta": 0.5, "specular": False},
    "micrograin, coated grains": {"type": "micrograin", "tau_0": 0.4, "beta": 0.5, "int_ior": 1.5},
}
GROOVES = {"type": "vgroove", "material": "Au"}
MATERIALS |= {f"vgroove, alpha {alpha:g}": {**GROOVES, "alpha": alpha} for alpha in (0.1, 0.3, 1.0)}
MATERIALS["vgroove, alpha 0.3, non-symmetric"] = {**GROOVES, "alpha": 0.3, "symmetric": False}
MATTE = {"diffuse": {"type": "diffuse"}}
MATTE |= {
    f"{name}, {variant}": {"type": name, "variant": variant}
    for name, variants in {
        "lambertsphere": ("accurate", "published", "fast"),
        "orennayar": ("full", "qualitative"),
    }.items()
    for variant in variants
}
MATTE["chandrasekhar"] = {"type": "chandrasekhar"}
FACETS = {"type": "interfacedlambertian", "distribution": "ggx", "alpha": 0.3}
CHECKED = {"type": "checkerboard", "color0": 0.1, "color1": 0.6}
PLASTIC = {
    "roughplastic, GGX": {"type": "roughplastic", "distribution": "ggx", "alpha": 0.3},
    "interfacedlambertian": FACETS,
    "interfacedlambertian, Beckmann": {**FACETS, "distribution": "beckmann"},
    "interfacedlambertian, V-cavities": {**FACETS, "masking": "vcavity"},
    "interfacedlambertian, textured alpha": {**FACETS, "alpha": CHECKED},
    "interfacedlambertian, anisotropic": {
        "type": FACETS["type"],
        "distribution": "ggx",
        "alpha_u": 0.3,
        "alpha_v": 0.31,
    },
    "interfacedlambertian, approximate": {**FACETS, "approximate": True},
}
TWO_SCALES = {"type": "twoscale", "material": "Au", "alpha": 0.1, "p": 0.7}
DIFFRACTING = {
    # of equal rms slope: alpha sqrt(Gamma(2 / p) / Gamma(1 / p))
    "roughconductor, Beckmann": {"type": "roughconductor", "material": "Au", "alpha": 0.142},
    "twoscale": TWO_SCALES,
    "twoscale, conserving": {**TWO_SCALES, "energy": "conserving"},
    "twoscale, anisotropic": {"type": "twoscale", "material": "Au", "p": 0.7, "alpha_u": 0.14, "alpha_v": 0.07},
}
LANES = 1 << 21


def bare(material, size: int, spp: int) -> dict:
    look_at = mi.ScalarTransform4f().look_at
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 6},
        "sensor": {
            "type": "perspective",
            "fov": 35,
            "to_world": look_at([0, -6, 3], [0, 0, 0.6], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": spp},
        },
        "constant": {"type": "constant", "radiance": 0.5},
        "point": {"type": "point", "position": [3, -3, 5], "intensity": 30.0},
        "plane": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(8), "bsdf": {"type": "ref", "id": "m"}},
        "sphere": {"type": "sphere", "center": [0, 0, 1], "bsdf": {"type": "ref", "id": "m"}},
        "m": {**material, "id": "m"},
    }


def filled(material, size: int, spp: int) -> dict:
    scene = preview(material, size=(size, size), spp=spp, integrator={"type": "path", "max_depth": 6})
    return scene | {"ground": scene["ground"] | {"bsdf": material}}


def scenes(size: int, spp: int) -> dict:
    return {
        "bare": lambda material: bare(material, size, 4 * spp),
        "preview": lambda material: preview(material, size=(size, size), spp=spp),
        "filled": lambda material: filled(material, size, spp),
    }


def finish(result) -> None:
    dr.eval(result)
    dr.sync_thread()


def medians(tasks: dict, rounds: int) -> dict[str, float]:
    """Median seconds of each task, the tasks taking turns so that all meet the same noise."""
    seconds = {name: [] for name in tasks}
    for task in tasks.values():
        task()  # compiles
    for turn in range(rounds):
        for name, task in list(tasks.items())[:: 1 if turn % 2 else -1]:
            start = time.perf_counter()
            task()
            seconds[name].append(time.perf_counter() - start)
    return {name: float(np.median(times)) for name, times in seconds.items()}


def frames(make, rounds: int) -> dict[str, float]:
    def task(material):
        scene, seed = mi.load_dict(make(material), parallel=False), iter(range(1 << 20))
        return lambda: finish(mi.render(scene, seed=next(seed)))

    return medians({name: task(material) for name, material in MATERIALS.items()}, rounds)


def calls(method: str, rounds: int) -> dict[str, float]:
    """Nanoseconds a lane of one call on random directions."""
    rng = mi.PCG32(size=LANES)
    wi, wo = (mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32())) for _ in range(2))
    u = rng.next_float32()
    dr.eval(wi, wo, u)
    si = dr.zeros(mi.SurfaceInteraction3f, LANES)
    si.wi = wi

    def task(material):
        bsdf, ctx = mi.load_dict(material), mi.BSDFContext()
        if method == "eval_pdf":
            return lambda: finish(bsdf.eval_pdf(ctx, si, wo))
        return lambda: finish(bsdf.sample(ctx, si, u, mi.Point2f(wo.x * 0.5 + 0.5, wo.y * 0.5 + 0.5)))

    tasks = {name: task(material) for name, material in MATERIALS.items()}
    return {name: seconds / LANES * 1e9 for name, seconds in medians(tasks, rounds).items()}


def updates(count: int) -> tuple[int, int]:
    """Megabytes of resident memory after 100 and after ``count`` updates with a render after each."""

    def resident() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096 >> 20

    scene = mi.load_dict(
        preview({"type": "micrograin", **GRAINS, "base": {"type": "diffuse"}}, size=(32, 32), spp=4), parallel=False
    )
    params, early = mi.traverse(scene), 0
    for step in range(count):
        params["object.bsdf.tau_0.value"] = 0.1 + 0.8 * step / count
        params.update()
        dr.eval(mi.render(scene, params, seed=step))
        if step == 100:
            early = resident()
    return early, resident()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few, small frames")
    parser.add_argument("--only", help="part of a material's name")
    parser.add_argument("--matte", action="store_true", help="matte materials, against `diffuse`")
    parser.add_argument("--plastic", action="store_true", help="interfaced ones, against `roughplastic`")
    parser.add_argument("--diffracting", action="store_true", help="`twoscale`, against facets of equal rms slope")
    quick, only = (args := parser.parse_args()).quick, args.only
    for asked, materials in ((args.matte, MATTE), (args.plastic, PLASTIC), (args.diffracting, DIFFRACTING)):
        if asked:
            MATERIALS.clear()
            MATERIALS.update(materials)
    reference = next(iter(MATERIALS))
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    register()
    if only:
        for name in [name for name in MATERIALS if name != reference and only not in name]:
            del MATERIALS[name]
    size, spp, rounds = (128, 16, 5) if quick else (256, 32, 11)
    columns = {name: frames(make, rounds) for name, make in scenes(size, spp).items()}
    columns |= {f"{method}, ns": calls(method, rounds) for method in ("eval_pdf", "sample")}
    table = Table("", *columns, title=f"ratio to {reference} (and time)")
    for name in MATERIALS:
        cells = (
            f"{times[name] / times[reference]:.2f}  ({times[name] if 'ns' in column else times[name] * 1e3:.3g})"
            for column, times in columns.items()
        )
        table.add_row(name, *cells)
    Console(width=130).print(table)
    early, late = updates(200 if quick else 500)
    print(f"memory: {early} MB after 100 updates with a render after each, {late} MB after the last")


if __name__ == "__main__":
    main()
