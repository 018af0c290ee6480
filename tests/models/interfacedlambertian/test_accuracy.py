"""How far what the model looks up, or sums with few nodes, is from the integral over facets with many.

As a script it prints the table of docs/interfacedlambertian.md, of 100 000 inputs a row: in a quarter of an hour.
"""

import asperity  # noqa: F401  isort: skip
import itertools

import drjit as dr
import helpers
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.models.interfacedlambertian import body
from asperity.models.interfacedlambertian.facets import DISTRIBUTIONS, FACETS
from asperity.models.interfacedlambertian.interreflection import two_bounces
from asperity.models.interfacedlambertian.light import Known

KINDS = [("beckmann", "smith"), ("ggx", "smith"), ("beckmann", "vcavity"), ("ggx", "vcavity"), ("gaussian", "vcavity")]
MANY = 48, 32
"""Rings and azimuths of the reference, whose own error is a tenth of what is asked for."""
VARIED = {"": "table", "textured": "textured", "anisotropic": "sum"}


def pairs(rng, n):
    """Cosines evenly, a tenth of them below .1 (to .003), some exactly normal, some pairs retro, mirrored, coplanar."""
    cos = rng.uniform(0, 1, (2, n))
    cos = np.where(rng.random((2, n)) < 0.1, 0.1 * 0.03 ** rng.random((2, n)), cos)
    cos[:, :10] = 1
    phi = rng.uniform(0, 2 * np.pi, (2, n))
    cos[1, 10:40] = cos[0, 10:40]
    phi[1, 10:60] = phi[0, 10:60] + np.pi * (np.arange(50) % 2)
    cos, sin = np.maximum(cos, 3e-3), np.sqrt(1 - np.minimum(cos, 1) ** 2)
    return [mi.Vector3f(sin[k] * np.cos(phi[k]), sin[k] * np.sin(phi[k]), cos[k]) for k in (0, 1)]


def errors(rng, kind, n, varied):
    """Relative errors of one material's body, where f cos_o exceeds 1e-3."""
    distribution, masking = kind
    alpha, index = np.exp(rng.uniform(*np.log([0.01, 1.2]))), rng.choice([1, rng.uniform(1, 2.5)], p=[0.1, 0.9])
    alphas = {"alpha": alpha}
    if varied == "anisotropic":
        alphas = {"alpha_u": alpha, "alpha_v": np.exp(rng.uniform(*np.log([0.01, 1.2])))}
    if varied == "textured":
        low = np.exp(rng.uniform(*np.log([0.01, 1.0])))
        alphas = {"alpha": {"type": "checkerboard", "color0": low, "color1": min(low * 6, 1.2)}}
    given = {"type": "interfacedlambertian", "distribution": distribution, "masking": masking, "int_ior": index}
    bsdf = mi.load_dict({**given, "ext_ior": 1.0, "diffuse_reflectance": 1.0, **alphas})
    si, wo = evaluate.interaction((both := pairs(rng, n))[0]), both[1]
    si.uv = mi.Point2f(*rng.random((2, n)))
    found = bsdf.eval(mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 1), si, wo).x
    alphas, index = bsdf.model.at("alpha", si, True), mi.Float(index)
    dr.make_opaque(alphas, index)  # one kernel for all
    exact = body.body_integral(DISTRIBUTIONS[distribution](*alphas), FACETS[masking](), index, si.wi, wo, *MANY)
    exact = np.array(exact * body.body_albedo(1.0, index) * wo.z / np.pi)
    return (np.abs(np.array(found) / exact - 1))[exact > 1e-3]


def percentiles(kind, varied, materials, n, seed=0):
    """95th, 99th and 99.9th, of ``n`` pairs of directions on each material."""
    rng = np.random.default_rng(seed)
    return np.percentile(np.concatenate([errors(rng, kind, n, varied) for _ in range(materials)]), [95, 99, 99.9])


@pytest.mark.parametrize("kind", KINDS, ids=["-".join(kind) for kind in KINDS])
@pytest.mark.parametrize("varied", VARIED, ids=VARIED.values())
@pytest.mark.parametrize("materials, n", [pytest.param(12, 800, marks=pytest.mark.slow), (2, 800)], ids=["all", "some"])
def test_close_to_the_integral(rgb, kind, varied, materials, n):
    """What is asked for: .5 % at the 95th percentile, 1.5 % at the 99th, and of Smith's, which has no kinks but where
    facets turn away, 1 % at the 99.9th."""
    middle, high, highest = percentiles(kind, varied, materials, n)
    assert middle < 0.005 and high < 0.015
    if kind[1] == "smith":
        assert highest < 0.01


