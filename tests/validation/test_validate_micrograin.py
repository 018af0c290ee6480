"""The short version of `asperity validate micrograin`, and that it can fail."""

import numpy as np
import pytest

import asperity  # noqa: F401  isort: skip
from asperity.goniophotometer import Estimate
from asperity.validation import micrograin, report

pytestmark = pytest.mark.usefixtures("rgb")
SHORT = report.Effort(4e5, 12)


@pytest.mark.parametrize(
    "section",
    [
        micrograin.masking_by_azimuth,
        micrograin.distant_masking,
        micrograin.pores,
        micrograin.bases,
        micrograin.models,
        micrograin.retro,
        micrograin.furnace,
    ],
)
def test_section(section):
    found = section(SHORT)
    assert found.findings and all(finding.passed for finding in found.findings), found.findings


@pytest.mark.parametrize(
    ("figure", "material", "tolerance"),
    [("7", micrograin.METAL, micrograin.INSTRUMENT), ("8", micrograin.DIFFUSE, micrograin.QUADRATURE)],
)
def test_slices_at_86_degrees(figure, material, tolerance):
    found = micrograin.slices(figure, "", material, tolerance, SHORT)
    judged = [finding for finding in found.findings if finding.passed is not None]
    assert len(judged) == len(micrograin.GRAINS) and all(finding.passed for finding in judged), judged


@pytest.mark.parametrize("wrong", [{"masking": "height"}, {"beta_x": 1.9}, {"tau_0": 0.21}, {"eta": 1.3, "k": 6.6}])
def test_a_wrong_model_fails(wrong):
    description = micrograin.grains((0.2, 2.0, 2.0), **micrograin.METAL)
    measured = micrograin.shoot(description, [(86.0, 0.0)], report.Effort(4e6, 16))
    for change, verdict in (({}, True), (wrong, False)):
        model = micrograin.modelled(description | change, measured)[..., 0]
        finding = micrograin.judge("", measured, model, micrograin.INSTRUMENT)
        assert finding.passed is verdict, (change, finding)


def test_agreement_sees_light_where_none_was_measured():
    value, error = np.array([1.0, 0.0, 0.0]), np.array([0.001, 0.0, 0.0])
    assert report.agreement("", Estimate(value, error), value, 32, 1e-4).passed
    assert not report.agreement("", Estimate(value, error), np.array([1.0, 0.02, 0.02]), 32, 1e-4).passed


def test_report(tmp_path):
    figure, axes = micrograin.figures.axes("x", "y", "title")
    axes.plot([0, 1])
    failed = report.Finding("claim", "1.0", "0.5", False)
    section = report.Section("Title", "Text.", [failed], [report.Table(("a", "b"), [(1, 0.123456)])], {"f": figure})
    path = report.write("Report", "Preface.", [section], tmp_path)
    text = path.read_text()
    assert "| claim | 1.0 | 0.5 | **failed** |" in text and "| 1 | 0.1235 |" in text and "![f](f.png)" in text
    assert (tmp_path / "f.png").stat().st_size > 1000 and not report.passed([section])
