import os
import re
import subprocess
import sys
import time

import pytest

from asperity.cli import COMMANDS


def run(*arguments, encoding="utf-8", **environment):
    command = [sys.executable, *arguments]
    environment = {**os.environ, **environment}
    return subprocess.run(command, capture_output=True, encoding=encoding, timeout=60, env=environment)


def test_help_is_fast_and_imports_nothing_heavy():
    code = "import sys; from asperity.cli import app; app(['--help'], standalone_mode=False); print(*sys.modules)"
    times = []
    for _ in range(3):
        start = time.perf_counter()
        result = run("-c", code)
        times.append(time.perf_counter() - start)
    assert "render" in result.stdout
    heavy = {"mitsuba", "drjit", "numpy", "scipy", "matplotlib"}
    assert not heavy & set(result.stdout.split())
    assert min(times) < 1  # 0.25 s on an idle machine


def test_python_m_asperity():
    assert re.fullmatch(r"asperity \d+\.\d+\.\d+\n", run("-m", "asperity", "--version").stdout)


@pytest.mark.parametrize("command", [("list",), ("show", "micrograin"), ("cite", "micrograin")])
def test_works_in_a_fresh_process_without_a_variant(command):
    result = run("-m", "asperity", *command)
    assert result.returncode == 0
    assert "icrograin" in result.stdout


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS)], ids=["asperity", *COMMANDS])
def test_h_is_help(asperity, command):
    short, long = asperity(*command, "-h"), asperity(*command, "--help")
    assert short.exit_code == 0 and short.output == long.output and "Usage" in short.output


@pytest.mark.parametrize("command", [("list",), ("measure", "--help"), ("render", "--preset", "ψ")], ids=" ".join)
def test_a_terminal_without_greek(command):
    """Windows' cp1252; and there the words of a table can still be told from each other."""
    result = run("-m", "asperity", *command, encoding="cp1252", PYTHONIOENCODING="cp1252")
    assert "Traceback" not in result.stderr and result.returncode == 2 * ("ψ" in command)
    assert ("ψ" not in command) or "'psi'" in result.stderr


def test_show_json_can_be_rendered_from_anywhere(asperity, tmp_path):
    from asperity.scenes import presets

    (tmp_path / "elsewhere").mkdir()
    for name in presets.names():
        file = tmp_path / "elsewhere" / f"{name}.json"
        file.write_text(asperity("show", name, "--json").stdout)
        again, before = presets.read(file)._asdict(), presets.load(name)._asdict()
        assert repr(again) == repr(before)  # Dr.Jit compares matrices by element
    result = asperity("render", "--material", f"elsewhere/{presets.DEFAULT}.json", "--size", "8", "--spp", "1")
    assert result.exit_code == 0, result.output


def test_show_tells_of_presets_and_textures(asperity):
    assert '"type": "micrograin"' in asperity("show", "gilded").output
    assert "softness" in asperity("show", "settled").output


def test_list_names_every_preset(asperity):
    from asperity.scenes import presets

    output = asperity("list").output
    assert all(name in output for name in ("micrograin", *presets.names()))


def test_show_has_a_row_for_every_parameter(asperity):
    from asperity.cli.registry import models

    output = asperity("show", "micrograin").output
    assert all(f" {row.name} " in output for row in models()["micrograin"].rows())


def test_cite_prints_bibtex_and_nothing_else(asperity):
    from asperity.cli.registry import models

    assert asperity("cite", "micrograin").stdout == models()["micrograin"].citation + "\n"
    assert all(model.citation in asperity("cite").stdout for model in models().values())


@pytest.mark.parametrize("command", ["show", "cite"])
def test_unknown_model(asperity, command):
    result = asperity(command, "micrgrain")
    assert result.exit_code == 2
    assert "Did you mean 'micrograin'?" in result.stderr
