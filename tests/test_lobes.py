"""What all models share, on a model that is as small as one can be: two lobes of known shares, over any base."""

import asperity  # noqa: F401  isort: skip
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity import models, plugin
from asperity.lab import checks, evaluate
from asperity.lobes import Lobe, LobeModel, Opening, diffuse, glossy
from asperity.microfacet.sampling import cosine_hemisphere
from asperity.parameters import BSDF, Texture

N = 200_000
SHARES = (0.2, 0.3)
"""Of the two lobes; the base has the rest."""
BASES = {
    "diffuse": {"type": "diffuse", "reflectance": 0.6},
    "mirror": {"type": "conductor", "material": "none"},
    "clear glass": {"type": "dielectric"},
    "rough glass": {"type": "roughdielectric", "alpha": 0.3},
    "black": {"type": "diffuse", "reflectance": 0.0},
    "two lobes": {"type": "plastic"},
    "both sides": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.6}},
}


@dataclass
class Matt(Lobe):
    """A share of the light, by cosine; a part ``lost`` of what is drawn is rejected."""

    amount: Any
    lost: float = 0.0

    def share(self, wi):
        return self.amount

    def eval_pdf(self, wi, wo):
        cosine = wo.z / dr.pi
        return self.amount * (1 - self.lost) * cosine, (1 - self.lost) * cosine

    def draw(self, wi, u, v):
        wo = cosine_hemisphere(v.x, v.y)
        return type(wo)(wo.x, wo.y, dr.select(u < self.lost, -1, wo.z))


class Uniform(Opening):
    """What neither lobe takes, in all directions."""

    def share(self, wi):
        return 1 - sum(SHARES)

    def reach(self, wi, wo):
        return 1 - sum(SHARES)


class Layers(LobeModel):
    """Two lobes over a base."""

    amount = Texture("share of the first lobe", SHARES[0], high=1)
    base = BSDF("what lies below")

    def flags(self):
        return [glossy(), diffuse()]

    def lobes(self, si, active):
        return [Matt(self.at("amount", si, active)), Matt(SHARES[1], lost=0.25)]

    def opening(self, si, active):
        return Uniform()


@pytest.fixture
def layers(rgb, monkeypatch):
    monkeypatch.setitem(models.MODELS, "layers", Layers)
    plugin.register()
    return lambda base: mi.load_dict({"type": "layers"} | ({} if base is None else {"base": BASES[base]}))


@pytest.mark.parametrize("base", [None, *BASES])
def test_every_check_passes(layers, base):
    """White furnace, chi-square, weights, contexts and components, gradients: what the lab asks of any model."""
    found = checks.check({"type": "layers"} | ({} if base is None else {"base": BASES[base]}), significance=1e-4)
    failed = [f"{result.name}: {result.measured} (bound: {result.bound})" for result in found if result.passed is False]
    assert not failed, "\n".join(failed)


@pytest.mark.parametrize("base", [None, "mirror", "diffuse"])
def test_lobes_are_chosen_by_their_shares(layers, base):
    """5 standard errors of a count."""
    bsdf, rng = layers(base), mi.PCG32(size=N)
    si = evaluate.interaction(mi.Vector3f(0.6, 0, 0.8), N)
    bs, _ = bsdf.sample(mi.BSDFContext(), si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
    counts = np.bincount(np.asarray(bs.sampled_component), minlength=3) / N
    expected = np.array([*SHARES, 0 if base is None else 1 - sum(SHARES)])
    expected = expected / expected.sum()
    np.testing.assert_allclose(counts, expected, atol=5 * (0.25 / N) ** 0.5)
    assert np.asarray(bs.sampled_type)[np.asarray(bs.sampled_component) == 1][0] == diffuse()


def test_a_rejected_sample_has_no_weight_and_no_density(layers):
    bsdf, rng = layers(None), mi.PCG32(size=N)
    context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 1)
    si = evaluate.interaction(mi.Vector3f(0, 0, 1), N)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    bs, weight = bsdf.sample(context, si, *numbers)
    rejected = np.asarray(numbers[0]) < 0.25
    assert np.all((np.asarray(bs.pdf) == 0) == rejected) and np.all((np.asarray(weight.x) == 0) == rejected)
    np.testing.assert_allclose(np.asarray(weight.x)[~rejected], SHARES[1], rtol=1e-5)
