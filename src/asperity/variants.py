"""Which variant of Mitsuba answers a question from Python."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import mitsuba as mi

from .materials import Material

DEFAULT = "llvm_ad_rgb"


def ensure() -> str:
    """The active variant; `DEFAULT`, from now on, if there is none."""
    if mi.variant() is None:
        mi.set_variant(DEFAULT)
    return str(mi.variant())


@contextmanager
def switched(wanted: str) -> Iterator[None]:
    """That variant, for a while."""
    active = ensure()
    try:
        if wanted != active:
            mi.set_variant(wanted)
        yield
    finally:
        if wanted != active:
            mi.set_variant(active)


def of_arrays(wavelengths: bool = False) -> str:
    """The active variant, or the one like it that computes arrays, and wavelengths if they are asked for."""
    return with_channels(ensure().replace("scalar_", "llvm_ad_"), "spectral" if wavelengths else "")


def of(materials: Sequence[Material], wavelengths: bool = False) -> str:
    """The same, with the channels that measurements among the materials have."""
    modes = [material.measured.mode for material in materials if material.measured is not None]
    return with_channels(of_arrays(wavelengths), modes[0] if modes else "")


def with_channels(variant: str, mode: str) -> str:
    """A variant of ``rgb``, ``mono`` or ``spectral``; itself if it is one."""
    return variant if mode in variant else f"{variant.partition('_')[0]}_ad_{mode}"
