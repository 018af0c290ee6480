"""How long a user waits for the first picture of each preset: `python benchmarks/first_picture.py [--against TREE]`.

Each is made in a process of its own, whose home is empty, so that Dr.Jit has no kernel yet. What is timed is loading
the scene and rendering it, small, once Python has its modules: nearly all of it is tracing and compiling. CPU time is
that of all threads; on a busy machine it is the better number.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parents[1]
SLOWER = 1.2
"""What no preset may get slower by."""


def first_picture(name: str) -> dict[str, float]:
    """Seconds until there is one, in this process."""
    import asperity  # noqa: F401  isort: skip  (before Mitsuba)
    import drjit as dr
    import mitsuba as mi

    from asperity.scenes import presets
    from asperity.scenes.preview import preview

    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    wall, cpu = time.perf_counter(), time.process_time()
    preset = presets.load(name)
    scene = mi.load_dict(preview(preset.material, **preset.preview, size=(64, 64), spp=4), parallel=False)
    dr.eval(mi.render(scene))
    dr.sync_thread()
    return {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}


def elsewhere(tree: Path, name: str) -> dict[str, float]:
    """The same in a new process, with the package of this tree."""
    with tempfile.TemporaryDirectory() as home:
        env = os.environ | {"HOME": home, "PYTHONPATH": str(tree / "src")}
        command = [sys.executable, __file__, "--here", name]
        done = subprocess.run(command, env=env, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tree", type=Path, default=HERE, help="the repository to run; by default this one")
    parser.add_argument("--against", metavar="TREE", type=Path, help="another version of it, to run in turns")
    parser.add_argument("--before", metavar="FILE", type=Path, help="what --json wrote there, instead of running it")
    parser.add_argument("--only", default="", help="part of the presets' names")
    parser.add_argument("--rounds", type=int, default=1, help="the least time of so many counts")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all numbers")
    parser.add_argument("--here", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.here:
        print(json.dumps(first_picture(asked.here)))
        return
    trees = {"now": asked.tree.resolve()} | ({"before": asked.against.resolve()} if asked.against else {})
    before = json.loads(asked.before.read_text()) if asked.before else {}
    found: dict[str, dict[str, dict[str, float]]] = {}
    width = max(map(len, names()))
    print(f"{'seconds of CPU (wall)':{width}}  {'before':>14}  {'now':>14}  now / before")
    for name in (name for name in names() if asked.only in name):
        runs = [(label, elsewhere(tree, name)) for _ in range(asked.rounds) for label, tree in trees.items()]
        found[name] = {"before": before[name]["now"]} if name in before else {}
        for label in trees:
            mine = [seconds for other, seconds in runs if other == label]
            found[name][label] = {clock: min(run[clock] for run in mine) for clock in ("cpu", "wall")}
        print(row(name, found[name], width), flush=True)
        if asked.json:
            asked.json.write_text(json.dumps(found, indent=1))
    ratios = {name: x["now"]["cpu"] / x["before"]["cpu"] for name, x in found.items() if "before" in x}
    for name, ratio in ratios.items():
        if ratio > SLOWER:
            print(f"{name} is {ratio:.2f} times as slow: {SLOWER} are allowed.")


def names() -> list[str]:
    """The presets of this tree."""
    return sorted(path.stem for path in (HERE / "src/asperity/scenes/presets").glob("*.json"))


def row(name: str, times: dict, width: int) -> str:
    """A line of the table."""
    cells = (f"{times[x]['cpu']:6.2f} ({times[x]['wall']:6.2f})" if x in times else "-" for x in ("before", "now"))
    ratio = f"{times['now']['cpu'] / times['before']['cpu']:.2f}" if "before" in times else ""
    return f"{name:{width}}  " + "  ".join(f"{cell:>14}" for cell in cells) + f"  {ratio:>12}"


if __name__ == "__main__":
    main()
