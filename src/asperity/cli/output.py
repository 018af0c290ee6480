"""The files that ``asperity render`` writes: whole, or not at all."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from asperity.errors import ParameterError
from asperity.files import atomically

from . import channels

if TYPE_CHECKING:
    import numpy as np

NAME = Path("asperity")
FORMATS = (".png", ".exr")


def targets(out: Path) -> list[Path]:
    """The files to write, one for each format if ``out`` has no ending; raises if that cannot work."""
    if out.is_dir():
        out = out / NAME
    if out.suffix and out.suffix.lower() not in FORMATS:
        raise ParameterError(
            f"-o {out}: the ending is {out.suffix!r}. Allowed: {', '.join(FORMATS)}, or none for both."
        )
    check_folder(out, "-o")
    return [out] if out.suffix else [out.with_suffix(suffix) for suffix in FORMATS]


def writable(out: Path, formats: tuple[str, ...], option: str = "-o") -> Path:
    """The file to write, with the first of the endings if it has none; raises if that cannot work."""
    if not out.suffix and out.name:
        out = out.with_suffix(formats[0])
    if out.is_dir():
        raise ParameterError(f"{option} {out}: it is a folder.")
    if out.suffix.lower() not in formats:
        raise ParameterError(f"{option} {out}: the ending is {out.suffix!r}. Allowed: {', '.join(formats)}.")
    check_folder(out, option)
    return out


def check_folder(out: Path, option: str) -> None:
    """Raise ParameterError if nothing can be written beside ``out``."""
    try:
        with TemporaryFile(dir=out.parent):
            pass
    except OSError as error:
        raise ParameterError(
            f"{option} {out}: cannot write into the folder {str(out.parent)!r}: {error.strerror}."
        ) from error


def write(path: Path, image: np.ndarray, names: list[str]) -> None:
    """Write an image (height, width, channels) of linear radiance: to EXR as it is, to PNG in sRGB, clipped at 1.

    ``names`` are those of the channels: colours first, then perhaps others (AOVs), for which PNG has no place.
    """
    import mitsuba as mi
    import numpy as np

    image = image.astype(np.float32)
    with atomically(path) as part:
        if path.suffix.lower() == ".exr":
            bitmap = mi.Bitmap(image, mi.Bitmap.PixelFormat.MultiChannel, names)
        else:
            bitmap = channels.png(image, names)
        bitmap.write(str(part))
