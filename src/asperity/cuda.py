"""What Dr.Jit must not do on NVIDIA GPUs."""

from __future__ import annotations

import drjit as dr


def guard(variant: str) -> None:
    """Keep Dr.Jit 1.5 from spilling registers to shared memory, in the CUDA variants.

    With drivers of CUDA 13, ptxas refuses that in kernels that call functions ("Smem spilling should not be enabled
    when functions use abi"), and Dr.Jit aborts the process: at derivatives through pointers to BSDFs, first of all.
    Dr.Jit's flags are a thread's own: another thread that computes in a CUDA variant has to call this, too.
    """
    if variant.startswith("cuda_"):
        dr.set_flag(dr.JitFlag.SpillToSharedMemory, False)
