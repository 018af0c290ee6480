"""Descriptions on their way into Mitsuba: checked before it sees them, and its complaints made short.

Some mistakes kill Mitsuba 3.9 (a ``bitmap`` without a file, a value that is None, a mesh with indices out of range),
make it wait for ever (filters of a million pixels), or pass in silence (NaN, a ``measured`` file cut in half). `load`
and `load_file` stand in for ``mi.load_dict`` and ``mi.load_file``: what is wrong with a description is a
ParameterError of one line, which says where.
"""

from __future__ import annotations

import contextlib
import io
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import AsperityError, ParameterError, UnreadableFileError, suggestion

PLUGINS: set[str] = set()
"""Names of ours; whoever registers them says so here."""

DEEPEST = 64
"""Descriptions nested in each other; Mitsuba's time grows with the square of it."""

SOURCES = {
    "bitmap": ("filename", "bitmap", "data"),
    "envmap": ("filename", "bitmap"),
    "gridvolume": ("filename", "grid", "data"),
    "sdfgrid": ("filename", "grid"),
    **dict.fromkeys(
        ("measured", "measured_polarized", "ply", "obj", "serialized", "bsplinecurve", "linearcurve"), ("filename",)
    ),
}
"""What a plugin reads: one of these has to be given."""

BITMAP = (*SOURCES["bitmap"], "filter_type", "wrap_mode", "format", "raw", "to_uv", "accel", "id")
"""All parameters of a ``bitmap``, which dies before it would complain of others."""

LIMITS = (
    ("gaussian", "stddev", 0.01, 32.0),
    ("tent", "radius", 0.01, 32.0),
    ("lanczos", "lobes", 1, 32),
    *((film, side, 1, 2**16) for film in ("hdrfilm", "specfilm") for side in ("width", "height")),
    *(
        (name, "sample_count", 1, 2**31)
        for name in ("independent", "multijitter", "orthogonal", "ldsampler", "stratified")
    ),
)
"""Ranges outside which Mitsuba crashes, hangs, or renders nothing."""

BLEND = {"type", "id", "weight"}
IMAGES = ("exr", "hdr", "pfm", "png", "jpg", "bmp", "tga")
MESHES = ("ply", "obj", "serialized")
TENSORS = ("bsdf", "pbsdf")
EIGHT_BITS = (".png", ".jpg", ".jpeg", ".bmp", ".tga")
"""Images whose texels are within [0, 1] in any case."""

REFLECTANCE = re.compile("reflect|albedo|base_color|edge_tint")
"""Parameters within [0, 1]: Mitsuba clips their spectra in RGB variants."""
NESTING = ("checkerboard", "settled")
"""Textures of textures, which are reflectances if these are."""

TRACEBACK = "Traceback (most recent call last):\n"
NOISE = {
    r"\[Measured\] Invalid file structure.*": "its tables do not go together.",
    r"\[parser\.cpp:\d+\] \[(?!\w+\.cpp)([\w.]+)\] ": r"\1: ",
    r"\[\w+(?:\.\w+:\d+)?\] ": "",
    r'(?:At|While loading) dictionary node "root": ': "",
    r'(?:At|While loading|Error while loading) dictionary node "(.*?)": ': r"\1: ",
    r'failed to instantiate \w+ plugin of type ".*?": ': "",
    r'Found \d+ unreferenced \w+ in \w+ plugin of type "(.*?)":\s+- \w+ "(.*?)".*': r"\1 has no parameter '\2'.",
    r"could not assign an object of type '(.*?)' to key .*": r"expected a number, a word, three numbers, "
    r"a transformation or a description, not a '\1'.",
}
"""In Mitsuba's messages, and what to say instead."""


def load(description: dict[str, Any]) -> Any:
    """The object of the current variant that a dictionary describes; raises ParameterError."""
    import mitsuba as mi

    check(description)
    with _refusing():
        return mi.load_dict(description, parallel=False)


def load_file(path: str | Path, **defines: str) -> Any:
    """What an XML file describes, each ``$name`` in it replaced as ``defines`` says; raises ParameterError."""
    import mitsuba as mi

    with _refusing():
        state = mi.parser.parse_file(mi.parser.ParserConfig(mi.variant()), str(path), **defines)
        for node in state.nodes:
            properties = {key: node.props[key] for key in node.props.keys()}  # noqa: SIM118  (it is no dict)
            where = f"{mi.parser.file_location(state, node)}: "
            for key, value in properties.items():
                _value(value, where + key, bool(REFLECTANCE.search(key)))
            _node({"type": node.props.plugin_name(), **properties}, where, Path(path).parent)
        return mi.load_file(str(path), parallel=False, **defines)


