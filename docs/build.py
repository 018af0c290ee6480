"""Writes what in the documentation comes from the code: `python docs/build.py [--pictures]`.

The parameter tables, and those of `speed.json` and `fits.json`, always (a test holds them to the declarations and to
those files); the pictures on request: they take ten minutes.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill

DOCS = Path(__file__).parent
BEGIN, END = "<!-- parameters: made by docs/build.py -->", "<!-- end of parameters -->"
BEGIN_SPEED, END_SPEED = "<!-- speed: made by docs/build.py -->", "<!-- end of speed -->"
BEGIN_COSTS, END_COSTS = "<!-- costs: made by docs/build.py -->", "<!-- end of costs -->"
BEGIN_KEPT, END_KEPT = "<!-- kept: made by docs/build.py -->", "<!-- end of kept -->"
SPEED = DOCS / "speed.json"
CALLS, FRAMES = ("eval_pdf", "sample"), ("bare", "preview", "filled")
"""Columns of `speed.json`: nanoseconds, and seconds."""
MORE = {
    "first picture, s": ("first", lambda found: f"{found['first']['time'][1]:.1f}"),
    "memory, MiB": ("memory", lambda found: f"{found['memory']['value'][1]:.0f}"),
    "noise, *environment*": ("point", lambda found: noise(found["filled"])),
    "noise, *point*": ("point", lambda found: noise(found["point"])),
}
"""What newer files have too: the column that says so, and what is told of it."""
NOTE = (
    "`asperity bench`, one process, {threads} threads of {machine}: medians of {rounds} rounds in which all take "
    "turns, ± half the distance of the quartiles. Frames of {size} x {size} pixels over those of the first row; calls "
    "by the lane, of {lanes} random directions. "
)
NOTE_OF_MORE = (
    "The first picture is that of a new process without compiled code, with the most memory that it takes. Noise is "
    "the variance of pixels at equal samples over that of the first row, of *filled* under its environment map and of "
    "*bare* by its point light alone; in brackets it is multiplied by the time of the frame. "
)
CIRCUMSTANCES = "Mitsuba {mitsuba}, Dr.Jit {drjit}, LLVM {llvm}; commit {commit}."
MACBETH = {"orange": (214, 126, 44), "blue flower": (133, 128, 177), "bluish green": (103, 189, 170)}
"""Patches of the ColorChecker, as its maker gives them: sRGB of 8 bits."""
INDICES = (1.0, 1.2, 1.33, 1.5)
WHITE = {"type": "rgb", "value": 1.0}
PAINT = {"type": "interfacedlambertian", "diffuse_reflectance": WHITE}
GRAINS = {"type": "micrograin", "tau_0": 0.5, "base": {"type": "diffuse", "reflectance": WHITE}}
LARGEST = 60_000
"""Bytes of a picture on the page of plots."""
KEPT = (
    ("`roughconductor`", {"type": "roughconductor", "distribution": "ggx", "material": "none"}, "alpha"),
    ("`vgroove`", {"type": "vgroove", "material": "none"}, "alpha"),
    ("`roughplastic`, nonlinear", {"type": "roughplastic", "nonlinear": True, "diffuse_reflectance": WHITE}, "alpha"),
    ("`interfacedlambertian`", PAINT, "alpha"),
    ("the same, `scattering: multiple`", {**PAINT, "scattering": "multiple", "masking": "vcavity"}, "alpha"),
    ("`micrograin`, mirrors on white, tau_0 .5", GRAINS, "beta"),
    ("the same, `scattering: multiple`", {**GRAINS, "scattering": "multiple"}, "beta"),
)
"""White materials, and the parameter that makes them rough."""
ROUGHNESSES, TILTS = (0.1, 0.3, 0.6, 1.0), (1.0, 60.0)
BEGIN_SWEEPS, END_SWEEPS = "<!-- sweeps: made by docs/build.py -->", "<!-- end of sweeps -->"
DUST = {"type": "micrograin", "specular": False, "diffuse_reflectance": 0.5, "beta": 1.5}
RED = {"type": "rgb", "value": [0.45, 0.06, 0.03]}
SWEEPS: dict[str, tuple[tuple[dict, str, tuple[float, ...]], ...]] = {
    "micrograin": (
        ({**DUST, "base": {"type": "diffuse", "reflectance": RED}}, "tau_0", (0.05, 0.2, 0.4, 0.6, 0.85)),
        ({"type": "micrograin", "material": "Au", "tau_0": 0.6}, "beta", (0.02, 0.1, 0.3, 1.0, 3.0)),
    ),
    "deon": (({"type": "deon", "material": "Au", "beta": 0.3}, "tau_0", (0.05, 0.2, 0.4, 0.6, 0.85)),),
    "merillou": (({"type": "merillou", "material": "Au", "beta": 0.3}, "tau_0", (0.05, 0.2, 0.4, 0.6, 0.85)),),
    "vgroove": (({"type": "vgroove", "material": "Cu"}, "alpha", (0.02, 0.1, 0.3, 0.6, 1.0)),),
    "lambertsphere": (({"type": "lambertsphere"}, "reflectance", (0.05, 0.2, 0.4, 0.7, 0.95)),),
    "chandrasekhar": (({"type": "chandrasekhar"}, "reflectance", (0.05, 0.2, 0.4, 0.7, 0.95)),),
    "orennayar": (({"type": "orennayar"}, "sigma", (0.0, 10.0, 20.0, 30.0, 45.0)),),
    "interfacedlambertian": (
        ({"type": "interfacedlambertian", "diffuse_reflectance": RED}, "alpha", (0.02, 0.1, 0.3, 0.6, 1.0)),
        ({"type": "interfacedlambertian", "diffuse_reflectance": RED}, "int_ior", (1.0003, 1.1, 1.3, 1.5, 2.0)),
    ),
    "twoscale": (
        ({"type": "twoscale", "material": "Ni_palik", "alpha": 0.05}, "sigma_s", (0.0, 0.01, 0.02, 0.04, 0.08)),
        ({"type": "twoscale", "material": "Ni_palik", "alpha": 0.05, "sigma_s": 0.0}, "p", (0.3, 0.5, 0.7, 1.0, 1.5)),
    ),
}
"""What a parameter does: a material, the parameter, and its values."""
STRIP = ("dusty-wood", "verdigris", "gilded", "moldy-glass", "red-flock")
STRIP += ("worn-copper", "polished-gold", "hematite", "corrugated-plastic", "lacquer-by-normal")
VIEWS = {"dusty-wood": {"object": "ball", "floor": "tiles"}}
"""Of presets in that picture, other than their own."""


def table(model) -> str:
    """A model's parameters, in Markdown."""
    lines = ["| name | value | default | allowed | usual | unit | meaning |", "|---|---|---|---|---|---|---|"]
    lines += ["| `" + row.name + "` | " + " | ".join(row[1:]) + " |" for row in model.rows()]
    return "\n".join(lines)


