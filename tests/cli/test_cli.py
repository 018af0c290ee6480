import re
import subprocess
import sys
import time

import pytest


def run(*arguments):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=60)


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
