"""What reports conclude from numbers, and how they are written."""

import numpy as np
import pytest

import asperity  # noqa: F401  isort: skip
from asperity.goniophotometer import Estimate
from asperity.validation import figures, report


def agreement(value, error, model):
    return report.agreement("", Estimate(*map(np.array, (value, error))), np.array(model), 32, 1e-4)


def test_agreement_sees_light_where_none_was_measured():
    value, error = [1.0, 0.0, 0.0], [0.001, 0.0, 0.0]
    assert agreement(value, error, value).passed
    assert not agreement(value, error, [1.0, 0.02, 0.02]).passed


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("model", "verdict"), [(1.0, True), (1.00005, True), (1.001, False), (0.0, False), (np.nan, False)]
)
def test_tiles_that_all_agree_leave_the_tolerance(model, verdict):
    assert agreement([1.0], [0.0], [model]).passed is verdict


def test_what_cannot_be_judged_has_not_passed():
    """Nor does it tell a rival apart."""
    vague = agreement([1.0, 2.0], [0.2, 0.4], [1.0, 2.0])
    assert vague.passed is False and "too few paths" in vague.measured
    right, wrong = (agreement([1.0], [0.01], [model]) for model in (1.0, 2.0))
    cases = {(right, wrong): True, (right, right): False, (vague, vague): False, (wrong, wrong): False}
    assert all(report.told_apart("", *pair).passed is verdict for pair, verdict in cases.items())


def test_slices_are_drawn_whatever_is_known(rgb):
    from asperity.goniophotometer import Hemisphere

    sensor, nothing = Hemisphere(2, 4), np.zeros((1, 8))
    picture = figures.slices("", sensor, Estimate(nothing, nothing), {"model": nothing})
    assert any("too few paths" in axes.get_title() for axes in picture.axes)


def test_report(tmp_path):
    figure, axes = figures.axes("x", "y", "title")
    axes.plot([0, 1])
    failed = report.Finding("claim", "1.0", "0.5", False)
    section = report.Section("Title", "Text.", [failed], [report.Table(("a", "b"), [(1, 0.123456)])], {"f": figure})
    path = report.write("Report", "Preface.", [section], tmp_path)
    text = path.read_text()
    assert "| claim | 1.0 | 0.5 | **failed** |" in text and "| 1 | 0.1235 |" in text and "![f](f.png)" in text
    assert (tmp_path / "f.png").stat().st_size > 1000 and not report.passed([section])


@pytest.mark.parametrize(
    "verdict, expected", [(True, True), (None, True), (False, False), (np.True_, True), (np.False_, False)]
)
def test_one_failed_claim_fails_the_report(verdict, expected):
    """A verdict of NumPy's is no bool, and `is not False`."""
    sections = [report.Section("", "", [report.Finding("", "", "", True), report.Finding("", "", "", verdict)])]
    assert report.passed(sections) == expected
