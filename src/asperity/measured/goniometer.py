"""Tables of goniometers: CSV with a header; a row a pair of directions, or a pair and a wavelength.

Columns are guessed by their names, or named by the user. The field has no standard: angles are in degrees or radians;
wavelengths in nm or µm, in a column or in the names of others; θ may be negative, which turns φ by 180 degrees, as in
T. Germer's measurements of NIST.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import ParameterError, UnknownNameError
from ..files import atomically
from .brdf import ABOVE, BRDF, Array
from .files import reading

FORMATS = (".csv",)
ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
NAMES: dict[str, tuple[str, ...]] = {
    "theta_i": ("thetai", "thetain", "thetainc", "ti", "incidence", "θi"),
    "phi_i": ("phii", "phiin", "phiinc", "phi", "pi", "φi"),
    "theta_o": ("thetao", "thetar", "thetas", "thetaout", "thetav", "theta", "to", "tr", "ts", "θo", "θr"),
    "phi_o": ("phio", "phir", "phis", "phiout", "phiv", "dphi", "po", "pr", "ps", "φo", "φr"),
    "wavelength": ("wavelength", "lambda", "wl", "λ"),
    "value": ("brdf", "bsdf", "f", "fr", "fr11", "value", "y", "reflectance"),
    "error": ("error", "sigma", "std", "stderr", "uncertainty"),
}
"""What columns may be called, in small letters, without what is between brackets, units, blanks and signs."""
RGB = (("r", "g", "b"), ("red", "green", "blue"))
MICRO = 20.0
"""Wavelengths below are in µm, not nm."""
SAME = 1e-4
"""Degrees within which directions are the same, where rows of several wavelengths are put together."""


class _Table(NamedTuple):
    header: list[str]
    numbers: Array  # (rows, columns): NaN where a cell is empty


def load(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    *,
    degrees: bool | None = None,
    cosine: bool = False,
    isotropic: bool | None = None,
) -> BRDF:
    """The values of a table; raises UnreadableFileError.

    Parameters
    ----------
    columns : the column of each of theta_i, phi_i, theta_o, phi_o, wavelength, value and error; guessed if left out.
        Without phi_i it is 0
    degrees : whether angles are in degrees, or radians; by default their names say so ("theta_i [rad]"), or they are in
        radians if no θ is beyond 1.6
    cosine : whether values are f cosθ_o, and not f
    isotropic : by default, if there is one azimuth of incidence

    Rows without a value, or below the surface, are left out and counted; so are pairs that lack a wavelength.
    """
    with reading(path, FORMATS) as path:
        table = _read(path)
        found = _columns(table.header, columns or {})
        names = {name: table.numbers[:, at] for name, at in found.items() if name in (*ANGLES, "wavelength")}
        angles = _angles(table.header, found, names, degrees)
        wi, wo = (_directions(angles[theta], angles[phi]) for theta, phi in (ANGLES[:2], ANGLES[2:]))
        values, errors, channels = _values(table, found)
        above = (wi[:, 2] > ABOVE) & (wo[:, 2] > ABOVE)
        known = np.isfinite(values).all(axis=1)
        left_out = {"without a value": int((~known).sum()), "below the surface": int((known & ~above).sum())}
        rows: Any = np.flatnonzero(above & known)
        pairs, channel = rows, np.arange(len(channels))
        if "wavelength" in names:
            places = np.stack([angles[name] for name in ANGLES], axis=-1)
            rows, channels, left_out["without all wavelengths"] = _together(places, names["wavelength"], rows)
            pairs, channel = rows[:, 0], np.zeros(1, dtype=int)
        else:
            rows = rows[:, None]
        scale = 1 / wo[pairs, 2:] if cosine else 1.0
        return BRDF(
            wi[pairs],
            wo[pairs],
            values[rows, channel] * scale,
            channels,
            None if errors is None else errors[rows, channel] * scale,
            len(np.unique(np.round(angles["phi_i"][pairs], 3))) == 1 if isotropic is None else isotropic,
            path.stem,
            {why: n for why, n in left_out.items() if n},
        )


def save(brdf: BRDF, path: str | Path) -> None:
    """Write a table: angles in degrees, a column a channel, ``error ...`` columns if errors are known.

    Pairs of an isotropic BRDF are turned until φ_i = 0, which is how a reader knows. Angles get eleven digits: the half
    vectors of MERL's grid, from 0.01 degrees on, are differences of them.
    """
    header = [f"{name} [deg]" for name in ANGLES] + list(brdf.channels)
    incident, outgoing = brdf.incident, brdf.outgoing
    if brdf.isotropic:
        outgoing[:, 1] = (outgoing[:, 1] - incident[:, 1]) % 360
        incident[:, 1] = 0
    numbers = [incident, outgoing, brdf.values]
    if brdf.errors is not None:
        header += [f"error {name}" for name in brdf.channels]
        numbers.append(brdf.errors)
    with atomically(Path(path)) as part:
        digits = ["%.11g"] * len(ANGLES) + ["%.9g"] * (len(header) - len(ANGLES))
        np.savetxt(part, np.concatenate(numbers, axis=1), digits, ",", header=",".join(header), comments="")


def _read(path: Path) -> _Table:
    """Header and numbers; a line that begins with # is a comment. Raises ParameterError."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            line = next((line for line in file if line.strip() and not line.startswith("#")), "")
            delimiter = max(",;\t", key=line.count)
            delimiter = delimiter if delimiter in line else " "
            header = next(csv.reader([line.strip()], delimiter=delimiter, skipinitialspace=True), [])
            read = csv.reader(file, delimiter=delimiter, skipinitialspace=True)
            if not header:
                raise ParameterError("it has no header")
            rows = _rows(read, len(header), delimiter == ";")
            numbers: Any = np.fromiter(rows, dtype=np.dtype((np.float64, (len(header),))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(f"it is no table ({error})") from error
    if not len(numbers):
        raise ParameterError("it has a header, and no rows")
    return _Table([name.strip() for name in header], numbers)


def _rows(read: Iterable[list[str]], width: int, comma: bool) -> Iterable[tuple[float, ...]]:
    """Numbers row by row, NaN for cells that hold no number; raises ParameterError for rows of another width."""
    for n, row in enumerate(read, start=1):
        if not row or row[0].startswith("#"):
            continue
        if len(row) != width:
            raise ParameterError(f"row {n} has {len(row)} cells, and the header {width}")
        yield tuple(_number(cell.replace(",", ".") if comma else cell) for cell in row)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _plain(name: str) -> str:
    """A column's name without units and signs: "Theta_i [deg]" is "thetai"."""
    name = re.sub(r"\[.*?\]|\(.*?\)|[_ ](deg|rad|degrees|radians|nm|um|µm)$", "", name.strip().lower())
    return re.sub(r"[^\w]|_", "", name)


def _columns(header: list[str], given: Mapping[str, str]) -> dict[str, Any]:
    """Where each quantity is: an index; those of ``values`` and ``errors`` by channel. Raises ParameterError."""
    for name, column in given.items():
        if name not in NAMES:
            raise UnknownNameError("quantity", name, list(NAMES))
        if column not in header:
            raise UnknownNameError("column", column, header)
    plain = [_plain(name) for name in header]
    found: dict[str, Any] = {}
    for name, known in NAMES.items():
        if name in given:
            found[name] = header.index(given[name])
        elif (guess := next((plain.index(one) for one in known if one in plain), None)) is not None:
            found[name] = guess
    for name in ("theta_i", "theta_o", "phi_o"):
        if name not in found:
            raise ParameterError(f"no column looks like {name}; it has {', '.join(header)}. Name it by columns")
    if len({at for name, at in found.items() if name in ANGLES}) < sum(name in found for name in ANGLES):
        raise ParameterError("two angles are the same column")
    found["values"], found["errors"] = _channels(header, plain, found)
    return found


def _channels(header: list[str], plain: list[str], found: dict[str, Any]) -> tuple[dict[str, int], dict[str, int]]:
    """Columns of values and of errors, by channel."""
    bare = [re.sub(r"^(error|sigma|std|stderr)(?=.)", "", name) for name in plain]
    chosen: dict[bool, dict[str, int]] = {}
    for of_errors in (False, True):
        places = {one: k for k, one in enumerate(bare) if (one != plain[k]) == of_errors}
        rgb = next(([places[c] for c in names] for names in RGB if all(c in places for c in names)), None)
        waves = {one: k for one, k in places.items() if re.fullmatch(r"(f|brdf)?\d+(nm)?", one)}
        if rgb:
            chosen[of_errors] = dict(zip(("R", "G", "B"), rgb))
        elif waves:
            chosen[of_errors] = {f"{_wavelength(header[k]):g} nm": k for k in waves.values()}
        else:
            chosen[of_errors] = {}
    name = "error" if "error" in found else None
    if "value" in found and ("wavelength" in found or not chosen[False]):
        return {"Y": found["value"]}, {"Y": found[name]} if name else {}
    if not chosen[False]:
        raise ParameterError(f"no column looks like value; it has {', '.join(header)}. Name it by columns")
    return chosen[False], chosen[True] if chosen[True].keys() == chosen[False].keys() else {}


def _wavelength(name: str) -> float:
    """The one in the name of a column."""
    return float(re.findall(r"\d+\.?\d*", name)[-1])


def _angles(
    header: list[str], found: Mapping[str, Any], names: Mapping[str, Array], degrees: bool | None
) -> dict[str, Array]:
    """All four angles in degrees, by name; raises ParameterError if one is missing in a row, or out of range."""
    for name in (*ANGLES, "wavelength"):
        if name in names and len(wrong := np.flatnonzero(~np.isfinite(names[name]))):
            raise ParameterError(f"{name} (column {header[found[name]]!r}) is no number in row {wrong[0] + 1}")
    if degrees is None:
        told = " ".join(header[found[name]].lower() for name in ANGLES if name in found)
        small = max(np.abs(names[name]).max() for name in ("theta_i", "theta_o")) <= 1.6
        degrees = True if re.search(r"deg|°", told) else False if re.search(r"\brad|_rad", told) else not small
    scale = 1.0 if degrees else 180 / np.pi
    rows = len(names["theta_i"])
    angles = {name: names[name] * scale if name in names else np.zeros(rows) for name in ANGLES}
    for name in ANGLES:
        most = 180.0 if name.startswith("theta") else 720.0
        if np.abs(angles[name]).max() > most:
            raise ParameterError(f"{name} is {np.abs(angles[name]).max():.4g} degrees: expected at most {most:g}")
    return angles


def _directions(theta: Array, phi: Array) -> Array:
    """Unit vectors of angles in degrees; a negative θ is on the other side."""
    theta, phi = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def _values(table: _Table, found: Mapping[str, Any]) -> tuple[Array, Array | None, tuple[str, ...]]:
    """Values and errors (rows, channels), and the channels; raises ParameterError if a number is infinite."""
    channels = tuple(found["values"])
    values = table.numbers[:, list(found["values"].values())]
    errors = table.numbers[:, list(found["errors"].values())] if found["errors"] else None
    for name, numbers in (("value", values), ("error", errors)):
        if numbers is not None and (np.abs(numbers) > 1e30).any():
            row = int(np.flatnonzero((np.abs(numbers) > 1e30).any(axis=1))[0]) + 1
            raise ParameterError(f"{name} in row {row} is {np.abs(numbers[row - 1]).max():.3g}")
    if errors is not None and not (np.isfinite(errors) & (errors >= 0)).all():
        raise ParameterError("errors are missing, or below 0, in some rows")
    return values, errors, channels


def _together(angles: Array, wavelength: Array, rows: Any) -> tuple[Any, tuple[str, ...], int]:
    """Rows (pairs, wavelengths) of the same directions, names of the wavelengths, and how many pairs lack one.

    What was measured several times is several pairs: the first of each wavelength, the second, and so on.
    """
    nm = wavelength * (1000 if wavelength.max() < MICRO else 1)
    waves, which = np.unique(np.round(nm[rows], 3), return_inverse=True)
    if not len(rows) or waves[0] <= 0:
        raise ParameterError("wavelengths have to be above 0, and have values")
    _, pair = np.unique(np.round(angles[rows] / SAME), axis=0, return_inverse=True)
    order = np.lexsort((np.arange(len(rows)), which, pair.ravel()))
    key = pair.ravel()[order] * len(waves) + which[order]
    start = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    repeat = np.arange(len(key)) - np.repeat(start, np.diff(np.r_[start, len(key)]))
    place = np.unique(np.stack([pair.ravel()[order], repeat], axis=1), axis=0, return_inverse=True)[1].ravel()
    found = np.full((place.max() + 1, len(waves)), -1)
    found[place, which[order]] = rows[order]
    whole = (found >= 0).all(axis=1)
    return found[whole], tuple(f"{wave:g} nm" for wave in waves), int((~whole).sum())
