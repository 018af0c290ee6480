"""What is done for GPUs, tested without one. On one, `python -m pytest --variant cuda_ad_rgb` runs all tests."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import pytest

from asperity import cuda


@pytest.mark.parametrize("variant, spills", [("cuda_ad_rgb", False), ("llvm_ad_rgb", True), ("scalar_rgb", True)])
def test_registers_stay_out_of_shared_memory(variant, spills):
    with dr.scoped_set_flag(dr.JitFlag.SpillToSharedMemory, True):
        cuda.guard(variant)
        assert dr.flag(dr.JitFlag.SpillToSharedMemory) is spills