def with_table(page: str, model) -> str:
    """The page with the model's table between the marks."""
    return between(page, BEGIN, table(model), END)


def between(page: str, begin: str, text: str, end: str) -> str:
    """The page with this text between the marks."""
    before, rest = page.split(begin)
    return f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}"


def speed_table(name: str, report: dict) -> str:
    """What a model costs, in Markdown, from what `asperity bench --json` wrote."""
    rows = {row: found for row, found in report["rows"].items() if row.split(",")[0] == name}
    if not rows:
        return "Not timed yet."
    reference = next(iter(rows.values()))["against"]
    rows = {reference: report["rows"][reference], **rows}
    more = {head: cell for head, (column, cell) in MORE.items() if column in rows[reference]}
    heads = [f"`{call}`, ns" for call in CALLS] + [f"frame, *{scene}*" for scene in FRAMES] + list(more)
    lines = ["| | " + " | ".join(heads) + " |", "|" + "---|" * (len(heads) + 1)]
    for row, found in rows.items():
        times = [found[call]["time"][1] for call in CALLS]
        cells = [f"{time:.0f}" if time > 10 else f"{time:.2g}" for time in times]
        cells += ["1" if row == reference else spread(found[scene]["ratio"]) for scene in FRAMES]
        cells += [cell(found) for cell in more.values()]
        lines.append(f"| {row if row == reference else row.removeprefix(f'{name}, ')} | " + " | ".join(cells) + " |")
    note = NOTE + (NOTE_OF_MORE if more else "") + CIRCUMSTANCES
    return "\n".join([*lines, "", fill(note.format(**report), 120)])


def spread(quartiles: list[float]) -> str:
    """Median and half the distance of the others."""
    low, middle, high = quartiles
    return f"{middle:.2f} ± {(high - low) / 2:.2f}"


def noise(frame: dict) -> str:
    """Ratios of variance, and of variance times time."""
    return f"{frame['noise'][1]:.2g} ({frame['work'][1]:.2g})"


