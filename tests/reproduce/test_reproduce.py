"""`reproduce`, from Python: with papers of claims that need no tracing, and what is said of the five."""

import json

import mitsuba as mi
import pytest

from asperity import reproduce as reproduction
from asperity.errors import ParameterError, UnknownNameError, UnreadableFileError
from asperity.reproduce import kept, page
from asperity.reproduce.papers import PAPERS
from asperity.reproduce.results import Absent, Paper, Result
from asperity.validation import figures
from asperity.validation import paper as validation_of
from asperity.validation.report import Finding, Section, Table

pytestmark = pytest.mark.usefixtures("rgb")


@pytest.fixture
def made(monkeypatch):
    """A paper of two sections, the first for two figures; what is made is listed."""
    listed = []

    def first(effort):
        listed.append("first")
        picture = figures.axes("x", "y", "")[0]
        claims = [Finding("right, a", "1", "2", True), Finding("wrong", "3", "2", False), Finding("told", "4")]
        return Section("One", "It is measured.", claims, [Table(("|x|", "y"), [(0.123456, "b")])], {"curve": picture})

    def second(effort):
        listed.append("second")
        return Section("Two", f"{effort.paths:g} paths", [Finding("all is well", "5", "6", True)])

    results = [
        Result("Fig. 1", "a curve", "It is right.", "first", "It does not.", findings=("right*",)),
        Result("Fig. 2", "a dot", "It is too.", "first", "By one.", findings=("wrong", "told"), pictures=()),
        Result("Table 1", "a table", "All is well.", "second", "Nowhere."),
    ]
    paper = Paper("vgroove", {"first": first, "second": second}, results, [Absent("Fig. 3", "a sketch", "No numbers.")])
    monkeypatch.setitem(PAPERS, "vgroove", paper)
    return listed


def test_a_page(made, tmp_path):
    found = reproduction.reproduce("Lee", tmp_path, quick=True)
    text = found.path.read_text()
    assert found.path == tmp_path / "vgroove.md" and not found.passed and not found.missing
    assert "# Lee et al. 2018" in text and "Practical Multiple Scattering for Rough Surfaces" in text
    figures = text.split("\n## ")
    assert [part.splitlines()[0] for part in figures[1:]] == [
        "Fig. 1: a curve",
        "Fig. 2: a dot",
        "Table 1: a table",
        "Not reproduced",
    ]
    assert "right, a | 1 | 2 | passed" in figures[1] and "wrong" not in figures[1]
    assert "(vgroove/curve.png)" in figures[1] and "curve.png" not in figures[2]
    assert r"| \|x\| | y |" in figures[1] and "| 0.1235 | b |" in figures[1]
    assert "1 of 1 fail" in figures[0] and "By one." in figures[2] and "**failed**" in figures[2]
    assert "asperity reproduce vgroove --quick --only 'Table 1'" in figures[3] and "No numbers." in figures[4]
    assert (tmp_path / "vgroove" / "curve.png").stat().st_size > 1000


def test_it_goes_on_where_it_was_stopped(made, tmp_path):
    early = reproduction.reproduce("vgroove", tmp_path, stop=lambda: bool(made))
    assert early.missing == ["second"] and not early.passed and "not made yet" in early.path.read_text()
    late = reproduction.reproduce("vgroove", tmp_path)
    assert made == ["first", "second"] and not late.missing and "not made yet" not in late.path.read_text()
    assert early.sections["first"] == late.sections["first"]
    reproduction.reproduce("vgroove", tmp_path)
    (tmp_path / "vgroove" / "curve.png").unlink()
    reproduction.reproduce("vgroove", tmp_path)
    assert made == ["first", "second", "first"]


def test_only_what_is_asked_for(made, tmp_path):
    found = reproduction.reproduce("vgroove", tmp_path, only=["Table 1"])
    assert made == ["second"] and found.passed
    with pytest.raises(UnknownNameError, match=r"'Fig\. 1'"):
        reproduction.reproduce("vgroove", tmp_path, only=["Fig. 11"])


@pytest.mark.parametrize(("other", "named"), [({"quick": True}, "paths"), ({"seed": 1}, "seed"), ({}, "code")])
def test_what_was_made_otherwise_is_kept_unless_forced(made, tmp_path, monkeypatch, other, named):
    reproduction.reproduce("vgroove", tmp_path)
    if not other:
        monkeypatch.setattr(kept, "code_digest", lambda: "new")
    before = (tmp_path / "vgroove.md").read_text()
    with pytest.raises(ParameterError, match=rf"first\.json was made with {named} .* --force"):
        reproduction.reproduce("vgroove", tmp_path, **other)
    assert made == ["first", "second"] and (tmp_path / "vgroove.md").read_text() == before
    reproduction.reproduce("vgroove", tmp_path, force=True, **other)
    assert made == ["first", "second"] * 2


def test_presets_are_code_too(tmp_path, monkeypatch):
    """Renders are of them."""
    monkeypatch.setattr(kept, "PACKAGE", tmp_path)
    digests = set()
    for reflectance in "0.5", "0.6":
        (tmp_path / "preset.json").write_text(reflectance)
        digests.add(kept.code_digest.__wrapped__())
    assert len(digests) == 2


def test_no_measurements_without_arrays(made, tmp_path):
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match="variant scalar_rgb: measuring needs one that computes on arrays"):
        reproduction.reproduce("vgroove", tmp_path)
    assert not made and not list(tmp_path.iterdir())


@pytest.mark.parametrize("damage", ["{", "[]", '{"section": {"title": 1}}'])
def test_a_damaged_section(made, tmp_path, damage):
    (tmp_path / "vgroove").mkdir()
    (tmp_path / "vgroove" / "first.json").write_text(damage)
    with pytest.raises(UnreadableFileError, match=r"first\.json"):
        reproduction.reproduce("vgroove", tmp_path)
    assert made == []


def test_a_figure_without_its_finding_is_no_page(made, tmp_path, monkeypatch):
    wrong = PAPERS["vgroove"].results[0]._replace(findings=("rihgt*",))
    monkeypatch.setitem(PAPERS, "vgroove", PAPERS["vgroove"]._replace(results=[wrong]))
    with pytest.raises(LookupError, match=r"Fig. 1: 'first' has nothing like 'rihgt\*'"):
        reproduction.reproduce("vgroove", tmp_path)


def test_an_unknown_paper(tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'Lucas'"):
        reproduction.reproduce("Lukas", tmp_path / "pages")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("model", PAPERS)
def test_every_section_of_a_validation_tells_about_a_figure(model):
    paper = PAPERS[model]
    labels = [result.label for result in paper.results]
    assert len(set(labels)) == len(labels) and paper.model == model and reproduction.find(model) is paper
    assert {result.section for result in paper.results} == paper.sections.keys() >= validation_of(model).keys()
    assert all(result.claim and result.why for result in paper.results) and paper.absent


def test_a_paper_by_its_authors():
    assert [page.name(model) for model in PAPERS] == [
        "Lucas et al. 2024",
        "Lee et al. 2018",
        "d'Eon 2021",
        "Meneveaux et al. 2018",
        "Holzschuch and Pacanowski 2017",
    ]
    assert reproduction.find("d'eon") is PAPERS["lambertsphere"]


def test_a_real_figure(tmp_path):
    """Table 2 of Lee et al., which needs no tracing."""
    found = reproduction.reproduce("vgroove", tmp_path, quick=True, only=["Table 2"])
    assert found.passed and "27 are the paper's" in found.path.read_text()
    assert json.loads((tmp_path / "vgroove" / "number.json").read_text())["stamp"]["tiles"] == 16
