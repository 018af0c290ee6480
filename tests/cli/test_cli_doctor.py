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
    assert "LLVM 15" in result.output and f"DRJIT_LIBLLVM_PATH is '{OLD}': unset it" in result.output


def test_an_llvm_that_is_not_there(asperity, monkeypatch):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/none/libLLVM.so")
    result = asperity("doctor")
    assert result.exit_code == 1
    assert "/none/libLLVM.so (your choice; No such file or directory)" in result.output
    assert "DRJIT_LIBLLVM_PATH is '/none/libLLVM.so': unset it" in result.output


def test_an_llvm_that_is_damaged(tmp_path, monkeypatch):
    (tmp_path / "libLLVM.so.99").write_text("half a downl")
    monkeypatch.setattr(llvm, "candidates", lambda: [tmp_path / "libLLVM.so.99", OLD])
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(OLD))
    assert doctor.libraries()["unusable"] == f"{tmp_path}/libLLVM.so.99: it is no 64-bit library"


def test_one_core(monkeypatch):
    monkeypatch.setattr(doctor.os, "sched_getaffinity", lambda _: {3}, raising=False)
    assert "waits for ever" in doctor.cores()["cores"]


def test_a_child_that_dies(tmp_path, monkeypatch):
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\necho Cannot select: fminimum >&2\nkill -ABRT $$\n")
    python.chmod(0o755)
    monkeypatch.setattr(doctor.sys, "executable", str(python))
    assert doctor.attempt("llvm_ad_rgb") == (False, "aborts (SIGABRT): Cannot select: fminimum")
