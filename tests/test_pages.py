"""The site: what it says of the code comes from the code, and what it tells a reader to do works."""

import importlib
import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from asperity import loading
from asperity.cli import COMMANDS, app
from asperity.models import MODELS
from asperity.scenes import presets

DOCS = Path(__file__).parents[1] / "docs"
sys.path.insert(0, str(DOCS))
import pages  # noqa: E402

SMALL = {
    "render": ["--size", "16", "--spp", "1"],
    "check": ["--only", "finiteness"],
    "measure": ["--paths", "1e4", "--tiles", "2"],
    "compare": ["--no-preview"],
}
"""Makes a command fast: the last of an option's values counts."""


def blocks(page):
    """What stands between fences, with its language and the file that the text before names last."""
    end = 0
    for block in re.finditer(r"^```(\w*)\n(.*?)^```$", page, re.MULTILINE | re.DOTALL):
        named = re.findall(r"`([\w-]+\.(?:json|xml))`", page[end : block.start()])
        end = block.end()
        yield block[1], block[2], named[-1] if named else None


def run(line):
    """A command of a page, in little time."""
    line, _, target = line.partition(" > ")
    name, *arguments = shlex.split(line)[1:]
    result = CliRunner().invoke(app, [name, *arguments, *SMALL.get(name, ())])
    assert result.exit_code == 0, (line, result.output)
    if target:
        Path(target).write_text(result.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["start", "checks", "plotting", "goniophotometer"])
def test_a_page_can_be_followed(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for language, text, file in blocks((DOCS / f"{name}.md").read_text()):
        if language in ("json", "xml"):
            Path(file).write_text(text)
        elif language == "python":
            exec(text, names)
        elif language == "sh":
            for line in text.splitlines():
                run(line)


@pytest.mark.parametrize(
    "path", [*(DOCS / f"{name}.md" for name in MODELS), DOCS.parent / "README.md"], ids=lambda path: path.stem
)
def test_materials_of_a_page_load(path, rgb):
    for language, text, _ in blocks(path.read_text()):
        if language == "python" and text.startswith("{"):
            loading.load(eval(text))
        elif language == "python":
            exec(text, {})


def test_the_page_of_commands_has_all_commands_and_options():
    from typer.main import get_command

    page = pages.commands()
    assert re.findall(r"^## (.*)$", page, re.MULTILINE) == list(COMMANDS)
    options = {
        option for command in get_command(app).commands.values() for one in command.params for option in one.opts
    }
    assert {option for option in options if option.startswith("-") and f"`{option}" not in page} == {
        "--help",
        "-h",
    } & options


def test_the_page_of_checks_has_all_checks_in_their_order():
    from asperity.lab.checks import NAMES

    assert re.findall(r"^\| `(.*?)` \|", (DOCS / "checks.md").read_text(), re.MULTILINE) == list(NAMES)


PAPERS = sorted(path.stem for path in (DOCS / "papers").glob("*.md") if path.stem != "index")


@pytest.mark.parametrize("name", PAPERS)
def test_evidence_exists(name):
    """Tests by the names that tables give, and what they call by module and name."""
    page = (DOCS / "papers" / f"{name}.md").read_text()
    tests = {
        found
        for path in DOCS.parent.rglob("tests/**/test_*.py")
        for found in re.findall(r"^def (test_\w+)", path.read_text(), re.M)
    }
    assert set(re.findall(r"`(test_\w+)`", page)) - tests == set()
    for module, function in re.findall(r"`([a-z]\w*)\.([A-Za-z]\w*)`", page):
        if function != "py":
            assert hasattr(importlib.import_module(f"asperity.models.{name}.{module}"), function), (module, function)


def test_every_paper_has_its_page():
    from asperity.models import with_microgeometry

    assert {"twoscale", *with_microgeometry()} - set(PAPERS) == set()


def test_the_gallery_has_all_presets_and_pictures_that_exist():
    page = pages.gallery()
    assert set(re.findall(r"^\(preset-(.*)\)=$", page, re.MULTILINE)) == set(presets.names())
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", page)
    assert [path for path in pictures if not (DOCS / pages.FOLDER / path).resolve().is_file()] == []


def test_what_did_not_change_is_not_written_again(tmp_path):
    """Else Sphinx would build every page anew."""
    pages.write(tmp_path)
    times = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    pages.write(tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == times
