"""Measures explicit geometries with the virtual goniophotometer, and fits all candidates: which model is it?

python benchmarks/geometries.py -o docs/geometries.json      # a quarter of an hour on two quiet cores
python docs/build.py                                         # the table of docs/fitting-results.md
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import asperity as asp
from asperity import fitting
from asperity.files import atomically
from asperity.goniophotometer import Hemisphere

THETA = (10.0, 30.0, 50.0, 70.0)
PATHS, ROWS = 2**22, 32
FINER = {"grooves": (2**23, 128)}
"""Paths and rows of cells: V-grooves have poles, of which the centre of a cell knows nothing."""
GRAZING = 80.0
"""Degrees: cells beyond are wide, seen from the side, and their centres are not their means."""
BASE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}
GEOMETRIES: dict[str, dict[str, Any]] = {
    "spheres": {"type": "lambertsphere", "reflectance": {"type": "rgb", "value": [0.7, 0.5, 0.2]}},
    "grains": {"type": "micrograin", "tau_0": 0.5, "beta": 0.6, "material": "Cu", "base": BASE},
    "grooves": {"type": "vgroove", "alpha": 0.4, "symmetric": False, "material": "Cu"},
}


def numbers(description: dict[str, Any], prefix: str = "") -> dict[str, float]:
    """The parameters of a description by their paths, colours by channel."""
    found: dict[str, float] = {}
    for name, value in description.items():
        if isinstance(value, dict) and value.get("type") == "rgb":
            found |= {f"{prefix}{name}[{c}]": x for c, x in zip("RGB", value["value"])}
        elif isinstance(value, dict):
            found |= numbers(value, f"{prefix}{name}.")
        elif isinstance(value, float):
            found[prefix + name] = value
    return found


def case(name: str, orders: int | None) -> dict[str, Any]:
    """What all candidates say of one geometry: errors by model, and the parameters of the geometry's own."""
    description, (paths, rows) = GEOMETRIES[name], FINER.get(name, (PATHS, ROWS))
    options = {} if orders is None else {"orders": orders}
    measured = asp.measure(description, THETA, paths=paths, sensor=Hemisphere(rows, 2 * rows), **options)
    ranked = fitting.rank(fitting.data(measured), grazing=GRAZING)
    own = next(one for one in ranked if one.name == description["type"])
    truth = numbers(description)
    return {
        "model": description["type"],
        "noise": own.errors.noise,
        "ranked": [[one.name, one.errors.log_cosine, one.aic] for one in ranked],
        "parameters": [[p.name, truth[p.name], p.value, p.error] for p in own.parameters if p.name in truth],
    }


def main() -> None:
    """What the file has already is not done again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    output = parser.parse_args().output
    found = json.loads(output.read_text()) if output.exists() else {}
    cases = [(name, name, None) for name in GEOMETRIES] + [("grains, light that met one only", "grains", 1)]
    for label, name, orders in cases:
        if label not in found:
            found[label] = case(name, orders)
            print(label, json.dumps(found[label]), flush=True)
            with atomically(output) as part:
                part.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
