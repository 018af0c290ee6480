"""Errors of value and density, for 10^5 random inputs of each kind of material; or how two versions of the code differ.

    python benchmarks/accuracy.py --exact                       # against `exact.py`: some minutes
    python benchmarks/accuracy.py --save before.npz             # in one version
    python benchmarks/accuracy.py --against before.npz          # in another

Inputs cover all that is allowed. Of the pairs of directions six tenths are spread by the cosine; a tenth each is at
grazing angles, close to retro-reflection, close to the mirror direction, and in exactly degenerate positions.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
from exact import REFERENCES
from rich.console import Console
from rich.table import Table

from asperity.lab import evaluate

MATERIALS, LANES = 100, 1000  # materials of a kind, and pairs of directions for each
LEAST = 1e-3
"""Values below this are compared with this."""
METALS = ("none", "Au", "Ag", "Al", "Cu", "Cr", "W", "Hg")


def between(rng, low: float, high: float) -> float:
    """A number, its logarithm evenly spread; now and then an end."""
    return float(np.exp(np.clip(rng.uniform(np.log(low) - 0.2, np.log(high) + 0.2), np.log(low), np.log(high))))


def grooves(rng, symmetric: bool) -> dict:
    distribution = str(rng.choice(["ggx", "beckmann", "phong"]))
    most = 1.0 if distribution == "phong" else 1.5
    metal = str(rng.choice(METALS))
    found = {"type": "vgroove", "symmetric": symmetric, "distribution": distribution, "material": metal}
    names = ("alpha",) if rng.random() < 0.5 else ("alpha_u", "alpha_v")
    return found | {name: between(rng, 1e-3, most) for name in names}


def grains(rng, **kind) -> dict:
    found = {"type": "micrograin", "tau_0": float(np.clip(rng.uniform(-0.05, 1.05), 0, 1)), **kind}
    names = ("beta",) if rng.random() < 0.5 else ("beta_x", "beta_y")
    return found | {name: between(rng, 0.05, 10) for name in names}


def spheres(rng) -> dict:
    return {"type": "lambertsphere", "reflectance": colour(rng)}


def colour(rng) -> dict:
    return {"type": "rgb", "value": np.clip(rng.uniform(-0.05, 1.05, 3), 0, 1).tolist()}


KINDS = {
    "vgroove": lambda rng: grooves(rng, True),
    "vgroove, non-symmetric": lambda rng: grooves(rng, False),
    "micrograin, metal": lambda rng: grains(rng, material=str(rng.choice(METALS))),
    "micrograin, diffuse": lambda rng: grains(rng, specular=False, diffuse_reflectance=colour(rng)),
    "micrograin, coated": lambda rng: grains(rng, int_ior=rng.uniform(1.01, 2.5), ext_ior=1.0),
    "lambertsphere": spheres,
}
for variation in ("height", "normal"):
    second = {"variation": variation, "specular": False, "diffuse_reflectance_2": 0.9}
    KINDS[f"micrograin, diffuse by {variation}"] = lambda rng, kind=second: grains(rng, **kind)


def directions(rng, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions, (3, n) each: what the first lines of this file say."""
    wi, wo = hemisphere(rng, n), hemisphere(rng, n)
    tenth = n // 10
    grazing, retro, mirror, exact = (slice(k * tenth, (k + 1) * tenth) for k in range(4))
    for w in (wi, wo):
        low = rng.random(tenth) < 0.7
        cos = np.where(low, 10 ** rng.uniform(-4, -1, tenth), w[2, grazing])
        w[:2, grazing] *= np.sqrt((1 - cos**2) / np.maximum(w[0, grazing] ** 2 + w[1, grazing] ** 2, 1e-12))
        w[2, grazing] = cos
    off = rng.normal(size=(2, 3, tenth)) * 10 ** rng.uniform(-6, -1, (2, 1, tenth))
    flip = np.array([[-1], [-1], [1]])
    wo[:, retro], wo[:, mirror] = wi[:, retro] + off[0], flip * wi[:, mirror] + off[1]
    kind, w = rng.integers(0, 6, tenth), wi[:, exact]
    normal = np.broadcast_to([[0], [0], [1]], w.shape)
    along = np.stack([np.hypot(w[0], w[1]), 0 * w[0], w[2]])  # in the plane of the x axis
    other = wo[:, exact]
    coplanar = np.stack([np.hypot(other[0], other[1]) * np.sign(other[0]), 0 * w[0], other[2]])
    wi[:, exact] = np.choose(kind, [normal, w, w, along, normal, w])
    wo[:, exact] = np.choose(kind, [normal, w, flip * w, coplanar, other, normal])
    return tuple(turned_up(w / np.linalg.norm(w, axis=0)) for w in (wi, wo))


