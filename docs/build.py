"""Writes what in the documentation comes from the code: `python docs/build.py [--pictures]`.

The parameter tables always (a test holds them to the declarations), the pictures on request: they take three minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).parent
BEGIN, END = "<!-- parameters: made by docs/build.py -->", "<!-- end of parameters -->"
MACBETH = {"orange": (214, 126, 44), "blue flower": (133, 128, 177), "bluish green": (103, 189, 170)}
"""Patches of the ColorChecker, as its maker gives them: sRGB of 8 bits."""
INDICES = (1.0, 1.2, 1.33, 1.5)
STRIP = ("dusty-wood", "verdigris", "gilded", "rusty-aluminium", "moldy-glass", "dirty-weave")


def table(model) -> str:
    """A model's parameters, in Markdown."""
    lines = ["| name | value | default | allowed | usual | unit | meaning |", "|---|---|---|---|---|---|---|"]
    lines += ["| `" + row.name + "` | " + " | ".join(row[1:]) + " |" for row in model.rows()]
    return "\n".join(lines)


def with_table(page: str, model) -> str:
    """The page with the model's table between the marks."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{table(model)}\n{END}{rest.split(END)[1]}"


def strip(path: Path, size: int = 256, spp: int = 256) -> None:
    """Six presets side by side."""
    import mitsuba as mi
    import numpy as np

    from asperity.scenes import presets
    from asperity.scenes.preview import preview

    mi.set_variant("llvm_ad_rgb")
    images = []
    for name in STRIP:
        preset = presets.load(name)
        scene = preview(preset.material, **preset.preview, size=(size, size), spp=spp)
        images.append(np.asarray(mi.render(mi.load_dict(scene, parallel=False))))
    mi.util.write_bitmap(str(path), mi.TensorXf(np.concatenate(images, axis=1)[..., :3]), write_async=False)


def linear(patch: str) -> list[float]:
    """Reflectance of a patch in linear RGB (IEC 61966-2-1)."""
    values = [channel / 255 for channel in MACBETH[patch]]
    return [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values]


def painted(patch: str, index: float) -> dict:
    """The patch as the body below an interface of this index."""
    colour = {"type": "rgb", "value": linear(patch)}
    return {"type": "interfacedlambertian", "diffuse_reflectance": colour, "int_ior": index, "ext_ior": 1.0}


def patches(path: Path, size: int = 128, spp: int = 144) -> None:
    """Spheres of three colours (rows) under interfaces of four indices."""
    import mitsuba as mi
    import numpy as np

    from asperity.scenes.preview import preview

    mi.set_variant("llvm_ad_rgb")
    rows = [[painted(patch, index) for index in INDICES] for patch in MACBETH]
    scenes = [[preview(one, object="sphere", env="studio", size=(size, size), spp=spp) for one in row] for row in rows]
    images = [[np.asarray(mi.render(mi.load_dict(s, parallel=False)))[..., :3] for s in row] for row in scenes]
    picture = np.concatenate([np.concatenate(row, axis=1) for row in images])
    mi.util.write_bitmap(str(path), mi.TensorXf(picture), write_async=False)


def save(figure, path: Path) -> None:
    """A figure, small, in 256 colours."""
    from io import BytesIO

    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=75)
    Image.open(buffer).convert("RGB").quantize(256).save(path, optimize=True)


def figures(folder: Path) -> None:
    """Those of the goniophotometer and of two reports."""
    from asperity.goniophotometer import measure, plots
    from asperity.models import MODELS
    from asperity.validation import lambertsphere, report, vgroove

    grains = {"type": "micrograin", "tau_0": 0.5}
    angles = [(60.0, 0.0), (86.0, 0.0)]
    measured = measure(MODELS["micrograin"].microgeometry(grains), angles, orders=1, paths=2e7, about={"model": grains})
    save(plots.figure(measured, grains), folder / "grains.png")
    save(vgroove.furnace_spheres(), folder / "furnace-vgroove.png")
    save(lambertsphere.ball(report.Effort(4e6, 32)).figures["ball"], folder / "ball.png")


def main() -> None:
    """Write the tables, and the pictures if asked."""
    import asperity  # noqa: F401  (before Mitsuba)
    from asperity.models import MODELS

    for name, model in MODELS.items():
        page = DOCS / f"{name}.md"
        page.write_text(with_table(page.read_text(), model))
    if "--pictures" in sys.argv[1:]:
        strip(DOCS / "pictures" / "presets.png")
        figures(DOCS / "pictures")
        patches(DOCS / "pictures" / "macbeth.png")


if __name__ == "__main__":
    main()