def with_speed(page: str, name: str, report: dict) -> str:
    """The page with the speed of the model ``name`` between the marks, if it has marks."""
    return between(page, BEGIN_SPEED, speed_table(name, report), END_SPEED) if BEGIN_SPEED in page else page


def costs_table(report: dict) -> str:
    """The least and the most that each model's frames take beside Mitsuba's, in Markdown."""
    lines = ["| | beside | " + " | ".join(f"frame, *{scene}*" for scene in FRAMES) + " |", "|" + "---|" * 5]
    timed = {row: found for row, found in report["rows"].items() if row != found["against"]}
    for name in dict.fromkeys(row.split(",")[0] for row in timed):
        rows = [found for row, found in timed.items() if row.split(",")[0] == name]
        ranges = []
        for scene in FRAMES:
            ratios = sorted(found[scene]["ratio"][1] for found in rows)
            ranges.append(" to ".join(dict.fromkeys(f"{ratio:.2f}" for ratio in (ratios[0], ratios[-1]))))
        lines.append(f"| [`{name}`]({name}.md) | {rows[0]['against']} | " + " | ".join(ranges) + " |")
    return "\n".join(lines)


def with_costs(page: str, report: dict) -> str:
    """The page with what models cost between the marks."""
    return between(page, BEGIN_COSTS, costs_table(report), END_COSTS)


def kept() -> list[list[float]]:
    """Albedos of the white materials, by angle of incidence and roughness."""
    import mitsuba as mi

    from asperity.lab import evaluate
    from asperity.lab.checks.samples import SAMPLES, draw_samples

    mi.set_variant("llvm_ad_rgb")

    def albedo(description: dict, theta: float) -> float:
        drawn = draw_samples(evaluate.load(description), evaluate.direction(theta, 0), SAMPLES, seed=1)
        return float(drawn.weight.mean())

    return [
        [albedo({**white, rough: value}, theta) for theta in TILTS for value in ROUGHNESSES] for _, white, rough in KEPT
    ]


def kept_table() -> str:
    """The same in Markdown."""
    heads = [f"{theta:.0f}°, {value:g}" for theta in TILTS for value in ROUGHNESSES]
    lines = ["| | " + " | ".join(heads) + " |", "|" + "---|" * (len(heads) + 1)]
    lines += [f"| {name} | " + " | ".join(f"{x:.2f}" for x in row) + " |" for (name, *_), row in zip(KEPT, kept())]
    return "\n".join(lines)


def shot(material: dict, size: int, spp: int, finer: int = 1, **view: str):
    """A material's preview, denoised, perhaps rendered ``finer`` than it is: `PIL.Image`."""
    import mitsuba as mi
    import numpy as np
    from PIL import Image

    from asperity.scenes import denoise
    from asperity.scenes.preview import preview

    mi.set_variant("llvm_ad_rgb")
    scene = mi.load_dict(preview(material, **view, size=(finer * size,) * 2), parallel=False)
    image = denoise.denoised(np.array(mi.render(scene, spp=spp)), *denoise.features(scene))
    bitmap = mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)
    return Image.fromarray(np.array(bitmap)).resize((size, size), Image.Resampling.BOX)


