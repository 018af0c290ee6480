"""Which end of a grain has the second colour, and how much of it is seen."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.microfacet.fresnel import conductor
from asperity.models.micrograin.shadows import Shadows

TAU_0, BETA, N = 0.5, 0.7, 400
I, O = np.array([0.6, 0, 0.8]), np.array([0.48, 0.6, 0.64])
UP, TOP = np.array([0, 0, 1.0]), {"type": "micrograin", "tau_0": TAU_0, "beta": BETA}
METALS = {"eta": 0.2, "k": 3.0, "eta_2": 1.5, "k_2": 1.0}
VARIATIONS = {
    "height": ({"variation": "height"}, lambda h, m: h),
    "normal": ({"variation": "normal"}, lambda h, m: (1 + m[0]) / 2),
    "azimuth": ({"variation": "normal", "variation_azimuth": 90.0}, lambda h, m: (1 + m[1]) / 2),
    "backwards": ({"variation": "normal", "variation_azimuth": -180.0}, lambda h, m: (1 - m[0]) / 2),
}
parametrised = pytest.mark.parametrize("given, share", VARIATIONS.values(), ids=VARIATIONS)


def value(i, o, **given):
    return evaluate.eval(mi.load_dict({**TOP, **given}), *(mi.Vector3f(*map(float, w)) for w in (i, o))).x[0]


@parametrised
def test_metals(rgb, given, share):
    """The index of refraction is between the two metals', by the share where the half vector is the normal."""
    for i, o in ((UP, UP), (I, O), (I, I * [-1, 1, 1]), (-I * [1, 1, -1], O * [-1, -1, 1])):
        m = (i + o) / np.linalg.norm(i + o)
        s = share(m[2] / np.sqrt((m[0] ** 2 + m[1] ** 2) / BETA**2 + m[2] ** 2), m)
        expected = conductor(*map(float, (i @ m, (1 - s) * 0.2 + s * 1.5, (1 - s) * 3.0 + s * 1.0)))
        assert value(i, o, **METALS, **given) / value(i, o) == pytest.approx(expected, rel=1e-4)


def grain(i, o, share):
    """(first, second) colour's parts of Lucas 2024, Eq. 21 by the midpoint rule over heights and azimuths."""
    h, azimuth = np.meshgrid((np.arange(N) + 0.5) / N, (np.arange(N) + 0.5) / N * 2 * np.pi, indexing="ij")
    radius = np.sqrt(1 - h * h)
    sphere, e = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), h]), np.array([BETA, BETA, 1])
    m = sphere * e[:, None, None]
    length = np.sqrt((m * m).sum(0))
    i_sphere, o_sphere = (e * w / np.linalg.norm(e * w) for w in (i, o))
    shadows = Shadows(*(llvm.Array3f64(*map(float, w)) for w in (i_sphere, o_sphere)))
    area = np.array(shadows.union(llvm.Float64(h[:, 0])))[:, None]
    r = -np.log(1 - TAU_0) / np.pi
    exposed = np.exp(-r * (np.pi * (1 - h * h) + area))
    facing = np.maximum(np.tensordot(i_sphere, sphere, 1), 0)
    lit = np.maximum(np.tensordot(o, m, 1), 0)  # E o . m' = o . E m'
    terms = exposed * facing * lit / length
    second = terms * share(h, m / length)
    return np.array([(terms - second).mean(), second.mean()]) * 2 * np.pi * r / (np.pi * i_sphere[2])


@parametrised
def test_diffuse_colours(rgb, given, share):
    """The quadrature's own accuracy is half a percent."""
    for i, o in ((I, O), (I, I), (-I * [1, 1, -1], UP)):
        for colours, part in (((1.0, 0.0), 0), ((0.0, 1.0), 1)):
            found = value(
                i, o, specular=False, **dict(zip(("diffuse_reflectance", "diffuse_reflectance_2"), colours)), **given
            )
            assert found == pytest.approx(grain(i, o, share)[part], rel=5e-3)


def test_grazing_sees_the_top(rgb):
    low = np.array([np.sqrt(1 - 0.02**2), 0, 0.02])
    colours = {"specular": False, "variation": "height", "diffuse_reflectance": 0.0, "diffuse_reflectance_2": 1.0}
    white = {"specular": False, "diffuse_reflectance": 1.0}
    assert value(low, low, **colours) > 0.7 * value(low, low, **white)
