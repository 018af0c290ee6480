"""Albedos against incidence."""

from known import ERROR, GRAINS, REFLECTANCE, lambertian  # isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.drawing import plot
from asperity.drawing.albedo import GRID, over_incidence, parts_of
from asperity.materials import Material

PLASTIC = Material("plastic", {"type": "plastic"})


def test_a_lambertian_has_its_reflectance(rgb):
    x, y = plot([lambertian(0.8)], "albedo").axes[0].lines[0].get_data()
    assert x.tolist() == GRID.tolist() and y == pytest.approx(np.full(len(x), 0.8), rel=1e-5)


def test_a_measurement_has_its_own(rgb, measured):
    axes = plot([measured, lambertian(REFLECTANCE)], "albedo").axes[0]
    (bars,) = axes.containers
    x, y = bars[0].get_data()
    assert x.tolist() == [0, 30, 60] and y == pytest.approx([REFLECTANCE] * 3, rel=1e-6)
    ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments()])
    assert (ends[:, 1] - ends[:, 0]) / 2 == pytest.approx([ERROR * REFLECTANCE] * 3, rel=1e-6)


def test_lobes_add_up(rgb):
    """The mirror and the body of a plastic; both are estimated by samples of their own: 8192, so within a percent."""
    parts = parts_of(PLASTIC, 0)
    assert list(parts) == ["lobe 1: mirror", "lobe 2: diffuse"]
    whole = over_incidence(PLASTIC, 0).value
    assert sum(part.value for part in parts.values()) == pytest.approx(whole, abs=0.01)


def test_what_glass_does_not_reflect_it_transmits(rgb):
    """Power, not radiance; each lane takes one way or the other."""
    glass = Material("glass", {"type": "dielectric"})
    whole, transmitted = over_incidence(glass, 0).value, parts_of(glass, 0)["transmitted"].value
    assert whole + transmitted == pytest.approx(np.ones_like(whole), abs=1e-5)
    assert whole[0, 0] == pytest.approx(((1.5046 - 1.00028) / (1.5046 + 1.00028)) ** 2, rel=0.02)


def test_one_lobe_is_not_named_apart(rgb):
    assert parts_of(lambertian(), 0) == {}
    labels = plot([GRAINS, lambertian()], "albedo").axes[0].get_legend_handles_labels()[1]
    assert labels == ["grains", "matte"]


def test_wavelengths(rgb):
    mi.set_variant("llvm_ad_spectral")
    ramp = {"type": "irregular", "wavelengths": "400, 700", "values": "0.1, 0.7"}
    material = Material("ramp", {"type": "diffuse", "reflectance": ramp})
    values = over_incidence(material, 0, [450, 500, 550, 600, 650]).value
    assert values[:, 3] == pytest.approx([0.2, 0.3, 0.4, 0.5, 0.6], rel=1e-5)
