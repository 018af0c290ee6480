"""What a fit may change: from the models' declarations."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.fitting import CANDIDATES, candidates, free
from asperity.fitting.residuals import Model
from asperity.models import MODELS

RGB = ("R", "G", "B")


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("llvm_ad_rgb")


def paths(description, isotropic=True):
    return [one.path for one in free.parameters(description, isotropic)]


def test_nested_materials_have_their_own():
    grains = {"type": "micrograin", "reflectivity": 0.5, "base": {"type": "roughplastic"}}
    found = paths(grains)
    assert found == [
        *("tau_0", "beta", "reflectivity", "edge_tint"),
        *("base.alpha", "base.int_ior", "base.diffuse_reflectance"),
    ]
    assert paths(grains, isotropic=False)[1:3] == ["beta_x", "beta_y"]


def test_mitsubas_anisotropy():
    assert paths({"type": "roughconductor", "material": "Au"}, isotropic=False) == ["alpha_u", "alpha_v"]
    assert paths({"type": "principled"}, isotropic=False) == [*paths({"type": "principled"}), "anisotropic"]
    for description in ({"type": "roughconductor", "eta": 1.0, "k": 1.0}, {"type": "principled"}):
        Model(description, free.parameters(description, isotropic=False), RGB)


def test_what_is_known_or_textured_stays_as_it_is():
    assert paths({"type": "vgroove", "material": "Au"}) == ["alpha"]
    assert paths({"type": "roughconductor", "material": "Au"}) == ["alpha"]
    texture = {"type": "checkerboard", "color0": 0.1, "color1": 0.6}
    assert paths({"type": "interfacedlambertian", "alpha": texture}) == ["diffuse_reflectance", "int_ior"]


def test_materials_in_mitsubas_plugins_have_theirs_whatever_they_are_called():
    plastic = {"type": "roughplastic"}
    inside = {"type": "blendbsdf", "weight": 0.5, "paint": plastic, "dust": {"type": "diffuse"}}
    _, found = candidates.description({"type": "mask", "opacity": 0.5, "x": {"type": "twosided", "any": inside}})
    names = paths(found)
    assert names[0] == "nested_bsdf.brdf_0.weight" and names[-1] == "nested_bsdf.brdf_0.bsdf_1.reflectance"
    assert len(Model(found, free.parameters(found), RGB).keys) == len(names) == 5


def test_chosen_by_name():
    everything = free.parameters({"type": "interfacedlambertian"})
    assert [one.path for one in free.chosen(everything, ["alpha"], ())] == ["alpha"]
    assert [one.path for one in free.chosen(everything, None, ["alpha"])] == ["diffuse_reflectance", "int_ior"]
    with pytest.raises(ParameterError, match=r"no 'alhpa' to fit\. Did you mean 'alpha'"):
        free.chosen(everything, ["alhpa"], ())
    with pytest.raises(ParameterError, match="nothing is left to fit"):
        free.chosen(everything, None, paths({"type": "interfacedlambertian"}))


@pytest.mark.parametrize("name", CANDIDATES)
def test_units_go_there_and_back_and_every_number_matters(name):
    """Of every candidate: no parameter is free that the material does not have, under whatever name Mitsuba has it."""
    for one in free.parameters(CANDIDATES[name]):
        values = one.value(np.linspace(0, 1, 5))
        assert np.allclose(one.unit(values), np.linspace(0, 1, 5), atol=2e-3)  # ends with infinite slopes are left out
        step = 1e-6
        slope = (one.value(0.5 + step) - one.value(0.5 - step)) / (2 * step)
        assert one.slope(one.value(0.5)) == pytest.approx(slope)
    found = Model(CANDIDATES[name], free.parameters(CANDIDATES[name]), RGB)
    assert len(set(found.keys)) == len(found.free)


def test_every_model_has_something_to_fit():
    assert all(paths({"type": name}) for name in MODELS)
