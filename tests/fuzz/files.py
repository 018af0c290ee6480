"""Damaged files of every kind that the package reads."""

from __future__ import annotations

import contextlib
import io
import json
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from asperity import loading
from asperity.goniophotometer import Hemisphere, Measurement, measure
from asperity.goniophotometer.mesh import HeightField
from asperity.materials import resolve
from asperity.measured import BRDF, archive, conversion, goniometer, load
from asperity.measured.functions import Function, of_brdf, random_pairs
from asperity.scenes import meshes, presets
from asperity.scenes.objects import sphere
from asperity.scenes.preview import read_map

TEXTURED = {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": "map.png"}}
XML = """<scene version="3.0.0"><integrator type="path"/><shape type="sphere"><bsdf type="micrograin">
<float name="tau_0" value="0.4"/><texture name="diffuse_reflectance" type="bitmap"><string name="filename"
value="map.png"/></texture></bsdf></shape><emitter type="constant"/></scene>"""
WORDS = (b"-1", b"nan", b"0", b"", b"1e39", b"x", b"4000000000", b"inf", b"null", b"[]", b"{}", b'"', b"-0.5", b"99")


def write_seeds(folder: Path) -> None:
    """Good files, small ones, to be damaged."""
    random = np.random.default_rng(0)
    image = random.random((8, 8, 3)).astype(np.float32)
    for suffix in ("exr", "hdr", "pfm"):
        mi.Bitmap(image).write(str(folder / f"map.{suffix}"))
    for suffix in ("png", "jpg"):
        mi.Bitmap((image * 255).astype(np.uint8)).write(str(folder / f"map.{suffix}"))
    ball = sphere(8, 4)
    meshes.to_mitsuba(ball, {"type": "diffuse"}).write_ply(str(folder / "full.ply"))
    lines = ["v {:g} {:g} {:g}".format(*v) for v in ball.vertices] + ["f {} {} {}".format(*f) for f in ball.faces + 1]
    (folder / "bare.obj").write_text("\n".join(lines) + "\n")
    rows = [" ".join(map("{:g}".format, v)) for v in ball.vertices] + ["3 {} {} {}".format(*f) for f in ball.faces]
    header = f"element vertex {len(ball.vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {len(ball.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    (folder / "ascii.ply").write_text(f"ply\nformat ascii 1.0\n{header}" + "\n".join(rows) + "\n")
    (folder / "mesh.serialized").write_bytes(serialized(ball.vertices, ball.faces))
    (folder / "material.json").write_text(json.dumps({"material": TEXTURED, "preview": {"object": "knot"}}))
    (folder / "scene.xml").write_text(XML)
    np.save(folder / "heights.npy", random.random((6, 6)))
    from asperity.goniophotometer import tensor_file

    path = folder / "measured.npz"
    traced = measure(
        HeightField(np.zeros((4, 4)), 1.0), [(0, 0), (45, 0), (80, 0)], sensor=Hemisphere(4, 8), paths=1 << 14
    )
    traced.save(path)
    tensor_file.write(traced, folder / "tensors.bsdf")


def write_measured(folder: Path) -> None:
    """Good files of measured BRDFs, small ones."""
    wi, wo = random_pairs(40)
    data = BRDF(wi, wo, 0.1 + wi * wo, ("R", "G", "B"), np.full((40, 3), 0.01), weights=np.ones(40))
    archive.save(data, folder / "pairs.npz")
    goniometer.save(data, folder / "pairs.csv")
    f = Function(lambda wi, wo: 0.1 + wi * wo, ("R", "G", "B"))
    for ending in (".binary", ".bsdf"):
        conversion.convert(f, folder / f"grid{ending}", resolution=4)
    (folder / "rendered.bsdf").write_bytes((folder / "grid.bsdf").read_bytes())


def damaged_measurement(name: str, content: bytes, random: np.random.Generator) -> bytes:
    """The same as `damaged`, or with other numbers; of an archive, a part, whose checksum is right."""
    how = random.integers(4)
    if how == 0:
        return damaged(content, random)
    if name.endswith(".csv"):
        return with_another_cell(content, random)
    if not name.endswith(".npz"):
        return with_another_number(content, random)
    with zipfile.ZipFile(io.BytesIO(content)) as given:
        members = {one: given.read(one) for one in given.namelist()}
    one = sorted(members)[random.integers(len(members))]
    members[one] = (damaged if how == 1 else with_another_number)(members[one], random)
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archived:
        for member, data in members.items():
            archived.writestr(member, data)
    return made.getvalue()


def with_another_number(content: bytes, random: np.random.Generator) -> bytes:
    """Four or eight bytes are other ones, half of the time in the first 600, where counts are."""
    numbers = [struct.pack(f"<{kind}", x) for kind in "fd" for x in (np.nan, np.inf, -1.0, 0.0, 1e30, 1e-30)]
    numbers += [struct.pack("<i", x) for x in (0, 1, -1, 2**31 - 1, 10**6, 7)] + [struct.pack("<q", 10**12)]
    number = numbers[random.integers(len(numbers))]
    place = int(random.integers(len(content) if random.random() < 0.5 else min(len(content), 600))) // 4 * 4
    return content[:place] + number + content[place + len(number) :]


def with_another_cell(content: bytes, random: np.random.Generator) -> bytes:
    """A cell of a table has another word, or there is a further one."""
    rows = [row.split(b",") for row in content.split(b"\n")]
    row = rows[random.integers(len(rows)) if random.random() < 0.8 else 0]
    place = int(random.integers(len(row)))
    row[place : place + int(random.random() < 0.9)] = [WORDS[random.integers(len(WORDS))]]
    return b"\n".join(b",".join(row) for row in rows)


def serialized(vertices: Any, faces: Any) -> bytes:
    """Mitsuba's own format of meshes, version 4, single precision, without normals."""
    table = struct.pack("<I", 0x1000) + b"name\0" + struct.pack("<QQ", len(vertices), len(faces))
    table += np.float32(vertices).tobytes() + np.uint32(faces).tobytes()
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(table, 0) + struct.pack("<QI", 0, 1)


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Cut, with some bytes changed or put in, or with another word."""
    place = int(random.integers(len(content)))
    how = random.integers(4)
    if how == 0:
        return content[:place]
    changed = bytearray(content)
    if how == 1:
        for at in random.integers(0, len(content), random.integers(1, 6)):
            changed[at] = random.integers(256)
    elif how == 2:
        changed[place:place] = random.bytes(int(random.integers(1, 9)))
    else:
        words = content.split(b" ")
        words[int(random.integers(len(words)))] = WORDS[random.integers(len(WORDS))]
        return b" ".join(words)
    return bytes(changed)


def show(shape: Any) -> Any:
    """A render of a shape, which follows its indices."""
    camera = {"type": "perspective", "to_world": mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 1], [0, 0, 1])}
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}}
    scene = {"type": "scene", "light": {"type": "constant"}, "sensor": {**camera, "film": film}, "shape": shape}
    return np.array(mi.render(mi.load_dict(scene, parallel=False), integrator=mi.load_dict({"type": "path"}), spp=1))


def looked_at(bsdf: Any) -> Any:
    """Values of a BSDF."""
    from worker import values

    return values(bsdf, np.random.default_rng(1))


def quietly(read: Callable[[Path], Any]) -> Callable[[Path], Any]:
    def run(path: Path) -> Any:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            return read(path)

    return run


def textured(path: Path) -> Any:
    return looked_at(loading.load({"type": "diffuse", "reflectance": {"type": "bitmap", "filename": str(path)}}))


def interpolated(path: Path) -> list[float]:
    """Values between those of a file."""
    data = load(path)
    return [float(x) for x in of_brdf(data)(*random_pairs(20)).ravel()]


MEASURED: dict[str, Callable[[Path], Any]] = {
    **dict.fromkeys(("grid.binary", "grid.bsdf", "pairs.csv", "pairs.npz"), interpolated),
    "rendered.bsdf": lambda path: looked_at(resolve(path).load()),
}
"""The same for files of measured BRDFs."""
READERS: dict[str, Callable[[Path], Any]] = {
    "full.ply": lambda path: show(meshes.to_mitsuba(meshes.from_file(path), {"type": "diffuse"})),
    "ascii.ply": lambda path: show(loading.load({"type": "ply", "filename": str(path)})),
    "bare.obj": lambda path: show(meshes.to_mitsuba(meshes.from_file(path), {"type": "diffuse"})),
    "map.png": textured,
    "map.exr": textured,
    "map.hdr": read_map,
    "map.jpg": textured,
    "map.pfm": textured,
    "mesh.serialized": lambda path: show(meshes.to_mitsuba(meshes.from_file(path), {"type": "diffuse"})),
    "material.json": lambda path: looked_at(loading.load(presets.read(path).material)),
    "scene.xml": lambda path: loading.load_file(path),
    "heights.npy": lambda path: HeightField.load(path, 1.0).triangles,
    "measured.npz": lambda path: Measurement.load(path).values,
    "tensors.bsdf": lambda path: looked_at(loading.load({"type": "measured", "filename": str(path)})),
}
"""What reads, and uses, the file of each name."""