def mesh(path: Path, **options: Any) -> Any:
    """The ``mi.Mesh`` in a file, after a look at its indices; raises UnreadableFileError.

    ``options`` are parameters of Mitsuba's plugin.
    """
    import mitsuba as mi

    description = {"type": path.suffix.lower()[1:], "filename": str(path), **options}
    try:
        if path.suffix.lower() == ".serialized":
            serialized_flags(path.read_bytes(), options.get("shape_index", 0))
        # Normals would be made of vertices that may not exist.
        flat = mi.traverse(mi.load_dict(description | {"face_normals": True}, parallel=False))
        vertices, faces = (np.array(flat[name]).reshape(-1, 3) for name in ("vertex_positions", "faces"))
        if not len(faces):
            raise _damaged("mesh", path, MESHES, "it has no faces")
        if len(wild := np.flatnonzero(faces.max(axis=1) >= len(vertices))):
            indices, end = faces[wild[0]].tolist(), f"and there are {len(vertices)}; both count from 0"
            raise _damaged("mesh", path, MESHES, f"face {wild[0]} is of vertices {indices}, {end}")
        return mi.load_dict(description, parallel=False)
    except (RuntimeError, MemoryError, UnicodeDecodeError, struct.error, zlib.error) as error:
        raise _damaged("mesh", path, MESHES, one_line(str(error)) or "it is too large for the memory") from error


def serialized_flags(content: bytes, index: int = 0) -> int:
    """Flags of a mesh in Mitsuba's own format: 1 for normals. Raises RuntimeError if it declares more than it holds.

    Mitsuba would ask for the memory. The format: per mesh 0x041C, a version, and, compressed, flags, a name (from
    version 4 on), numbers of vertices and faces, and arrays; at the end of the file where the meshes begin, and how
    many they are.
    """
    (version,), (meshes,) = struct.unpack("<H", content[2:4]), struct.unpack("<I", content[-4:])
    offset = "<Q" if version > 3 else "<I"
    table = len(content) - 4 - struct.calcsize(offset) * (meshes - index)
    if not 0 <= index < meshes <= len(content) or table < 0:
        raise RuntimeError(f"it has {meshes} meshes, and none of index {index}")
    (start,) = struct.unpack_from(offset, content, table)
    arrays = zlib.decompressobj().decompress(content[start + 4 :])
    after_name = arrays[4:].partition(b"\0")[2] if version > 3 else arrays[4:]
    flags, vertices, faces = *struct.unpack_from("<I", arrays), *struct.unpack_from("<QQ", after_name)
    if 12 * max(vertices, faces) > len(arrays):
        raise RuntimeError(f"it declares {vertices} vertices and {faces} faces, and ends before")
    return int(flags)


def image(path: Path) -> Any:
    """The ``mi.Bitmap`` in a file, after a look at what Mitsuba trusts; raises UnreadableFileError."""
    import mitsuba as mi

    try:
        if path.suffix.lower() in (".hdr", ".rgbe"):
            _runs(path.read_bytes())
        if path.suffix.lower() == ".exr":
            _window(path.read_bytes())
        return mi.Bitmap(str(path))
    except (RuntimeError, ValueError, IndexError, MemoryError) as error:
        reason = "it is cut short, or damaged" if isinstance(error, (IndexError, MemoryError)) else one_line(str(error))
        raise _damaged("image", path, IMAGES, reason) from error


