"""The short version of `asperity validate interfacedlambertian`, and that it can fail."""

import pytest

from asperity.models.interfacedlambertian import interreflection
from asperity.validation import interfacedlambertian as paper
from asperity.validation import report

pytestmark = pytest.mark.usefixtures("rgb")
QUICK = report.Effort(4e5, 16)


def test_reflectance():
    section = paper.reflectance(QUICK)
    assert all(finding.passed for finding in section.findings), section.findings


@pytest.mark.slow
def test_distributions():
    section = paper.distributions(QUICK)
    assert all(finding.passed for finding in section.findings), section.findings


@pytest.mark.parametrize("wrong", [None, "darker", "no interface"])
def test_two_bounces_and_that_wrong_ones_fail(monkeypatch, wrong):
    """T T that is a tenth too small, and none."""
    monkeypatch.setattr(paper, "ROUGHNESSES", (0.6,))
    if wrong == "no interface":
        monkeypatch.setattr(interreflection.EvenTransmittance, "__call__", lambda self, a, b, cos_m: 1)
    elif wrong:
        call = interreflection.EvenTransmittance.__call__
        monkeypatch.setattr(
            interreflection.EvenTransmittance, "__call__", lambda self, *given: 0.9 * call(self, *given)
        )
    section = paper.by_bounce(QUICK)
    assert report.passed([section]) is (wrong is None), section.findings
