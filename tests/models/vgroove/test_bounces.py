"""The work is bounded, whatever the parameters."""

import asperity  # noqa: F401  isort: skip
import time
import warnings

import drjit as dr
import mitsuba as mi
import pytest

from asperity.lab import evaluate
from asperity.microfacet.distributions import DISTRIBUTIONS
from asperity.models.vgroove.bounces import MOST, needed_bounces, needed_bounces_nonsymmetric

VERTICES = {"type": "mesh_attribute", "name": "vertex_alpha"}


@pytest.mark.parametrize("symmetric", [True, False], ids=["symmetric", "not"])
@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("alpha", [1000.0, VERTICES], ids=["huge", "vertices"])
def test_the_roughest_grooves_answer(rgb, alpha, distribution, symmetric):
    """Within a second or two on idle cores, where it was minutes and more."""
    start = time.monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bsdf = mi.load_dict({"type": "vgroove", "alpha": alpha, "distribution": distribution, "symmetric": symmetric})
    assert bsdf.model.most[0] == MOST
    if alpha is not VERTICES:  # which need a mesh
        wi = evaluate.uniform_hemisphere(30_000, 1)
        weight = evaluate.sample(bsdf, wi, *evaluate.variates(30_000, 2))[1].x
        assert dr.all(dr.isfinite(weight)) and dr.max(weight)[0] < 1 + 1e-5
    assert time.monotonic() - start < 60  # of a machine that is busy


@pytest.mark.parametrize("kind", DISTRIBUTIONS.values(), ids=DISTRIBUTIONS)
def test_needed_bounces_are_bounded(kind):
    for needed in (needed_bounces, needed_bounces_nonsymmetric):
        counts = [needed(kind, min(alpha, kind.largest)) for alpha in (1e-3, 0.1, 1.0, 30.0, 1000.0)]
        assert counts == sorted(counts) and counts[0] >= 1 and counts[-1] <= MOST


def test_lost_light_is_said(rgb):
    with pytest.warns(UserWarning, match=r"alpha = 100: more than 0.1 % of the light bounces over 1000 times"):
        mi.load_dict({"type": "vgroove", "alpha": 100.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mi.load_dict({"type": "vgroove", "alpha": 19.0})
        mi.load_dict({"type": "vgroove", "alpha": 100.0, "max_bounces": 5})
