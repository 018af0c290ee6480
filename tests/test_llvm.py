import os
import subprocess
import sys
from pathlib import Path

import pytest

from asperity import llvm

OLD = next((p for v in (15, 16) for p in Path("/usr/lib").glob(f"**/libLLVM-{v}.so.1")), None)


def run(code: str, **environment: str) -> subprocess.CompletedProcess:
    clean = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env={**clean, **environment}
    )


@pytest.mark.skipif(sys.platform != "linux" or os.uname().machine != "x86_64", reason="no other platform has the wheel")
def test_the_bundled_llvm_is_chosen():
    assert llvm.bundled() is not None
    result = run(
        "import asperity, mitsuba; from asperity import llvm; print(llvm.loaded_version()[0], llvm.complaint())"
    )
    assert int(result.stdout.split()[0]) >= llvm.OLDEST_WORKING and "None" in result.stdout


def test_the_users_choice_is_kept():
    assert (
        run("import asperity, os; print(os.environ['DRJIT_LIBLLVM_PATH'])", DRJIT_LIBLLVM_PATH="mine").stdout
        == "mine\n"
    )


@pytest.mark.skipif(OLD is None, reason="this machine has no old LLVM to be warned of")
@pytest.mark.parametrize("code", ["import mitsuba as mi, asperity", "import asperity, mitsuba as mi"])
def test_an_old_llvm_is_an_error_with_the_cure_never_an_abort(code):
    """With LLVM 15 the scene's first kernel would end in `Cannot select: fminimum` and SIGABRT."""
    result = run(f"{code}; mi.set_variant('llvm_ad_rgb')", DRJIT_LIBLLVM_PATH=str(OLD))
    assert result.returncode == 1 and "LLVMError: Dr.Jit loaded LLVM" in result.stderr
    assert "unset it" in result.stderr and "asperity doctor" in result.stderr


@pytest.mark.skipif(OLD is None, reason="this machine has no old LLVM to be warned of")
def test_scalar_variants_work_with_an_old_llvm():
    code = "import mitsuba as mi, asperity; mi.set_variant('scalar_rgb'); mi.load_dict({'type': 'micrograin'})"
    assert run(code, DRJIT_LIBLLVM_PATH=str(OLD)).returncode == 0
