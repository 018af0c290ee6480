"""The documentation says what the code says."""

import ast
import importlib.util
import json
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "asperity"
TOP = {path.stem for path in PACKAGE.iterdir()}
spec = importlib.util.spec_from_file_location("build", ROOT / "docs" / "build.py")
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)


def models():
    import asperity  # noqa: F401
    from asperity.models import MODELS

    return MODELS


@pytest.mark.parametrize("name", models())
def test_parameter_tables_are_those_of_the_code(name):
    page = (ROOT / "docs" / f"{name}.md").read_text()
    assert build.with_table(page, models()[name]) == page, "run `python docs/build.py`"


@pytest.mark.parametrize("name", models())
def test_sweeps_are_those_of_the_pictures(name):
    page = (ROOT / "docs" / f"{name}.md").read_text()
    assert build.with_sweeps(page, name) == page, "run `python docs/build.py --pictures`"
    assert [path for path in re.findall(r"\]\((pictures/.*?)\)", page) if not (ROOT / "docs" / path).is_file()] == []


PAGES = {path.stem: path.read_text() for path in (ROOT / "docs").glob("*.md")}


@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if build.BEGIN_SPEED in page])
def test_speed_tables_are_those_of_the_benchmark(name):
    report = json.loads(build.SPEED.read_text())  # by `asperity bench --json docs/speed.json --force`
    assert build.with_speed(PAGES[name], name, report) == PAGES[name], "run `python docs/build.py`"


def test_all_models_are_timed_and_have_a_table_of_it():
    from asperity import peers

    timed = {peers.model_of(name) for group in peers.groups() for name in group} & models().keys()
    assert timed == models().keys() == {name for name, page in PAGES.items() if build.BEGIN_SPEED in page}


def test_costs_are_those_of_the_benchmark():
    report = json.loads(build.SPEED.read_text())
    assert build.with_costs(PAGES["which"], report) == PAGES["which"], "run `python docs/build.py`"


@pytest.mark.slow
def test_light_that_is_kept_is_what_the_page_says():
    """Two digits are printed; the means of the samples have standard errors of .001."""
    table = PAGES["which"].split(build.BEGIN_KEPT)[1].split(build.END_KEPT)[0]
    rows = re.findall(r"^\| .*? \| ([\d. |]+) \|$", table, re.MULTILINE)
    assert np.allclose([[float(x) for x in row.split("|")] for row in rows], build.kept(), rtol=0, atol=0.01)


def test_readme_begins_with_a_picture_and_two_commands():
    readme = (ROOT / "README.md").read_text()
    commands = re.findall(r"^```sh\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)
    assert [len(block.strip().splitlines()) for block in commands] == [1, 1]
    picture = re.search(r"!\[.*?\]\((.*?)\)", readme)
    assert picture.start() < readme.index("```sh") and (ROOT / picture[1]).is_file()


def blocks(page):
    """What stands between fences in a page, with its language."""
    return re.findall(r"^```(\w*)\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def tree():
    """The paths that the architecture page names, with what it says of each."""
    lines = next(text for _, text in blocks("docs/architecture.md") if text.startswith("src/")).splitlines()
    folders, found = [], {}
    for line in lines:
        depth, (name, meaning) = (len(line) - len(line.lstrip())) // 2, line.split(maxsplit=1)
        folders[depth:] = [name.strip("/")]
        found[ROOT.joinpath(*folders)] = meaning
    return found


def test_every_file_stands_in_the_tree_of_the_architecture_page():
    """Folders stand for their __init__.py; those without Python, for all that they hold."""
    named = tree()
    files = {path for path in PACKAGE.rglob("*") if path.is_file() and path.suffix != ".pyc"}
    holders = {path.parent for path in files if path.suffix == ".py"}
    missing = {path if path.parent in holders and path.name != "__init__.py" else path.parent for path in files}
    assert missing - named.keys() == set()
    assert {path for path in named if not path.exists()} == set()


def arrows():
    """Which parts of the package import which, in functions too: files at its top, and folders."""
    found = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                package = parts[: len(parts) - node.level] if node.level else ()
                names = [[*package, *(node.module or "").split("."), name.name] for name in node.names]
            else:
                names = [name.name.split(".") for name in getattr(node, "names", ()) if isinstance(node, ast.Import)]
            for name in ([part for part in name if part] for name in names):
                if name[0] == "asperity":
                    found[parts[1]].add(next((part for part in name[1:2] if part in TOP), "__init__"))
    return {part: targets - {part} for part, targets in found.items()}


def test_arrows_are_those_of_the_architecture_page_and_point_down():
    text = next(text for _, text in blocks("docs/architecture.md") if "->" in text)
    drawn = {part: set(re.findall(r"\w+", targets)) for part, targets in re.findall(r"(\w+) +->(.*)", text)}
    floors, found = list(drawn), arrows()
    assert drawn == {part: found.get(part, set()) for part in floors} and found.keys() <= drawn.keys()
    assert [(a, b) for a in floors for b in drawn[a] if floors.index(b) <= floors.index(a)] == []


def test_the_model_in_contributing_works(rgb, monkeypatch):
    """It is registered as any other, and obeys what the lab asks of any."""
    from asperity import models as registry
    from asperity import plugin
    from asperity.lab import checks

    (example,) = (text for language, text in blocks("CONTRIBUTING.md") if language == "python")
    names = {"__name__": "minnaert"}
    exec(example, names)
    monkeypatch.setitem(registry.MODELS, "minnaert", names["Minnaert"])
    plugin.register()
    only = ("chi2", "weight", "reciprocity", "bounds", "energy", "gradients")
    found = checks.check({"type": "minnaert"}, only=only, significance=1e-4)
    assert [(result.name, result.measured) for result in found if not result.passed] == []


def test_times_of_preview_frames_in_the_readme_are_those_of_the_benchmark():
    """All lie in the range that it gives, or are named with a number of their own."""
    readme = " ".join((ROOT / "README.md").read_text().split())
    words = r"takes (\S+) to (\S+) times as long .*? diffuse grains (\S+), with coated .*? (\S+) to (\S+) times"
    low, high, diffuse, least, most = map(float, re.search(words, readme).groups())
    rows = json.loads(build.SPEED.read_text())["rows"]
    ratios = {name: row["preview"]["ratio"][1] for name, row in rows.items() if row["against"] != name}
    grains = ratios.pop("micrograin, diffuse grains")
    slow = [ratios.pop(name) for name in ("micrograin, coated grains", "interfacedlambertian, anisotropic")]
    assert (round(min(ratios.values()), 2), round(max(ratios.values()), 2)) == (low, high)
    assert (round(grains, 1), round(min(slow), 1), round(max(slow), 1)) == (diffuse, least, most)
