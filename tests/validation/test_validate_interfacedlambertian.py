"""That `asperity validate interfacedlambertian` can fail; that it passes is for `asperity reproduce --quick`."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest

from asperity.goniophotometer import Estimate
from asperity.models.interfacedlambertian import interreflection
from asperity.validation import interfacedlambertian as paper
from asperity.validation import report

pytestmark = pytest.mark.usefixtures("rgb")
QUICK = report.QUICK


@pytest.mark.parametrize("wrong", [None, "facets"])
def test_curves_and_that_other_facets_fail(monkeypatch, wrong):
    monkeypatch.setattr(paper, "INDICES", (1.3,))
    monkeypatch.setattr(paper, "ROUGHNESSES", (0.3,))
    if wrong:
        right, name = paper.UnmirroredCavities, "UnmirroredCavities"
        monkeypatch.setattr(paper, name, lambda kind, u, v, *others: right(kind, 1.1 * u, 1.1 * v, *others))
    section = paper.curves(QUICK)
    assert report.passed([section]) is (wrong is None), section.findings


@pytest.mark.parametrize("wrong", ["darker", "no interface"])
def test_wrong_bounces_fail(monkeypatch, wrong):
    """T T between facets that is a tenth too small, and none."""
    monkeypatch.setattr(paper, "SURFACES", (paper.Surface("beckmann", 0.6),))
    right = interreflection.EvenTransmittance.__call__
    factor = {"darker": lambda *given: 0.9 * right(*given), "no interface": lambda *_: 1}[wrong]
    monkeypatch.setattr(interreflection.EvenTransmittance, "__call__", factor)
    section = paper.by_bounce(QUICK)
    failed = [finding.claim for finding in section.findings if finding.passed is False]
    assert any("two bounces" in claim for claim in failed), section.findings


def test_errors_without_noise():
    """Of a model that is 2 % off, in cells each of which is known to 2 %."""
    value = 1 + 0.02 * np.random.default_rng(0).normal(size=(1200, 1))
    found = paper.rms(Estimate(value, np.full(value.shape, 0.02)), np.full(value.shape, 1.02))
    assert found == pytest.approx([0.02], abs=0.002)