@pytest.mark.parametrize("kind", KINDS[2:], ids=lambda kind: kind[0])
def test_cavities_on_the_horizon(rgb, kind):
    """Towards its source they return light as 1 / cos: to a fifth, from .003 on, between nodes at 0 and .008."""
    cos, index, alpha = np.geomspace(3e-3, 0.03, 40), mi.Float(1.5), mi.Float(0.9)
    w = mi.Vector3f(np.sqrt(1 - cos**2), 0 * cos, cos)
    normals, facets = DISTRIBUTIONS[kind[0]](alpha, alpha), FACETS[kind[1]]()
    found = Known.made(type(normals), facets, "single", True, MANY, index, alpha).once.at(alpha, w, w)
    np.testing.assert_allclose(found, body.body_integral(normals, facets, index, w, w, *MANY), rtol=0.2)


def two_bounces_of(rng, distribution, n):
    """What tables of two bounces are off, over all light, and where that exceeds 1e-3."""
    alpha, index = np.exp(rng.uniform(*np.log([0.01, 1.2]))), rng.choice([1, rng.uniform(1, 2.5)], p=[0.1, 0.9])
    given = {"type": "interfacedlambertian", "distribution": distribution, "alpha": alpha, "int_ior": index}
    model = mi.load_dict({**given, "ext_ior": 1.0, "diffuse_reflectance": 1.0, "scattering": "double"}).model
    known, alpha, index, (wi, wo) = model.known.result, mi.Float(alpha), mi.Float(index), pairs(rng, n)
    dr.make_opaque(alpha, index)
    normals = DISTRIBUTIONS[distribution](alpha, alpha)
    scale, looked_up = (
        body.body_albedo(1.0, index),
        (table.at(mi.Float(alpha), wi, wo) for table in (known.mixed, known.twice)),
    )
    once, twice = two_bounces(normals, index, known.tau, wi, wo, *MANY)
    found, exact = (np.array(scale * (c_1 + scale * c_2) * wo.z) for c_1, c_2 in (looked_up, (once, twice)))
    facets = FACETS["vcavity"]()
    first = body.body_integral(normals, facets, index, wi, wo, *MANY) * scale * wo.z / np.pi
    whole = np.array(first + body.interface(normals, facets, index, wi, wo)) + exact
    return (np.abs(found - exact) / whole)[whole > 1e-3]


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@pytest.mark.parametrize("materials", [pytest.param(12, marks=pytest.mark.slow), 2], ids=["all", "some"])
def test_two_bounces(rgb, distribution, materials):
    """A third of what `double` may be off from traced cavities: 1 % at the 95th percentile, 2 % at the 99th."""
    rng = np.random.default_rng(1)
    found = np.concatenate([two_bounces_of(rng, distribution, 800) for _ in range(materials)])
    middle, high = np.percentile(found, [95, 99])
    assert middle < 0.0033 and high < 0.0067


def test_the_coarse_rule(rgb):
    """Of `approximate`: 1 % at the 95th percentile where neither direction grazes."""
    errors = []
    for kind in KINDS:
        given = {"type": "interfacedlambertian", "distribution": kind[0], "masking": kind[1], "alpha": 0.4}
        wi, wo = (mi.Vector3f(helpers.directions(np.random.default_rng(seed), 2000, lowest=0.1)) for seed in (1, 2))
        coarse, fine = (
            np.array(mi.load_dict({**given, **more}).eval(mi.BSDFContext(), evaluate.interaction(wi), wo).x)
            for more in ({"approximate": True}, {})
        )
        errors.append(coarse / fine - 1)
    assert 0.001 < np.percentile(np.abs(errors), 95) < 0.01


def main():
    mi.set_variant("llvm_ad_rgb")
    print("% at the percentile:  95th   99th   99.9th")
    for kind, varied in itertools.product(KINDS, VARIED):
        print(*kind, VARIED[varied], *np.round(100 * percentiles(kind, varied, 50, 2000, seed=2), 2), flush=True)
    for distribution in DISTRIBUTIONS:
        rng = np.random.default_rng(2)
        found = np.concatenate([two_bounces_of(rng, distribution, 2000) for _ in range(50)])
        print(distribution, "two bounces", *np.round(100 * np.percentile(found, [95, 99, 99.9]), 2), flush=True)


if __name__ == "__main__":
    main()
