"""That `asperity validate vgroove` can fail; that it passes is for `asperity reproduce --quick` in .ci/run."""

import functools

import drjit as dr
import numpy as np
import pytest

from asperity.models.vgroove.kaleidoscope import meeting_angle
from asperity.models.vgroove.tilts import GGXTilts
from asperity.validation import report, vgroove

pytestmark = pytest.mark.usefixtures("rgb")
QUICK = report.QUICK


@pytest.mark.parametrize("wrong", [{"alpha": 0.53}, {"distribution": "beckmann"}, {"symmetric": False}])
def test_a_wrong_model_fails(wrong):
    description = vgroove.grooves(0.5)
    measured = vgroove.shoot(description, [(20.0, 40.0)], report.Effort(8e6, 16), apart=2)
    for change, verdict in (({}, True), (wrong, False)):
        model = vgroove.by_bounce(description | change, measured, 2)
        assert all(f.passed for f in vgroove.compared("", measured, model, vgroove.FLOAT32)) is verdict, change


@pytest.mark.parametrize("rival", ["one bounce", "printed normalisation"])
def test_the_published_rivals_fail_in_the_quick_report(monkeypatch, rival):
    """Cook and Torrance's model, and the reciprocal of C, as Appendix C has it; with the model itself all passes."""
    monkeypatch.setattr(vgroove, "ALPHAS", (0.3,))
    monkeypatch.setattr(vgroove, "OTHERS", {"non-symmetric": vgroove.grooves(0.5, symmetric=False)})
    section = vgroove.brdf_by_bounce if rival == "one bounce" else vgroove.nonsymmetric
    assert report.passed([section(QUICK)])
    if rival == "one bounce":
        by_bounce = vgroove.by_bounce
        monkeypatch.setattr(vgroove, "by_bounce", lambda *given: by_bounce(*given) * np.array([1, 0, 0, 0])[:, None])
    else:
        partner = GGXTilts.isotropic_partner
        monkeypatch.setattr(GGXTilts, "isotropic_partner", staticmethod(lambda alpha: 1 / partner(alpha)))
    assert not report.passed([section(QUICK)])


@pytest.mark.slow
@pytest.mark.parametrize("clamped", [True, False])
def test_the_unclamped_kaleidoscope_fails(monkeypatch, clamped):
    """Eq. 6 as printed lets f_k be negative: light that reaches both facets is then counted wrongly."""

    def reach(groove, psi, m):
        x, tilt = meeting_angle(groove, psi, m), groove.tilt_l if m % 2 else groove.tilt_r
        seen = dr.sin(x) / dr.sin(tilt)
        return dr.select((x > 0) & (x < dr.pi), seen, 0) if clamped else seen

    def leaving_share(groove, psi, k):
        last = functools.reduce(dr.minimum, (reach(groove, psi, m) for m in {1, 2, k - 1, k} & set(range(1, k + 1))))
        lit = last - dr.maximum(dr.minimum(last, reach(groove, psi, k + 1)), reach(groove, psi, 0))
        return dr.select(reach(groove, psi, 1) > 0, dr.maximum(lit, 0) / reach(groove, psi, 1), 0)

    monkeypatch.setattr(vgroove, "leaving_share", leaving_share)
    assert report.passed([vgroove.kaleidoscope(60)]) is clamped


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.slow
@pytest.mark.parametrize("section", [vgroove.brdf_by_bounce, vgroove.nonsymmetric])
def test_too_few_paths_do_not_pass(monkeypatch, section):
    monkeypatch.setattr(vgroove, "ENOUGH", 1)
    assert not report.passed([section(report.Effort(100, 2))])
