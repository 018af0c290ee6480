from pathlib import Path

import pytest

from asperity import llvm
from asperity.cli import doctor

OLD = Path("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")


def test_a_healthy_machine(asperity):
    result = asperity("doctor")
    assert result.exit_code == 0, result.output
    assert "mitsuba" in result.output and "asperity's choice" in result.output
    assert "LLVM " + ".".join(map(str, llvm.loaded_version() or ("",))) in result.output


@pytest.mark.skipif(not OLD.exists(), reason="needs an LLVM that is too old")
def test_an_llvm_that_aborts(asperity, monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(OLD))
    result = asperity("doctor")
    assert result.exit_code == 1
    assert "LLVM 15" in result.output and "Unset DRJIT_LIBLLVM_PATH" in result.output


def test_an_llvm_that_is_not_there(asperity, monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/none/libLLVM.so")
    result = asperity("doctor")
    assert result.exit_code == 1
    assert "/none/libLLVM.so (your choice; there is no such file)" in result.output
    assert "Unset DRJIT_LIBLLVM_PATH" in result.output


def test_a_child_that_dies(tmp_path, monkeypatch):
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho Cannot select: fminimum >&2\nkill -ABRT $$\n")
    python.chmod(0o755)
    monkeypatch.setattr(doctor.sys, "executable", str(python))
    assert doctor.attempt("llvm_ad_rgb") == (False, "aborts (SIGABRT): Cannot select: fminimum")
