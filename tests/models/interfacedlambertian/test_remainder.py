"""More than two bounces in cavities, against known numbers, and what is missing."""

import asperity  # noqa: F401  isort: skip
import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from helpers import towards

from asperity.lab import evaluate
from asperity.microfacet.distributions import GGX, Beckmann
from asperity.models.interfacedlambertian.body import body_albedo, body_integral
from asperity.models.interfacedlambertian.facets import CavityFacets
from asperity.models.interfacedlambertian.interreflection import EvenTransmittance, two_bounces
from asperity.models.interfacedlambertian.remainder import More

KINDS = {"beckmann": Beckmann, "ggx": GGX}


@pytest.fixture(scope="module")
def more():
    mi.set_variant("llvm_ad_rgb")
    found = {}
    for kind, alpha, n in (("beckmann", 0.5, 1.5), ("beckmann", 1.0, 1.5), ("ggx", 0.5, 1.5), ("beckmann", 0.5, 1.0)):
        distribution, index = KINDS[kind](mi.Float(alpha), mi.Float(alpha)), mi.Float(n)
        tau, white = EvenTransmittance.made(index), body_albedo(mi.Float(1), index)

        def body(wi, wo, distribution=distribution, index=index, tau=tau, white=white):
            once, twice = two_bounces(distribution, index, tau, wi, wo)
            single = body_integral(distribution, CavityFacets(), index, wi, wo, 12, 32) / math.pi
            return white * (single + once + white * twice)

        found[kind, alpha, n] = More.made(distribution, index, body, mi.Vector3f, True)
    return found


def eps_mean(found):
    """As the table holds eps / sqrt(pi eps_mean)."""
    return math.pi * float(More.hemispherical(found.missing, mi.Float)[0]) ** 2


@pytest.mark.parametrize(
    ("surface", "mean", "left"),
    [
        (("beckmann", 0.5, 1.5), 0.0137, (0.049, 0.28)),
        (("beckmann", 1.0, 1.5), 0.078, (0.039, 0.24)),
        (("ggx", 0.5, 1.5), None, (0.033, 0.21)),
        (("beckmann", 0.5, 1.0), None, (0.108, 0.48)),
    ],
)
def test_more_bounces_by_an_independent_tracer(more, surface, mean, left):
    """Energy, to the tracer's .001; and the share of it that is left at K_d = .5 and .8, which is roughly modelled."""
    found, n = more[surface], mi.Float(surface[2])
    if mean is not None:
        assert eps_mean(found) == pytest.approx(mean, abs=1e-3)
    for albedo, expected in zip((0.5, 0.8, 1.0), (*left, 1)):
        share = found.left.at(body_albedo(mi.Float(albedo), n) / body_albedo(1, n))[0]
        assert float(share[0]) == pytest.approx(expected, abs=0.018)


def test_more_bounces_close_the_furnace(more):
    """What they return along any direction is what is missing: eps."""
    found = more["beckmann", 1.0, 1.5]
    for theta in (0, 40, 70, 87):
        wi = evaluate.vectors(np.broadcast_to(towards(theta), (1 << 14, 3)))
        wo = evaluate.uniform_hemisphere(1 << 14, 1)
        returned = float(dr.mean(found(wi, wo, mi.Float(1)) * wo.z)[0]) * 2 * math.pi
        eps = float(found.missing.at(mi.Float(math.cos(math.radians(theta)) ** 0.5), 0)[0][0])
        eps *= math.sqrt(math.pi * eps_mean(found))
        assert returned == pytest.approx(eps, rel=0.02)  # 2^14 samples of a cosine: .6 %
