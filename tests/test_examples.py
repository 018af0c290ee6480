"""What the page `python` tells a reader to type, and the examples: they run, and give the numbers that they name."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
QUICK = ("slice", "dust")
LONG = {"fit_to_picture": 100}
"""Lines of those that do more than the others."""


@pytest.mark.slow
def test_the_page_of_python(tmp_path, monkeypatch, capsys, rgb, registry):
    """Every block, one after the other; what is printed stands in it as a comment."""
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs/python.md").read_text(), re.MULTILINE | re.DOTALL):
        exec(block, names)
        assert capsys.readouterr().out.splitlines() == re.findall(r"^# -> (.*)$", block, re.MULTILINE), block


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=() if path.stem in QUICK else pytest.mark.slow, id=path.stem) for path in EXAMPLES],
)
def test_examples(tmp_path, path):
    """In a process of their own: their first line decides which LLVM there is."""
    run = {"cwd": tmp_path, "env": os.environ | {"MPLBACKEND": "Agg"}, "capture_output": True, "text": True}
    result = subprocess.run([sys.executable, str(path)], timeout=300, **run)
    assert result.returncode == 0 and result.stdout.strip(), result.stderr


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short_and_assert_something(path):
    lines = path.read_text().splitlines()
    assert len(lines) < LONG.get(path.stem, 40) and any(line.startswith("assert ") for line in lines)
    assert f"| `{path.name}` |" in (ROOT / "docs/python.md").read_text()
