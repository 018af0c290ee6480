"""Speed against Mitsuba's own plugins, in one process: `python benchmarks/speed.py [--quick] [--json docs/speed.json]`.

Every material is compared with what a user would take instead, which is the first of its group. Frames are of three
scenes: *bare* (a sphere on a plane, constant light and a point light: little tracing, so the BSDF is much of the
frame), *preview* (the default object of `asperity render` under an environment map: what a user feels), and *filled*
(the same, the floor of the same material, so that the BSDF is most of the frame). Calls are of random directions.

The materials of a group take turns, so that all meet the same noise. Of all rounds the median counts, of times and of
their ratios to the reference's in the same round; the spread is half the distance of the quartiles.
`python docs/build.py` makes the tables of the documentation from the JSON.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
from baselines import register
from rich.console import Console
from rich.table import Table

from asperity import llvm
from asperity.files import atomically
from asperity.scenes.preview import preview

GRAINS = {"material": "Au", "tau_0": 0.4, "beta": 0.5}
MATERIALS = {
    "roughconductor, GGX": {"type": "roughconductor", "material": "Au", "alpha": 0.3, "distribution": "ggx"},
    "micrograin, NDF sampling, masking: height": {"type": "micrograin_ndf", "masking": "height", **GRAINS},
    "micrograin, NDF sampling": {"type": "micrograin_ndf", **GRAINS},
    "micrograin, GGX visible normals": {"type": "micrograin_ggx", **GRAINS},
    "micrograin, exact visible normals": {"type": "micrograin", **GRAINS},
    "micrograin, on a diffuse base": {"type": "micrograin", **GRAINS, "base": {"type": "diffuse"}},
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
COLOUR = {"type": "rgb", "value": [0.58, 0.25, 0.14]}
MATTE["lambertsphere, accurate, coloured"] = {"type": "lambertsphere", "reflectance": COLOUR}
MATTE["chandrasekhar"] = {"type": "chandrasekhar"}
FACETS = {"type": "interfacedlambertian", "distribution": "ggx", "alpha": 0.3}
CHECKED = {"type": "checkerboard", "color0": 0.1, "color1": 0.6}
PLASTIC = {
    "roughplastic, GGX": {"type": "roughplastic", "distribution": "ggx", "alpha": 0.3},
    "interfacedlambertian, GGX": FACETS,
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
FULL = {"size": 160, "spp": 16, "rounds": 7, "lanes": 1 << 21}
QUICK = {"size": 96, "spp": 8, "rounds": 3, "lanes": 1 << 19}
EXTRA = {
    *(f"micrograin, {name}" for name in ("NDF sampling, masking: height", "NDF sampling", "GGX visible normals")),
    *("micrograin, on a diffuse base", "vgroove, alpha 0.1", "lambertsphere, published", "lambertsphere, fast"),
    *("orennayar, qualitative", "twoscale, conserving", "twoscale, anisotropic"),
    *(f"interfacedlambertian, {name}" for name in ("Beckmann", "textured alpha", "approximate")),
}
"""Left out if there is little time: compiling takes most of it."""
GROUPS = (MATERIALS, MATTE, PLASTIC, DIFFRACTING)


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


def turns(tasks: dict, rounds: int) -> dict[str, np.ndarray]:
    """Seconds of each task in each round; the tasks take turns, back and forth."""
    for task in tasks.values():
        task()  # compiles
    seconds: dict[str, list] = {name: [] for name in tasks}
    for turn in range(rounds):
        for name, task in list(tasks.items())[:: 1 if turn % 2 else -1]:
            start = time.perf_counter()
            task()
            seconds[name].append(time.perf_counter() - start)
    return {name: np.array(times) for name, times in seconds.items()}


def medians(tasks: dict, rounds: int) -> dict[str, float]:
    """Median seconds of each task."""
    return {name: float(np.median(times)) for name, times in turns(tasks, rounds).items()}


def frame(description: dict):
    """What renders it once more, with other random numbers."""
    scene, seed = mi.load_dict(description, parallel=False), iter(range(1 << 20))
    return lambda: finish(mi.render(scene, seed=next(seed)))


def calls(materials: dict, lanes: int) -> dict[str, dict]:
    """For ``eval_pdf`` and ``sample``, what calls it at so many random directions, for each material."""
    rng, ctx = mi.PCG32(size=lanes), mi.BSDFContext()
    wi, wo = (mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32())) for _ in range(2))
    u, v = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    dr.eval(wi, wo, u, v)
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = wi
    bsdfs = {name: mi.load_dict(material) for name, material in materials.items()}
    return {
        "eval_pdf": {name: lambda b=bsdf: finish(b.eval_pdf(ctx, si, wo)) for name, bsdf in bsdfs.items()},
        "sample": {name: lambda b=bsdf: finish(b.sample(ctx, si, u, v)) for name, bsdf in bsdfs.items()},
    }


def quartiles(values: np.ndarray) -> list[float]:
    return [float(f"{x:.4g}") for x in np.percentile(values, (25, 50, 75))]


def compared(materials: dict, size: int, spp: int, rounds: int, lanes: int) -> dict[str, dict]:
    """By material and column, the quartiles of its time (in seconds; of calls in ns for each lane) and of its ratio."""
    reference = next(iter(materials))
    columns = calls(materials, lanes)
    for scene, make in scenes(size, spp).items():
        columns[scene] = {name: frame(make(material)) for name, material in materials.items()}
    rows: dict[str, dict] = {name: {"against": reference} for name in materials}
    for column, tasks in columns.items():
        print(f"{time.process_time():6.0f} s of CPU; now {column} against {reference}", file=sys.stderr)
        unit = 1e9 / lanes if column in ("eval_pdf", "sample") else 1
        found = turns(tasks, rounds)
        for name, seconds in found.items():
            ratio = quartiles(seconds / found[reference])
            rows[name][column] = {"time": quartiles(seconds * unit), "ratio": ratio}
    return rows


def circumstances() -> dict:
    """Of which code, on which machine."""

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], cwd=Path(__file__).parent, capture_output=True, text=True, check=False
        ).stdout.strip()

    with open("/proc/cpuinfo") as file:
        model = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "")
    return {
        "commit": git("rev-parse", "--short", "HEAD") + ("+" if git("status", "--porcelain", "-uno") else ""),
        "machine": model or platform.processor(),
        "threads": dr.thread_count(),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        "mitsuba": mi.__version__,
        "drjit": dr.__version__,
        "llvm": ".".join(map(str, llvm.loaded_version() or ())),
    }


def table(rows: dict[str, dict]) -> Table:
    """The rows of one group."""
    reference = next(iter(rows))
    columns = [column for column in rows[reference] if column != "against"]
    found = Table("", *columns, title=f"ratio to {reference}, spread, and ns or ms")
    for name, row in rows.items():
        cells = ((column in ("eval_pdf", "sample"), row[column]["ratio"], row[column]["time"][1]) for column in columns)
        found.add_row(
            name,
            *(f"{r:.2f} ± {(c - a) / 2:.2f} ({t if ns else t * 1e3:.3g})" for ns, (a, r, c), t in cells),
        )
    return found


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small frames of what matters: three minutes in all")
    parser.add_argument("--only", default="", help="part of the materials' names")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers")
    parser.add_argument("--memory", action="store_true", help="instead, what updates leave in memory")
    asked, start = parser.parse_args(), time.perf_counter()
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    register()
    if asked.memory:
        early, late = updates(200 if asked.quick else 500)
        print(f"{early} MB after 100 updates with a render after each, {late} MB after the last")
        return
    effort = QUICK if asked.quick else FULL
    report = circumstances() | effort | {"rows": {}}
    for group in GROUPS:
        reference, *others = group
        chosen = [name for name in others if asked.only in name and not (asked.quick and name in EXTRA)]
        if not chosen:
            continue
        rows = compared({name: group[name] for name in (reference, *chosen)}, **effort)
        Console(width=150).print(table(rows))
        report["rows"] |= rows
        if asked.json:  # after each group: a long run may end early
            with atomically(asked.json) as part:
                part.write_text(json.dumps(report, indent=1) + "\n")
    print(f"{time.perf_counter() - start:.0f} s in all")


if __name__ == "__main__":
    main()
