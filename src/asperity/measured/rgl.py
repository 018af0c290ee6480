"""RGL's ``.bsdf``: J. Dupuy and W. Jakob, An Adaptive Parameterization for Efficient Material Acquisition, 2018.

Values are those that Mitsuba's plugin ``measured`` has where the file has its own: for each direction of incidence, at
the vertices of the table of ``spectra`` (or ``rgb``), which the plugin spreads over half vectors m by drawing them from
the table ``vndf``; at θ_i = 0, which has no azimuth, they lie elsewhere. In between the plugin interpolates; what is
rendered agrees with what is read here. Values below 0, which published files have, are kept.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .. import loading
from ..errors import ParameterError
from ..lab import evaluate
from .brdf import BRDF, Array
from .files import reading

FORMATS = (".bsdf",)
LEAST = 1e-3
"""Cosines of directions that are kept are larger: f is f cosθ divided by them, in single precision."""


def load(path: str | Path) -> BRDF:
    """The values of a file; a variant of Mitsuba with its channels has to be set, RGB or spectral.

    Raises UnreadableFileError, and ParameterError in another variant.
    """
    import mitsuba as mi

    evaluate.require_arrays("reading the values of a .bsdf")
    with reading(path, FORMATS) as path:
        fields = loading.tensors(path)
        channels = _checked(fields)
    if mi.is_spectral != (channels[0] != "R") or mi.is_monochromatic:
        suited = "rgb" if channels[0] == "R" else "spectral"
        raise ParameterError(f"variant {mi.variant()}: {path} needs one with its channels, such as llvm_ad_{suited}.")
    with reading(path, FORMATS) as path:
        bsdf = evaluate.load({"type": "measured", "filename": str(path.resolve())})
        wi, wo = _vertices(fields)
        above = (wi[:, 2] > LEAST) & (wo[:, 2] > LEAST)
        wavelengths = None if channels[0] == "R" else [float(name.split()[0]) for name in channels]
        values = evaluate.spectra(bsdf, wi[above], wo[above], wavelengths).T / wo[above, 2:]
        told = (
            bytes(fields["description"].astype(np.uint8)).decode("utf-8", "replace") if "description" in fields else ""
        )
        return BRDF(
            wi[above],
            wo[above],
            values,
            channels,
            isotropic=len(fields["phi_i"]) <= 2,
            source=" ".join(told.split()) or path.stem,
            left_out={"below the horizon": int((~above).sum())} if not above.all() else {},
        )


def _checked(fields: dict[str, Any]) -> tuple[str, ...]:
    """Names of the channels; raises ParameterError if tables are missing, or do not go together."""
    name = "rgb" if "rgb" in fields else "spectra"
    needed = ["phi_i", "theta_i", "sigma", "ndf", "vndf", "luminance", "jacobian", name]
    needed += ["wavelengths"] * (name == "spectra")
    if missing := [one for one in needed if one not in fields]:
        raise ParameterError(f"its {missing[0]!r} is missing")
    dimensions = {"phi_i": 1, "theta_i": 1, "wavelengths": 1, "sigma": 2, "ndf": 2, "vndf": 4, "luminance": 4, name: 5}
    if fields["jacobian"].shape != (1,) or fields["jacobian"].dtype != np.uint8:
        raise ParameterError(f"its 'jacobian' is of shape {fields['jacobian'].shape}, not one byte")
    for one, count in dimensions.items():
        if one in needed and (fields[one].ndim != count or not fields[one].size or fields[one].dtype != np.float32):
            raise ParameterError(f"its {one!r} is of shape {fields[one].shape} and type {fields[one].dtype}")
    directions = (len(fields["phi_i"]), len(fields["theta_i"]))
    count = 3 if name == "rgb" else len(fields["wavelengths"])
    for one in ("vndf", "luminance", name):
        if fields[one].shape[:2] != directions or min(fields[one].shape[-2:]) < 2:
            raise ParameterError(f"its {one!r} is of shape {fields[one].shape}, with {directions} angles of incidence")
    if fields[name].shape[2] != count:
        raise ParameterError(f"its {name!r} has {fields[name].shape[2]} channels, not {count}")
    if not (np.abs(fields["theta_i"]) <= np.pi / 2 + 0.01).all() or not (np.abs(fields["phi_i"]) < 10).all():
        raise ParameterError("its angles of incidence are out of range")
    return ("R", "G", "B") if name == "rgb" else tuple(f"{nm:g} nm" for nm in fields["wavelengths"])


def _vertices(fields: dict[str, Any]) -> tuple[Array, Array]:
    """``wi`` and ``wo`` (n, 3) of all vertices, some below the surface; as the plugin spreads them."""
    import mitsuba as mi

    phi_i, theta_i = (fields[name].astype(np.float64) for name in ("phi_i", "theta_i"))
    rows, columns = fields["rgb" if "rgb" in fields else "spectra"].shape[-2:]
    warp = mi.MarginalContinuous2D2(fields["vndf"], [fields["phi_i"].tolist(), fields["theta_i"].tolist()], True)
    v = np.linspace(0, 1, rows), np.linspace(0, 1, columns)
    phi, theta, y, x = (a.ravel() for a in np.meshgrid(phi_i, theta_i, *v, indexing="ij"))
    place, incident = ([mi.Float(a.astype(np.float32)) for a in pair] for pair in ((x, y), (phi, theta)))
    drawn, _ = warp.sample(mi.Point2f(*place), incident)
    u = np.array(drawn, dtype=np.float64)
    theta_m, phi_m = u[0] ** 2 * np.pi / 2, (2 * u[1] - 1) * np.pi
    phi_m = phi_m + phi if len(phi_i) <= 2 else phi_m
    wi, m = (_directions(*angles) for angles in ((theta, phi), (theta_m, phi_m)))
    return wi, 2 * (wi * m).sum(axis=1, keepdims=True) * m - wi


def _directions(theta: Array, phi: Array) -> Array:
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
