"""`validate`, from Python: with papers of claims that need no tracing."""

import pytest

from asperity import validation
from asperity.errors import UnknownNameError
from asperity.validation.report import Finding, Section


@pytest.fixture
def paper(monkeypatch):
    """Two sections; the second does not come if somebody wants to stop."""

    def first(effort):
        return Section("first", f"{effort.paths:g} paths, seed {effort.seed}", [Finding("claim", "1", "2", True)])

    def second(effort):
        effort.tick()
        return Section("second", "", [Finding("claim", "3", "2", False)])

    monkeypatch.setitem(validation.PAPERS, "micrograin", {"first": first, "second": second})


@pytest.mark.parametrize(("quick", "paths"), [(True, "400000 paths"), (False, "4e+06 paths")])
def test_a_report(paper, tmp_path, quick, paths):
    """Written after each section, with the pictures and the numbers that are there."""
    seen = []
    report = validation.validate(
        "micrograin", tmp_path / "a" / "b", quick=quick, seed=3, done=lambda _: seen.append(report_in(tmp_path))
    )
    assert [section.title for section in report.sections] == ["first", "second"]
    assert report.finished and not report.passed and report.path.read_text() == report_in(tmp_path)
    assert "Not finished" in seen[0] and "second" not in seen[0] and f"{paths}, seed 3" in seen[0]
    assert "Not finished" not in report_in(tmp_path) and ("--quick" in report_in(tmp_path)) is quick


def report_in(folder):
    return (folder / "a" / "b" / "report.md").read_text()


def test_what_is_stopped_has_not_passed(paper, tmp_path):
    report = validation.validate("micrograin", tmp_path, stop=lambda: True)
    assert [section.title for section in report.sections] == ["first"]
    assert not (report.finished or report.passed) and "Stopped early" in report.path.read_text()


def test_an_unknown_model(tmp_path):
    with pytest.raises(UnknownNameError, match="'micrograin'"):
        validation.validate("micrograins", tmp_path / "report")
    assert not list(tmp_path.iterdir())