def _window(content: bytes) -> None:
    """Refuse an OpenEXR picture with more rows than fit into its file: Mitsuba would look for all, for hours."""
    window = re.search(rb"dataWindow\0box2i\0\x10\0\0\0(.{16})", content[: 1 << 20], re.DOTALL)
    if window is None:
        raise ValueError("it is no OpenEXR picture")
    left, top, right, bottom = struct.unpack("<4i", window[1])
    width, height = right - left + 1, bottom - top + 1
    # A row of chunks has at most 256 rows, and takes 8 bytes of the table of chunks.
    if not (0 < width <= 2**17 and 0 < height <= len(content) // 8 * 256):
        raise ValueError(f"{width} x {height} pixels do not fit into its {len(content)} bytes")


def _runs(content: bytes) -> None:
    """Follow the run lengths of a Radiance picture: Mitsuba writes beyond its memory if the mark of a row is damaged.

    G. Ward, Real Pixels, 1991: each row is the mark (2, 2, width), and four channels of runs (128 + n, value) and
    literals (n, values...); or no row has a mark, and a pixel is four bytes.
    """
    size = re.match(rb"#\?.*?\n\n-Y ([1-9]\d{,4}) \+X ([1-9]\d{,4})\n", content, re.DOTALL)
    if size is None:
        raise ValueError("it is no Radiance picture whose first pixel is the upper left one")
    height, width, at = int(size[1]), int(size[2]), size.end()
    mark = bytes((2, 2, *divmod(width, 256))) if 8 <= width < 32768 else None
    if content[at : at + 4] != mark and content[at : at + 2] != b"\2\2":
        if len(content) < at + 4 * width * height:
            raise IndexError
        return
    for row in range(height):
        if content[at : at + 4] != mark:
            raise ValueError(f"row {row} does not begin as the one before it")
        at += 4
        for _ in range(4):
            done = 0
            while done < width:
                length = content[at] - 128 if content[at] > 128 else content[at]
                at += 2 if content[at] > 128 else 1 + length
                done += length
                if not length or done > width:
                    raise ValueError(f"the runs of row {row} are longer than the row")
    if len(content) < at:
        raise IndexError


def check(description: Any) -> None:
    """Raise ParameterError, with the dotted path, for what Mitsuba would die of or take in silence.

    Meshes and images, which only Mitsuba can read, are looked at once a variant is set.
    """
    _walk(description, "", (), False)


def one_line(message: str) -> str:
    """Mitsuba's message without what only its authors need: C++ files, plugin kinds, tracebacks of our models."""
    head, traceback, tail = message.rpartition(TRACEBACK)
    text = head + re.sub(r"\A(?:\s.*\n)*(?:[\w.]+: )?", "", tail) if traceback else tail
    for noise, instead in NOISE.items():
        text = re.sub(noise, instead, text, flags=re.DOTALL)
    text = re.sub(r'Plugin "(.*?)" not found!', lambda plugin: no_plugin(plugin[1]), text)
    return " ".join(text.split())


def no_plugin(name: str) -> str:
    """What to say about a plugin that nobody has."""
    import mitsuba as mi

    mitsubas = (path.stem.removeprefix("lib") for path in (Path(mi.__file__).parent / "plugins").iterdir())
    nearest = get_close_matches(name, [*PLUGINS, *mitsubas], n=1)
    return f"there is no plugin {name!r}." + (f" Did you mean {nearest[0]!r}?" if nearest else "")


@contextlib.contextmanager
def _refusing() -> Iterator[None]:
    """Mitsuba's errors as ParameterErrors; but what went wrong in a plugin in Python, and is no refusal, is a bug."""
    try:
        yield
    except (RuntimeError, UnicodeDecodeError) as error:
        _, traceback, tail = str(error).rpartition(TRACEBACK)
        raised = re.search(r"^(?:\w+\.)*(\w+)(?:: |$)", tail, re.MULTILINE)
        refusals = {"RuntimeError", *(kind.__name__ for kind in AsperityError.__subclasses__())}
        if traceback and raised and raised[1] not in refusals:
            raise
        raise ParameterError(one_line(str(error))) from error


def short(value: Any, length: int = 60) -> str:
    """One line that tells what a value is."""
    if not isinstance(value, (str, int, float, list, tuple, dict, type(None))):
        return f"a {type(value).__name__}"
    text = "null" if value is None else " ".join(repr(value).split())
    return text if len(text) <= length else f"{text[: length - 3]}..."


def _walk(node: Any, where: str, above: tuple[Any, ...], reflectance: bool) -> None:
    """Check a description and those nested in it; ``where`` leads to it, ``reflectance`` tells whether it is one."""
    if not isinstance(node, dict):
        raise ParameterError(f"{where}{short(node)}: expected a description, such as {{'type': 'diffuse'}}.")
    if any(node is outer for outer in above) or len(above) > DEEPEST:
        raise ParameterError(f"{where[:60]}... is nested more than {DEEPEST} deep, or in itself.")
    for key, value in node.items():
        if not isinstance(key, str):
            raise ParameterError(f"{where}{key!r}: expected a word as the name of a parameter.")
        colour = reflectance if node.get("type") in NESTING else bool(REFLECTANCE.search(key))
        if isinstance(value, dict):
            _walk(value, f"{where}{key}.", (*above, node), colour)
        elif key not in ("type", "id", "filename") and not (node.get("type") in ("rgb", "spectrum") and key == "value"):
            _value(value, where + key, colour)
    _node(node, where)
    _spectrum(node, where, reflectance)


def _value(value: Any, name: str, reflectance: bool) -> None:
    """Refuse what is no value, or not finite."""
    import drjit as dr

    if value is None:
        raise ParameterError(f"{name} is null: leave it out for its default.")
    if isinstance(value, (list, tuple)):
        expected = "one word or number, or three numbers"
        if _finite(value, name, expected).shape != (3,):
            raise ParameterError(f"{name} = {short(value)}: expected {expected}.")
    elif isinstance(value, Real) and not isinstance(value, bool):
        _finite(value, name, "a number")
    elif re.search("Transform|Matrix", type(value).__name__):
        # Row by row: NumPy sees the padding of Dr.Jit's scalar 3x3 matrices.
        matrix = _finite([list(row) for row in getattr(value, "matrix", value)], name, "a matrix")
        if np.linalg.det(matrix.reshape(matrix.shape[:2])) == 0:
            raise ParameterError(f"{name} has no inverse: it flattens what it transforms.")
    elif isinstance(value, np.ndarray) or dr.is_array_v(value):
        if not _finite(value, name, "numbers").size:
            raise ParameterError(f"{name} is empty.")
    elif hasattr(value, "wavelengths") and reflectance and not value.is_uniform():  # a spectrum in XML
        _within_unit(np.array(value.values), name, "a reflectance")


def _finite(value: Any, name: str, expected: str) -> NDArray[np.float64]:
    import drjit as dr

    try:
        found = np.array(dr.detach(value), dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        found = np.array(np.nan)
    if not np.isfinite(found).all():
        raise ParameterError(f"{name} = {short(value)}: expected {expected}, finite.")
    return found


def _within_unit(values: NDArray[Any], name: str, what: str) -> None:
    wrong = values[~((values >= 0) & (values <= 1))]
    if wrong.size:
        raise ParameterError(f"{name} has {wrong.flat[0]:g}: {what} is within [0, 1].")


def _resolved(filename: str) -> Path:
    """Where Mitsuba finds a file, if it does."""
    import mitsuba as mi

    return Path(str(mi.file_resolver().resolve(filename)))


def _node(given: dict[str, Any], where: str, folder: Path | None = None) -> None:
    """Check what a plugin needs; its files are in ``folder``, if there is one, or where Mitsuba looks for them."""
    if "type" not in given:
        raise ParameterError(f"{where}type is missing: expected the name of a plugin.")
    for name in {"type", "id"} & given.keys():
        if not isinstance(given[name], str):
            raise ParameterError(f"{where}{name} = {short(given[name])}: expected a name.")
    plugin = given["type"]
    if plugin == "bitmap":
        for name in sorted(given.keys() - {"type", *BITMAP}):
            raise ParameterError(f"{where}{name}: a bitmap has no such parameter. {suggestion(name, BITMAP)}")
    if plugin in SOURCES and given.keys().isdisjoint(SOURCES[plugin]):
        raise ParameterError(f"{where}{SOURCES[plugin][0]} is missing: {plugin} needs {' or '.join(SOURCES[plugin])}.")
    if plugin in ("blendbsdf", "blendphase") and ("weight" not in given or len(given.keys() - BLEND) != 2):
        raise ParameterError(f"{where}type is {plugin!r}: expected two nested descriptions, and a weight.")
    for limited, name, low, high in LIMITS:
        value = given.get(name, low)
        if plugin == limited and isinstance(value, (int, float)) and not low <= value <= high:
            raise ParameterError(f"{where}{name} = {value}: expected a number in [{low}, {high}].")
    if "filename" in given:
        _file(given, f"{where}filename", folder)
    for name in ("bitmap", "data"):
        if plugin in ("bitmap", "envmap") and name in given:
            _texels(given, np.array(given[name]), where + name)


def _file(given: dict[str, Any], name: str, folder: Path | None) -> None:
    """Find a file, and look into it where Mitsuba does not, or would die of what it finds."""
    import mitsuba as mi

    plugin, filename = given["type"], given["filename"]
    if not isinstance(filename, str):
        raise ParameterError(f"{name} = {short(filename)}: expected the path of a file, as a string.")
    path = folder / filename if folder and (folder / filename).is_file() else _resolved(filename)
    if not path.is_file():
        raise ParameterError(f"{name}: there is no file {filename!r}.")
    try:
        if plugin in ("measured", "measured_polarized"):
            tensors(path)
        elif mi.variant() and plugin in MESHES:
            mesh(path, **{key: given[key] for key in ("shape_index",) if key in given})
        elif mi.variant() and plugin in ("bitmap", "envmap") and path.suffix.lower() not in EIGHT_BITS:
            _texels(given, np.array(image(path)), name)
    except UnreadableFileError as error:
        raise ParameterError(f"{name}: {error}") from error


def tensors(path: Path) -> dict[str, NDArray[Any]]:
    """What a file of tensors holds, if it is all there: Mitsuba would take what lies beyond its end in memory.

    Raises UnreadableFileError.
    """
    from mitsuba.python import tensor_io

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            fields: dict[str, NDArray[Any]] = tensor_io.read(str(path))
    except Exception as error:  # it checks little: anything may go wrong in a damaged file
        raise _damaged("measurement", path, TENSORS, f"it is cut short, or damaged ({error})") from error
    for name, data in fields.items():
        if data.dtype.kind == "f" and not np.isfinite(data).all():
            raise _damaged("measurement", path, TENSORS, f"its {name!r} is not finite")
        if name in ("ndf", "sigma", "vndf", "luminance") and (data < 0).any():
            raise _damaged("measurement", path, TENSORS, f"its {name!r} is below 0")
        if name in ("theta_i", "phi_i", "wavelengths") and (np.diff(data) <= 0).any():
            raise _damaged("measurement", path, TENSORS, f"its {name!r} does not increase")
    return fields


def _damaged(what: str, path: Path, formats: Iterable[str], reason: str) -> UnreadableFileError:
    return UnreadableFileError(what, path, [f".{name}" for name in formats], reason)


def _texels(given: dict[str, Any], image: NDArray[Any], name: str) -> None:
    """Refuse texels that are not finite, or that Mitsuba clips."""
    import mitsuba as mi

    if image.dtype.kind != "f":
        return
    if wrong := np.count_nonzero(~np.isfinite(image)):
        raise ParameterError(f"{name}: {wrong} of its {image.size} numbers are not finite.")
    # In spectral variants a texel becomes three coefficients, which have no range that could be checked later.
    coloured = given["type"] == "bitmap" and not given.get("raw") and image.shape[-1:] > (2,)
    if coloured and mi.variant() and mi.is_spectral:
        _within_unit(image, name, "a colour, in spectral variants,")


def _spectrum(given: dict[str, Any], where: str, reflectance: bool) -> None:
    """Check a colour, or a spectrum in the ways in which it can be given."""
    plugin = given["type"]
    if plugin in ("rgb", "spectrum") and "value" in given:
        name, expected = f"{where}value", "one number or three" if plugin == "rgb" else "pairs of wavelength and value"
        values = _finite(given["value"], name, expected)
        if values.ndim and (values.shape != (3,) if plugin == "rgb" else values.shape != (len(values), 2)):
            raise ParameterError(f"{name} = {short(given['value'])}: expected {expected}.")
        if reflectance and values.ndim == 2:
            _within_unit(values[:, 1], name, "a reflectance")
    elif plugin in ("irregular", "regular") and isinstance(given.get("values"), str):
        import mitsuba as mi

        name = f"{where}values"
        if mi.variant() and not mi.is_spectral:  # it would load, and fail when it is first looked at
            spectrum = "{'type': 'spectrum', 'value': [(400, 0.1), ...]}"
            raise ParameterError(f"{where}type is {plugin!r}, which is for spectral variants: expected {spectrum}.")
        values = _finite(re.findall(r"[^\s,]+", given["values"]), name, "numbers")
        if reflectance:
            _within_unit(values, name, "a reflectance")
