"""Which Mitsuba variant a command runs in."""

from __future__ import annotations

from typing import Annotated

import typer

from asperity import llvm
from asperity.errors import ParameterError, UnknownNameError

Variant = Annotated[
    str | None,
    typer.Option("--variant", "-m", help="Mitsuba variant; llvm_ad_rgb if LLVM works, else scalar_rgb."),
]


def choose(variant: str | None) -> None:
    """Set the variant that was asked for, or the fastest that works on any machine."""
    import drjit as dr
    import mitsuba as mi

    if variant is not None and variant not in mi.variants():
        raise UnknownNameError("variant", variant, mi.variants())
    if variant is not None and variant.startswith("cuda_") and not dr.has_backend(dr.JitBackend.CUDA):
        raise ParameterError(f"--variant {variant}: Dr.Jit finds no NVIDIA GPU. `asperity doctor` shows what works.")
    llvm.guard(variant)  # whose message knows the cure
    mi.set_variant(variant or working())
    mi.set_log_level(mi.LogLevel.Error)


def working() -> str:
    """``llvm_ad_rgb``, unless LLVM is missing or too old."""
    if (problem := llvm.complaint()) is None:
        return "llvm_ad_rgb"
    typer.echo(f"warning: this is very slow (scalar_rgb). {problem}", err=True)
    return "scalar_rgb"
