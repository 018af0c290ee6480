import os
import struct
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


def elf(path, sections):
    """A file that says it ends with so many sections, but ends after one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    head = b"\x7fELF\x02".ljust(40, b"\0") + struct.pack("<Q", 64)
    path.write_bytes(head.ljust(58, b"\0") + struct.pack("<HHH", 64, sections, 0) + bytes(64))


WHOLE, CUT = 1, 2
CASES = {
    "the wheel's before newer": ({"venv": {"23.1": WHOLE, "99.1": WHOLE}, "user": {"99.1": WHOLE}}, "venv", "23.1"),
    "a broken one elsewhere": ({"venv": {"23.1": WHOLE}, "user": {"99.1": CUT}}, "venv", "23.1"),
    "the wheel's is broken": ({"venv": {"23.1": CUT, "19.1": WHOLE}}, "venv", "19.1"),
    "the environment before the user": ({"venv": {"19.1": WHOLE}, "user": {"20.1": WHOLE}}, "venv", "19.1"),
    "newest": ({"venv": {"9.0": WHOLE, "100.0": WHOLE, "19.1": WHOLE}}, "venv", "100.0"),
    "too old": ({"venv": {"16.0": WHOLE}}, None, None),
    "nothing": ({}, None, None),
}


@pytest.mark.parametrize("libraries, place, number", CASES.values(), ids=CASES)
def test_which_library_is_no_chance(tmp_path, monkeypatch, libraries, place, number):
    for folder, found in libraries.items():
        for name, sections in found.items():
            elf(tmp_path / folder / "lib" / f"libLLVM.so.{name}", sections)
    packages = tmp_path / "venv" / "lib" / "python3" / "site-packages"
    record = packages / "karellen_llvm_core-23.1.dist-info" / "RECORD"
    record.parent.mkdir(parents=True)
    record.write_text("../../libLLVM.so,,\n../../libLLVM.so.23.1,sha256=x,1\n../../libLTO.so.23.1,sha256=x,1\n")
    monkeypatch.setattr(sys, "path", [str(packages)])
    monkeypatch.setattr(llvm.sysconfig, "get_path", lambda _: str(tmp_path / "venv"))
    monkeypatch.setattr(llvm.site, "ENABLE_USER_SITE", True)
    monkeypatch.setattr(llvm.site, "getuserbase", lambda: str(tmp_path / "user"))
    assert llvm.bundled() == (place and tmp_path / place / "lib" / f"libLLVM.so.{number}")


@pytest.mark.skipif(llvm.bundled() is None, reason="no other platform has the wheel")
def test_a_cut_library_is_not_loaded(tmp_path):
    """Loading it would kill the process: SIGBUS."""
    library, cut = llvm.bundled().read_bytes(), tmp_path / "libLLVM.so.99.1"
    assert llvm.flaw(llvm.bundled()) is None
    for size in (len(library) - 1, len(library) // 2, 100, 63, 0):
        cut.write_bytes(library[:size])
        assert llvm.flaw(cut)


def test_a_library_that_cannot_be_loaded_is_named(tmp_path):
    (tmp_path / "libLLVM.so").write_text("half a downl")
    code = "from asperity.cli import app; app(['render', '--variant', 'llvm_ad_rgb'])"
    result = run(code, DRJIT_LIBLLVM_PATH=str(tmp_path / "libLLVM.so"))
    assert result.returncode == 2 and "Traceback" not in result.stderr
    assert f"Dr.Jit cannot load {tmp_path}/libLLVM.so: " in result.stderr and "unset it" in result.stderr
