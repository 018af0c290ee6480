"""That `asperity validate lambertsphere` can fail; that it passes is for `asperity reproduce --quick` in .ci/run."""

from functools import cache

import pytest

from asperity.validation import lambertsphere, report

pytestmark = pytest.mark.usefixtures("rgb")
QUICK = report.QUICK


@cache
def truth():
    """Walked once."""
    return lambertsphere.walked(0.8, report.Effort(2e6, 32))


@pytest.mark.parametrize("wrong", [{"albedo": 0.83}, {"variant": "fast"}, {"type": "chandrasekhar"}])
def test_a_wrong_model_fails(wrong):
    description = lambertsphere.spheres(0.8)
    for change, verdict in (({}, True), (wrong, False)):
        model = lambertsphere.modelled(description | change)
        finding = report.agreement("", truth(), model, 32, lambertsphere.REFIT)
        assert finding.passed is verdict, (change, finding)


@pytest.mark.parametrize("rival", [{"type": "lambertsphere", "variant": "fast"}, {"type": "chandrasekhar"}])
def test_the_published_rivals_fail_in_the_quick_report(monkeypatch, rival):
    """Eq. 41, and isotropic scattering; with the model itself all passes."""
    monkeypatch.setattr(lambertsphere, "ALBEDOS", (0.2, 0.8, 0.99))
    assert report.passed([lambertsphere.brdf(QUICK)])
    modelled = lambertsphere.modelled
    monkeypatch.setattr(lambertsphere, "modelled", lambda spheres: modelled({"albedo": spheres["albedo"]} | rival))
    assert not report.passed([lambertsphere.brdf(QUICK)])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_too_few_paths_do_not_pass():
    assert not report.passed([lambertsphere.brdf(report.Effort(100, 2))])
