"""`asperity reproduce`, with papers of one claim."""

import signal
from functools import partial

import pytest

from asperity.reproduce.papers import PAPERS
from asperity.reproduce.results import Paper, Result
from asperity.validation.report import Finding, Section


@pytest.fixture
def papers(monkeypatch):
    """Two of them; the second one's claim may fail, or somebody stops it."""

    def section(passed, end, effort):
        if end:
            signal.raise_signal(end)
            effort.tick()
        return Section("measured", "", [Finding("claim", f"{effort.paths:g}", "", passed)])

    def put(passed=True, end=None):
        for name in list(PAPERS):
            monkeypatch.delitem(PAPERS, name)
        for name, verdict, signal_ in (("micrograin", True, None), ("vgroove", passed, end)):
            result = Result("Fig. 1", "a curve", "It is right.", "only", "Nowhere.")
            sections = {"only": partial(section, verdict, signal_)}
            monkeypatch.setitem(PAPERS, name, Paper(name, sections, [result], []))

    return put


@pytest.mark.parametrize("passed", [True, False])
def test_pages_and_exit_code(asperity, papers, tmp_path, passed):
    papers(passed)
    result = asperity("reproduce", "--quick")
    assert result.exit_code == (not passed) and ("failed" in result.stdout) is not passed
    pages = tmp_path / "reproduction"
    assert "micrograin.md" in (pages / "index.md").read_text() and "400000" in (pages / "vgroove.md").read_text()
    assert "micrograin: measured" in result.stderr and not list(tmp_path.rglob(".*"))


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_it_stops_and_goes_on(asperity, papers, tmp_path, end):
    papers(end=end)
    result = asperity("reproduce", "-o", "pages")
    assert result.exit_code == 1 and "stopped early" in result.stdout and (tmp_path / "pages" / "micrograin").is_dir()
    papers()
    result = asperity("reproduce", "-o", "pages")
    assert result.exit_code == 0 and "not made yet" not in (tmp_path / "pages" / "vgroove.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("lukas",), "unknown paper 'lukas'. Did you mean 'Lucas'?"),
        (("--only", "Fig. 1"), "--only"),
        (("lee", "--only", "Fig. 2"), "Did you mean 'Fig. 1'?"),
        (("lee", "-o", "no/such/folder"), "cannot write into the folder 'no/such'"),
        (("lee", "-o", "file"), "-o file: it is a file"),
    ],
)
def test_what_is_wrong_is_told(asperity, papers, tmp_path, arguments, message):
    papers()
    (tmp_path / "file").write_text("mine")
    result = asperity("reproduce", *arguments)
    assert result.exit_code == 2 and message in result.stderr
    assert (tmp_path / "file").read_text() == "mine" and {path.name for path in tmp_path.iterdir()} == {"file"}


def test_another_effort_needs_force(asperity, papers):
    papers()
    assert asperity("reproduce", "lee", "--quick").exit_code == 0
    result = asperity("reproduce", "lee")
    assert result.exit_code == 2 and "was made with paths 400000" in result.stderr and "--force" in result.stderr
    assert asperity("reproduce", "lee", "--force").exit_code == 0