def hemisphere(rng, n: int) -> np.ndarray:
    radius, azimuth = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(1 - radius**2)])


def turned_up(w: np.ndarray) -> np.ndarray:
    return np.stack([w[0], w[1], np.maximum(np.abs(w[2]), 1e-5)]).astype(np.float32)


def inputs(kind: str, materials: int) -> Iterator[tuple[dict, np.ndarray, np.ndarray]]:
    """(material, wi, wo), the same in all versions of the code that know the same kinds."""
    rng = np.random.default_rng(sorted(KINDS).index(kind))
    for _ in range(materials):
        material = KINDS[kind](rng)
        yield material, *directions(rng, LANES)


def results(kind: str, materials: int) -> np.ndarray:
    """(materials, 4, LANES): f cos_o in red, green, blue, and the density."""
    found = []
    for material, wi, wo in inputs(kind, materials):
        context, si = mi.BSDFContext(), evaluate.interaction(mi.Vector3f(wi), LANES)
        value, pdf = mi.load_dict(material).eval_pdf(context, si, mi.Vector3f(wo))
        found.append(np.concatenate([np.array(value), np.array(pdf)[None]]))
    return np.stack(found)


def exact(kind: str, materials: int) -> np.ndarray:
    """The same by `exact.py`."""
    return np.stack([REFERENCES[given["type"]](given, wi, wo) for given, wi, wo in inputs(kind, materials)])


def row(kind: str, before: np.ndarray, after: np.ndarray, which: list[int] | None = None) -> list[str]:
    """Of all materials, or of these."""
    which = list(range(len(after))) if which is None else which
    before, after = before[which], after[which]
    cells, wrong = [], ~np.isfinite(after) & np.isfinite(before)
    for part in (slice(0, 3), slice(3, 4)):
        was, now = before[:, part], after[:, part]
        error = np.abs(now - was) / np.maximum(np.abs(was), LEAST)
        error = np.where(np.isfinite(was) & np.isfinite(now), error, 0)
        cells += [f"{np.percentile(error, q):.2g}" for q in (50, 99, 99.5, 99.9, 100)]
        material, _, lane = np.unravel_index(error.argmax(), error.shape)
        cells.append(f"{which[material]}:{lane}")
    return [kind, *cells, str(int(wrong.sum()))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", metavar="FILE", help="write what this version finds")
    parser.add_argument("--against", metavar="FILE", help="compare with what another found")
    parser.add_argument("--exact", action="store_true", help="compare with double precision without approximations")
    parser.add_argument("--only", default="", help="part of the kinds' names")
    parser.add_argument("--materials", type=int, default=MATERIALS, help="of each kind")
    asked = parser.parse_args()
    mi.set_variant("llvm_ad_rgb")
    found = {kind: results(kind, asked.materials) for kind in KINDS if asked.only in kind}
    if asked.save:
        np.savez_compressed(asked.save, **found)
    if asked.against:
        with np.load(asked.against) as before:
            show({kind: (before[kind][: asked.materials], after) for kind, after in found.items()})
    if asked.exact:
        show({kind: (exact(kind, asked.materials), after) for kind, after in found.items() if kind != "lambertsphere"})
        if "lambertsphere" in found:
            print("lambertsphere: no reference")


def show(pairs: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """A table of what each kind should be, and is."""
    columns = [f"{what} {q}" for what in ("f", "pdf") for q in ("50 %", "99", "99.5", "99.9", "worst", "where")]
    table = Table("", *columns, "not finite", title="relative differences (absolute / 1e-3 below 1e-3)")
    for kind, pair in pairs.items():
        table.add_row(*row(kind, *pair))
        isotropic = [n for n, (given, *_) in enumerate(inputs(kind, len(pair[0]))) if given.keys() & {"alpha", "beta"}]
        if isotropic:
            table.add_row(*row("  of these, isotropic", *pair, isotropic))
    Console(width=180).print(table)


if __name__ == "__main__":
    main()
