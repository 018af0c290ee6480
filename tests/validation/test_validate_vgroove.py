"""The short version of `asperity validate vgroove`, and that it can fail."""

import numpy as np
import pytest

from asperity.validation import report, vgroove

pytestmark = pytest.mark.usefixtures("rgb")
SHORT, LONGER = report.Effort(4e5, 12), report.Effort(4e6, 16)


@pytest.mark.parametrize(
    ("section", "arguments"),
    [
        (vgroove.kaleidoscope, (30,)),
        (vgroove.bounces, ()),
        (vgroove.brdf_by_bounce, (LONGER,)),
        (vgroove.nonsymmetric, (LONGER,)),
        (vgroove.furnace, (SHORT,)),
    ],
)
def test_section(section, arguments):
    found = section(*arguments)
    assert found.findings and all(finding.passed for finding in found.findings), found.findings


@pytest.mark.parametrize("wrong", [{"alpha": 0.53}, {"distribution": "beckmann"}, {"symmetric": False}])
def test_a_wrong_model_fails(wrong):
    description = vgroove.grooves(0.5)
    measured = vgroove.shoot(description, [(20.0, 40.0)], report.Effort(8e6, 16), apart=2)
    for change, verdict in (({}, True), (wrong, False)):
        model = vgroove.by_bounce(description | change, measured, 2)
        assert all(f.passed for f in vgroove.compared("", measured, model, vgroove.FLOAT32)) is verdict, change


def test_the_unclamped_kaleidoscope_would_fail(monkeypatch):
    # Eq. 6 as printed lets f_k be negative: light that reaches both facets is then counted wrongly.
    monkeypatch.setattr(vgroove, "leaving_share", lambda groove, psi, k: np.float32(1.0 * (k == 1)))
    assert not all(finding.passed for finding in vgroove.kaleidoscope(45).findings)
