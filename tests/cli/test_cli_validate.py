"""`asperity validate`, with a paper of one claim: the papers' own are in tests/validation."""

import signal

import pytest

from asperity import validation
from asperity.validation.report import Finding, Section


def paper(*verdicts, interrupt=False):
    """Sections of one claim each; Ctrl-C comes while the first is measured."""

    def sections(effort):
        for n, passed in enumerate(verdicts):
            if interrupt and n == 0:
                signal.raise_signal(signal.SIGINT)
            yield Section(f"section {n}", "", [Finding(f"claim {n}", f"{effort.paths:g}", "", passed)])

    return sections


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
