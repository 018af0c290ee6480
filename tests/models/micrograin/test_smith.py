"""`masking: smith` against its definitions, by quadrature."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.models.micrograin import smith
from asperity.models.micrograin.grains import density

TAU_0 = [0.02, 0.4, 0.9]
COSINES = [0.05, 0.4, 0.8, 1.0]


def projected(r, cos, n=1000):
    """tau_0 int D(m) (w.m)+ dm by the midpoint rule: exposed grains of density r, projected along w."""
    h, azimuth = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n * np.pi, indexing="ij")
    facing = np.maximum(cos * h + np.sqrt((1 - cos**2) * (1 - h * h)) * np.cos(azimuth), 0)
    return 2 * np.pi * r * (np.exp(-r * np.pi * (1 - h * h)) * facing).mean()


@pytest.mark.parametrize("tau_0", TAU_0)
@pytest.mark.parametrize("cos", COSINES)
def test_visible_normals_project_to_the_whole_surface(tau_0, cos):
    """G1 tau_0 int D (w.m)+ dm = tau_0 cos, Smith's condition. 12 nodes are good to 1e-4."""
    r, w = density(llvm.Float64(tau_0)), llvm.Array3f64((1 - cos**2) ** 0.5, 0, cos)
    assert smith.masking(r, w)[0] * projected(r[0], cos) == pytest.approx(tau_0 * cos, rel=1e-3)


@pytest.mark.parametrize("tau_0", TAU_0)
def test_values_of_mirror_grains(rgb, tau_0):
    """f cos_o = tau_0 D G1(i) G1(o) w+ / tau_0 / (4 cos_i) for beta = 1, where sphere space is the real one."""
    r = -np.log(1 - tau_0) / np.pi
    bsdf = mi.load_dict({"type": "micrograin", "masking": "smith", "tau_0": tau_0, "beta": 1.0})
    for i, o in (((0.6, 0, 0.8), (0, 0.6, 0.8)), ((0.6, 0, 0.8), (-0.8, 0, 0.6)), ((0, 0, 1), (0.96, 0, 0.28))):
        m = np.add(i, o) / np.linalg.norm(np.add(i, o))
        d = r * np.exp(-r * np.pi * (1 - m[2] ** 2))  # tau_0 D
        g1 = [tau_0 * w[2] / projected(r, w[2]) for w in (i, o)]
        both = 1 - (1 - tau_0) ** ((1 / i[2] + 1 / o[2]) / 2)
        value = evaluate.eval(bsdf, mi.Vector3f(*i), mi.Vector3f(*o)).x[0]
        assert value == pytest.approx(d * g1[0] * g1[1] * both / tau_0 / (4 * i[2]), rel=1e-3)


@pytest.mark.parametrize("tau_0", TAU_0)
def test_values_of_the_base(rgb, tau_0):
    """Pores show the base by 1 - w+ = (1 - tau_0)^((1 / cos_i + 1 / cos_o) / 2)."""
    given = {"masking": "smith", "specular": False, "diffuse_reflectance": 0.0, "tau_0": tau_0}
    bsdf = mi.load_dict({"type": "micrograin", **given, "base": {"type": "diffuse", "reflectance": 1.0}})
    value = evaluate.eval(bsdf, mi.Vector3f(0.6, 0, 0.8), mi.Vector3f(0, 0.8, 0.6)).x[0]
    assert value == pytest.approx((1 - tau_0) ** ((1 / 0.8 + 1 / 0.6) / 2) * 0.6 / np.pi, rel=1e-4)
