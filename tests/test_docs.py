"""The documentation says what the code says."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
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


def test_readme_begins_with_a_picture_and_two_commands():
    readme = (ROOT / "README.md").read_text()
    commands = re.findall(r"^```sh\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)
    assert [len(block.strip().splitlines()) for block in commands] == [1, 1]
    picture = re.search(r"!\[.*?\]\((.*?)\)", readme)
    assert picture.start() < readme.index("```sh") and (ROOT / picture[1]).is_file()
