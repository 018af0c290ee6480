"""What updates of parameters leave in memory: `python benchmarks/updates.py [COUNT]`, with a render after each."""

from __future__ import annotations

import sys

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi

from asperity.peers import METALS
from asperity.scenes.preview import preview


def resident() -> int:
    """Mebibytes of this process now."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 >> 20


def updates(count: int) -> tuple[int, int]:
    """Mebibytes after 100 and after ``count`` updates."""
    material = METALS["micrograin, on a diffuse base"]
    scene = mi.load_dict(preview(material, size=(32, 32), spp=4), parallel=False)
    params, early = mi.traverse(scene), 0
    for step in range(count):
        params["object.bsdf.tau_0.value"] = 0.1 + 0.8 * step / count
        params.update()
        dr.eval(mi.render(scene, params, seed=step))
        if step == 100:
            early = resident()
    return early, resident()


if __name__ == "__main__":
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    early, late = updates(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
    print(f"{early} MiB after 100 updates with a render after each, {late} MiB after the last")