def rows(shots: list, columns: int):
    """Pictures of one size, row by row: `PIL.Image`."""
    from PIL import Image

    size = shots[0].width
    whole = Image.new("RGB", (columns * size, -(-len(shots) // columns) * size))
    for n, picture in enumerate(shots):
        whole.paste(picture, (n % columns * size, n // columns * size))
    return whole


def strip(path: Path, size: int = 240, columns: int = 5, spp: int = 64) -> None:
    """The presets of STRIP in rows."""
    from asperity.scenes import presets

    shots = []
    for name in STRIP:
        preset = presets.load(name)
        shots.append(shot(preset.material, size, spp, 2, **preset.preview | VIEWS.get(name, {})))
    rows(shots, columns).save(path, optimize=True)


def moon(path: Path, size: int = 256, spp: int = 64) -> None:
    """Lambert's law and d'Eon's dust of one reflectance, lit from behind the camera, and from the side."""
    grey = {"reflectance": 0.45}
    shots = [
        shot({"type": name, **grey}, size, spp, object="ball", env="atelier", floor="tiles", light=light)
        for light in ("front", "side")
        for name in ("diffuse", "lambertsphere")
    ]
    rows(shots, len(shots)).save(path, optimize=True)


def gallery(folder: Path, size: int = 256, spp: int = 16) -> None:
    """A thumbnail of each preset, for the site."""
    from asperity.scenes import presets

    folder.mkdir(exist_ok=True)
    for name in presets.names():
        preset = presets.load(name)
        shot(preset.material, size, spp, **preset.preview).save(folder / f"{name}.jpg", quality=88)


def sweeps(name: str) -> str:
    """The pictures of a model's sweeps, with their values, in Markdown."""
    return "\n\n".join(
        f"`{parameter}` " + ", ".join(f"{value:g}" for value in values) + ":\n\n"
        f"![Spheres of {name} by {parameter}](pictures/sweeps/{name}-{parameter}.png)"
        for _, parameter, values in SWEEPS[name]
    )


def with_sweeps(page: str, name: str) -> str:
    """The page with the sweeps of the model ``name`` between the marks."""
    return between(page, BEGIN_SWEEPS, sweeps(name), END_SWEEPS)


def draw_sweeps(folder: Path, size: int = 128, spp: int = 256) -> None:
    """A row of spheres for each sweep."""
    import mitsuba as mi
    import numpy as np

    from asperity.scenes.preview import preview

    mi.set_variant("llvm_ad_rgb")
    for name, parameter, material, values in ((n, p, m, v) for n, found in SWEEPS.items() for m, p, v in found):
        scenes = [
            preview({**material, parameter: value}, object="sphere", size=(size, size), spp=spp) for value in values
        ]
        images = [np.asarray(mi.render(mi.load_dict(scene, parallel=False)))[..., :3] for scene in scenes]
        path = folder / f"{name}-{parameter}.png"
        mi.util.write_bitmap(str(path), mi.TensorXf(np.concatenate(images, axis=1)), write_async=False)


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


def plots(folder: Path, page: Path = DOCS / "plotting.md") -> None:
    """The pictures below the commands of a page: those that these write, made smaller."""
    shown = re.compile(r"^```sh\n(.*?)^```\n(?:\n!\[.*?\]\(pictures/(.*?)\))?", re.MULTILINE | re.DOTALL)
    with TemporaryDirectory() as place:
        for commands, picture in shown.findall(page.read_text()):
            for command in commands.splitlines():
                line = [sys.executable, "-m", *shlex.split(command), *(["--force"] if picture else [])]
                written = subprocess.run(line, cwd=place, check=True, stdout=subprocess.PIPE, text=True).stdout
            if picture:
                shrink(Path(place, written.split()[-1]), folder / picture)


def inverse(path: Path) -> None:
    """The figure of the example that fits to a picture, half as wide."""
    with TemporaryDirectory() as place:
        example = DOCS.parent / "examples" / "fit_to_picture.py"
        subprocess.run([sys.executable, str(example)], cwd=place, check=True, env=os.environ | {"MPLBACKEND": "Agg"})
        shrink(Path(place, "fit_to_picture.png"), path)


def shrink(source: Path, target: Path) -> None:
    """Write a picture half as wide, or narrower, until it is no larger than `LARGEST`; a PNG in 256 colours."""
    from PIL import Image

    image = Image.open(source).convert("RGB")
    for factor in (2, 2.4, 2.8, 3.2, 3.6):
        size = round(image.width / factor), round(image.height / factor)
        small = image.resize(size, Image.Resampling.LANCZOS)
        (small.quantize(256) if target.suffix == ".png" else small).save(target, optimize=True, quality=70)
        if target.stat().st_size <= LARGEST:
            return


def main() -> None:
    """Write the tables, and the pictures if asked."""
    import fitted

    import asperity  # noqa: F401  (before Mitsuba)
    from asperity.models import MODELS

    report = json.loads(SPEED.read_text())  # by `asperity bench --json docs/speed.json --force`
    for name, model in MODELS.items():
        page = DOCS / f"{name}.md"
        page.write_text(with_sweeps(with_speed(with_table(page.read_text(), model), name, report), name))
    page = DOCS / "which.md"
    page.write_text(between(with_costs(page.read_text(), report), BEGIN_KEPT, kept_table(), END_KEPT))
    page = DOCS / "fitting-results.md"
    page.write_text(fitted.filled(page.read_text()))
    if "--pictures" in sys.argv[1:]:
        strip(DOCS / "pictures" / "presets.png")
        gallery(DOCS / "pictures" / "gallery")
        moon(DOCS / "pictures" / "moon.png")
        figures(DOCS / "pictures")
        plots(DOCS / "pictures")
        inverse(DOCS / "pictures" / "inverse.jpg")
        draw_sweeps(DOCS / "pictures" / "sweeps")
        patches(DOCS / "pictures" / "macbeth.png")


if __name__ == "__main__":
    main()
