"""`asperity validate`, with a paper of one claim: the papers' own are in tests/validation."""

import inspect
import signal
from functools import partial

import mitsuba as mi
import pytest

from asperity import validation
from asperity.validation.report import Effort, Finding, Section


def paper(*verdicts, interrupt=False):
    """Sections of one claim each; Ctrl-C comes while the first is measured."""

    def section(n, passed, effort):
        if interrupt and n == 0:
            signal.raise_signal(signal.SIGINT)
        return Section(f"section {n}", "", [Finding(f"claim {n}", f"{effort.paths:g}", "", passed)])

    return {str(n): partial(section, n, passed) for n, passed in enumerate(verdicts)}


@pytest.mark.parametrize(("verdicts", "code"), [((True, None), 0), ((True, False), 1)])
def test_report_and_exit_code(asperity, tmp_path, monkeypatch, verdicts, code):
    monkeypatch.setitem(validation.PAPERS, "micrograin", paper(*verdicts))
    result = asperity("validate", "micrograin", "--quick", "-o", "report")
    text = (tmp_path / "report" / "report.md").read_text()
    assert result.exit_code == code and "claim 1 | 400000" in text and ("**failed**" in text) == bool(code)


def test_ctrl_c_keeps_what_was_measured(asperity, tmp_path, monkeypatch):
    monkeypatch.setitem(validation.PAPERS, "micrograin", paper(True, True, interrupt=True))
    result = asperity("validate", "micrograin")
    text = (tmp_path / "asperity-validate-micrograin" / "report.md").read_text()
    assert result.exit_code == 1 and "Stopped early" in result.output + text
    assert "section 0" in text and "section 1" not in text


def test_an_unknown_model_and_a_file_in_the_way(asperity, tmp_path):
    assert "Did you mean 'micrograin'?" in asperity("validate", "micrograins").output
    (tmp_path / "report").write_text("mine")
    assert asperity("validate", "micrograin", "-o", "report").exit_code == 2
    assert (tmp_path / "report").read_text() == "mine"


def test_reports_are_not_overwritten(asperity, tmp_path, monkeypatch):
    monkeypatch.setitem(validation.PAPERS, "micrograin", paper(True))
    for name in ("asperity-validate-micrograin", "asperity-validate-micrograin-2"):
        assert f"{name}/report.md" in asperity("validate", "micrograin").output
    (tmp_path / "empty").mkdir()
    assert asperity("validate", "micrograin", "-o", "empty").exit_code == 0
    result = asperity("validate", "micrograin", "-o", "empty")
    assert result.exit_code == 2 and "-o empty: it exists, and is not empty" in result.stderr
    assert asperity("validate", "micrograin", "-o", "empty", "--force").exit_code == 0
    (tmp_path / "here").mkdir()
    monkeypatch.chdir("here")
    assert asperity("validate", "micrograin", "-o", ".").exit_code == 0
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_a_section_that_is_interrupted_is_left_out(asperity, tmp_path, monkeypatch, end):
    """Long before it would be done, and what was done before it is there even if it fails."""

    def first(effort):
        return Section("first", "", [Finding("claim", "1", "1", True)])

    def endless(effort):
        assert "first" in (tmp_path / "report" / "report.md").read_text()
        signal.raise_signal(end)
        while True:
            effort.tick()

    monkeypatch.setitem(validation.PAPERS, "micrograin", {"first": first, "endless": endless})
    result = asperity("validate", "micrograin", "-o", "report")
    text = (tmp_path / "report" / "report.md").read_text()
    assert result.exit_code == 1 and "Stopped early" in result.output and "Stopped early" in text and "first" in text


def sections():
    """All functions that make a section by measuring; that of the phase function takes a fifth of a second in all."""
    for module in (validation.lambertsphere, validation.micrograin, validation.vgroove):
        for name, function in vars(module).items():
            given = inspect.signature(function).parameters if inspect.isfunction(function) else {}
            if (
                name != "phase_function"
                and {"effort", "tick"} & given.keys()
                and inspect.signature(function).return_annotation == "Section"
            ):
                yield pytest.param(function, given, id=f"{module.__name__.rpartition('.')[2]}-{name}")


@pytest.mark.parametrize("section, given", list(sections()))
@pytest.mark.filterwarnings("ignore:theta = 38")  # spheres far apart
def test_every_section_can_be_interrupted(section, given):
    class StopError(Exception):
        pass

    def tick(*_):
        raise StopError

    mi.set_variant("llvm_ad_rgb")
    known = {
        "figure": "7",
        "kind": "",
        "material": {},
        "tolerance": 0,
        "effort": Effort(3200, 32, 0, tick),
        "tick": tick,
    }
    with pytest.raises(StopError):
        section(**{name: value for name, value in known.items() if name in given})
