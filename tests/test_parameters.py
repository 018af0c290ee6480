import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.conductors import Conductor, artist_friendly, materials
from asperity.errors import ParameterError
from asperity.lab import evaluate
from asperity.microfacet.fresnel import FittedMetal
from asperity.models import MODELS
from asperity.models.micrograin import Micrograin
from asperity.parameters import Axes, Choice, Constant, ConstantAxes, Declared, Texture, Usual


def bitmap(low, high):
    return {"type": "bitmap", "raw": True, "data": mi.TensorXf([low, high] * 8, (4, 4, 1))}


BAD = {
    "misspelt": ({"tau0": 0.3}, "no parameter 'tau0'. Did you mean 'tau_0'"),
    "too large": ({"tau_0": 1.5}, r"tau_0 = 1.5: expected a number or texture in \[0, 1\]"),
    "zero": ({"beta": 0.0}, r"beta = 0.0: expected a number or texture in \[0.0001, 100\]"),
    "huge": ({"beta": 1e20}, r"beta = 1e\+20: expected a number or texture in \[0.0001, 100\]"),
    "NaN": ({"tau_0": float("nan")}, "tau_0 = nan"),
    "infinite": ({"beta": float("inf")}, "beta = inf"),
    "word for a number": ({"tau_0": "much"}, "tau_0 = 'much'"),
    "flag for a number": ({"tau_0": True}, "tau_0 = True"),
    "number for a flag": ({"specular": 1}, "specular = 1"),
    "texture for a BSDF": ({"base": {"type": "checkerboard"}}, "base = .*: expected a BSDF"),
    "texels": (lambda: {"tau_0": bitmap(0.0, 2.0)}, "tau_0 = 2 .in its 'data'.: expected"),
    "our texture": ({"tau_0": {"type": "settled", "top": 2.0}}, "tau_0 = 2 "),
    "colour": (
        {"diffuse_reflectance": {"type": "rgb", "value": [0.1, 1.4, 0]}},
        r"diffuse_reflectance = \[0.1, 1.4, 0\]",
    ),
    "choice": ({"masking": "corelated"}, "masking = 'corelated'. Did you mean 'correlated'"),
    "metal": ({"material": "Aur"}, "material = 'Aur'.*Did you mean 'Au'"),
    "glass": ({"int_ior": "bk8"}, "int_ior = 'bk8': .*bk7"),
    "metal twice": ({"material": "Au", "eta": 1.0}, "material and eta exclude each other"),
    "beta twice": ({"beta": 1.0, "beta_x": 1.0}, "beta and beta_x exclude each other"),
    "half an index": ({"eta": 1.0}, "eta is given without k"),
    "other half": ({"k": 1.0}, "k is given without eta"),
    "edge alone": ({"edge_tint": 0.5}, "edge_tint is given without reflectivity"),
    "metal and albedo": ({"material": "Au", "diffuse_reflectance": 0.3}, "material.*exclude each other"),
    "metal without specular": ({"material": "Au", "specular": False}, "exclude each other"),
    "no second colour": ({"variation": "height"}, "needs a second colour"),
    "second colour of a mirror": ({"variation": "height", "material_2": "Au"}, 'needs two metals; material "none"'),
    "spectrum for a number": (
        {"tau_0": {"type": "irregular", "wavelengths": "400, 500, 600", "values": ".1, .2, .3"}},
        "tau_0: a colour or spectrum, where one number is expected",
    ),
    "coloured texture for a number": (
        lambda: {"tau_0": {"type": "bitmap", "raw": True, "data": mi.TensorXf([0.1, 0.5, 0.9] * 4, (2, 2, 3))}},
        "tau_0: a colour or spectrum",
    ),
    "colour in a texture": (
        {"tau_0": {"type": "checkerboard", "color0": {"type": "rgb", "value": [0.1, 0.5, 0.9]}, "color1": 0.2}},
        "tau_0: a colour or spectrum",
    ),
    "colour for a number": ({"beta": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}, "beta: a colour or spectrum"),
    "illuminant for a number": ({"beta": {"type": "blackbody", "temperature": 5000.0}}, "beta: a colour or spectrum"),
    "two bases": ({"base": {"type": "diffuse"}, "other": {"type": "diffuse"}}, "no parameter 'other'"),
    "unused second colour": ({"material_2": "Au"}, "material_2: needs variation"),
    "Smith and more": ({"masking": "smith", "scattering": "multiple"}, "masking = .smith."),
    "textured beta": (lambda: {"beta": bitmap(0.5, 1.0), "scattering": "multiple"}, "beta: a texture"),
}


@pytest.mark.parametrize("given, message", BAD.values(), ids=BAD)
def test_bad_input_is_named(rgb, given, message):
    given = given() if callable(given) else given
    pattern = f"ParameterError: (.*){message}"
    with pytest.raises(RuntimeError, match=pattern):
        mi.load_dict({"type": "micrograin", **given})


def test_an_update_is_checked_but_an_optimiser_is_free(rgb):
    params = mi.traverse(mi.load_dict({"type": "micrograin"}))
    params["tau_0.value"] = 1.5
    with pytest.raises(ValueError, match=r"tau_0 = 1\.5"):
        params.update()
    value = mi.Float(1.5)
    dr.enable_grad(value)
    params["tau_0.value"] = value
    params.update()


def test_our_textures_are_checked_on_update(rgb):
    params = mi.traverse(mi.load_dict({"type": "settled"}))
    params["softness.value"] = 0.0
    with pytest.raises(ValueError, match="softness = 0"):
        params.update()


def test_a_nested_texture_has_its_own_ranges(rgb):
    mi.load_dict({"type": "micrograin", "tau_0": {"type": "settled", "threshold": -0.3, "softness": 1.5}})


def test_eight_bit_textures_are_in_range(rgb):
    data = mi.Bitmap(mi.TensorXf([0.0, 1.0] * 8, (4, 4, 1))).convert(component_format=mi.Struct.Type.UInt8)
    mi.load_dict({"type": "micrograin", "tau_0": {"type": "bitmap", "bitmap": data, "raw": True}})


def test_every_model_documents_every_parameter():
    for model in MODELS.values():
        rows = model.rows()
        assert len({row.name for row in rows}) == len(rows)
        assert all(row.meaning and row.kind for row in rows)
        assert model.__doc__ and model.citation.startswith("@")


def test_materials_are_mitsubas():
    assert {"none", "Au", "Cu", "Al"} <= set(materials())


def test_metal_by_name_equals_roughconductor(rgb):
    ours = mi.traverse(mi.load_dict({"type": "micrograin", "material": "Au"}))
    theirs = mi.traverse(mi.load_dict({"type": "roughconductor", "material": "Au"}))
    for name in ("eta.value", "k.value"):
        assert str(ours[name]) == str(theirs[name])


@pytest.mark.parametrize("reflectivity", [0.02, 0.5, 0.95])
@pytest.mark.parametrize("edge_tint", [0.0, 0.4, 1.0])
def test_artist_friendly_metal_reflects_what_was_asked(rgb, reflectivity, edge_tint):
    eta, k = artist_friendly(mi.Float(reflectivity), mi.Float(edge_tint))
    at_normal = mi.fresnel_conductor(mi.Float(1), mi.Complex2f(eta, k))
    assert at_normal[0] == pytest.approx(reflectivity, abs=2e-5)  # float32: eta and k reach 40 at the edges


def test_a_metal_is_fitted_once_where_it_is_settled(rgb):
    bsdf = mi.load_dict({"type": "micrograin", "eta": 0.2, "k": 3.0})
    before, params = bsdf.model.metal.fitted, mi.traverse(bsdf)
    params["k.value"] = 4.0
    params.update()
    assert isinstance(before, FittedMetal) and before.k[0] == 3 and bsdf.model.metal.fitted.k[0] == 4
    dr.enable_grad(params["k.value"])
    params.update()
    assert bsdf.model.metal.fitted is None
    assert mi.load_dict({"type": "micrograin", "eta": bitmap(0.2, 0.3), "k": 3.0}).model.metal.fitted is None
    mi.set_variant("llvm_ad_spectral")  # rays choose the wavelengths
    assert mi.load_dict({"type": "micrograin", "eta": 0.2, "k": 3.0}).model.metal.fitted is None


@pytest.mark.parametrize("given", [0, -3, 1001, 2.0, True, "two"])
def test_whole_numbers_are_whole_and_in_range(rgb, given):
    with pytest.raises(RuntimeError, match=r"max_bounces = .*: expected a whole number in \[1, 1000\]"):
        mi.load_dict({"type": "vgroove", "max_bounces": given})


@pytest.mark.parametrize("model", ["micrograin", "vgroove", "deon", "merillou"])
def test_a_metal_by_colour_reflects_it(rgb, model):
    """Whatever the edge tint, at normal incidence, next to a mirror."""
    once = {"max_bounces": 1} if model == "vgroove" else {}
    n = mi.Vector3f(0, 0, 1)
    mirror = evaluate.eval(mi.load_dict({"type": model, **once}), n, n)
    colour = {"type": "rgb", "value": [0.9, 0.5, 0.1]}
    for tint in ({}, {"edge_tint": 0.7}):
        metal = mi.load_dict({"type": model, **once, "reflectivity": colour, **tint})
        ratio = np.array(evaluate.eval(metal, n, n) / mirror).ravel()
        np.testing.assert_allclose(ratio, [0.9, 0.5, 0.1], rtol=1e-4)


def xml(children, model="micrograin"):
    return mi.load_string(f'<bsdf version="3.0.0" type="{model}">{children}</bsdf>').model


def test_xml_says_it_all(rgb):
    """Choices, metals by name and by index, flags, whole numbers."""
    model = xml('<string name="masking" value="height"/><string name="material" value="Au"/>')
    assert model.masking == "height" and not model.metal.mirror
    model = xml('<float name="eta" value="0.2"/><float name="k" value="3"/><spectrum name="eta_2" value="1"/>'
                '<float name="k_2" value="0"/><string name="variation" value="normal"/>')  # fmt: skip
    assert model.metal.k.mean()[0] == 3 and model.metal_2.eta.mean()[0] == 1
    assert xml('<boolean name="specular" value="false"/>').specular is False
    model = xml('<integer name="max_bounces" value="7"/><rgb name="reflectivity" value="0.9, 0.5, 0.1"/>', "vgroove")
    assert model.max_bounces == 7 and not model.metal.mirror


@pytest.mark.parametrize(
    "children, message",
    [
        ('<string name="masking" value="hight"/>', "Did you mean 'height'"),
        ('<boolean name="tau_0" value="true"/>', "tau_0 = True"),
        ('<integer name="specular" value="1"/>', "specular = 1"),
        ('<texture type="checkerboard"/>', r"(.|\n)* has no name. Allowed: base, beta, "),
        ('<float name="_arg_0" value="0.5"/>', "has no name. Allowed: base, beta, "),
        ('<bsdf type="diffuse"/><bsdf type="diffuse"/>', "base: 2 nested BSDFs are given, one is allowed"),
    ],
    ids=["choice", "flag for a number", "number for a flag", "unnamed texture", "made-up name", "two bases"],
)
def test_bad_xml_is_named(rgb, children, message):
    with pytest.raises(RuntimeError, match=f"ParameterError: (.*){message}"):
        xml(children)


def test_a_made_up_name_is_refused_in_a_dictionary(rgb):
    with pytest.raises(RuntimeError, match=r"ParameterError: (.|\n)* has no name"):
        mi.load_dict({"type": "lambertsphere", "_arg_0": {"type": "checkerboard"}})


def test_a_parameter_of_another_class_keeps_its_name_there():
    class Other(Declared):
        roughness = Micrograin.beta
        tau_0 = Micrograin.tau_0

    assert [parameter.name for parameter in Other.declarations()] == ["roughness", "tau_0"]
    assert Micrograin.beta.name == "beta" and Micrograin.beta is not Other.roughness


class Paint(Declared):
    alpha = Axes("roughness", 0.3, low=0.01, high=1, usually=Usual(0.05, 0.5))
    shine = Choice("finish", options=("matt", "gloss"))
    ior = Texture("index", 1.5, low=1, high=3, when=("shine", "gloss"))
    size = Constant("what a table is made from", 0.2, low=0.1, high=1)
    metal = Conductor("metal", "none")

    def update(self):
        self.doubled = 2 * self.at("size", None, True)


class Varnished(Paint):
    coats = Texture("layers of varnish", 1.0, high=9)
    shine = Choice("finish of the varnish", options=("gloss", "matt"))


def parsed(model=Paint, **given):
    props = mi.Properties("paint")
    for name, value in given.items():
        props[name] = value
    return model.parse(props)


def test_a_subclass_has_the_parameters_of_its_base():
    names = [parameter.name for parameter in Varnished.declarations()]
    assert names == ["alpha", "shine", "ior", "size", "metal", "coats"]
    assert Varnished.shine.default == "gloss" and Paint.shine.default == "matt"


def test_axes_are_one_number_or_two(rgb):
    """What is not given has the default of the name without suffix."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    for given, names, expected in (
        ({}, ["alpha"], (0.3, 0.3)),
        ({"alpha": 0.5}, ["alpha"], (0.5, 0.5)),
        ({"alpha_u": 0.1, "alpha_v": 0.4}, ["alpha_u", "alpha_v"], (0.1, 0.4)),
        ({"alpha_v": 0.4}, ["alpha", "alpha_v"], (0.3, 0.4)),
    ):
        model = parsed(**given)
        assert list(model.alpha.textures) == [name for name in model.children() if "alpha" in name] == names
        assert model.alpha.isotropic == (len(names) == 1)
        np.testing.assert_allclose([float(x[0]) for x in model.at("alpha", si, True)], expected, rtol=1e-6)
    assert {row.name for row in Paint.rows()} > {"alpha", "alpha_u", "alpha_v"} < set(Paint.usual())


def test_the_value_at_a_point_is_within_the_range(rgb):
    """An optimiser's step may leave it, while no check sees it: it is differentiated."""
    model, si = parsed(alpha=0.5), dr.zeros(mi.SurfaceInteraction3f)
    value = mi.Float(7)
    dr.enable_grad(value)
    params = mi.traverse(model.alpha.textures["alpha"])
    params["value"] = value
    params.update()
    assert model.at("alpha", si, True)[0][0] == 1


@pytest.mark.parametrize("shine, ior", [("gloss", 1.7), ("gloss", None), ("matt", None)])
def test_a_parameter_counts_when_it_says_so(rgb, shine, ior):
    model = parsed(shine=shine, **({} if ior is None else {"ior": ior}))
    assert (model.ior is not None) == (shine == "gloss")


def test_a_parameter_that_does_not_count_is_refused(rgb):
    with pytest.raises(ParameterError, match='ior: needs shine = "gloss"'):
        parsed(ior=1.7)


def test_a_constant_has_derivatives_and_does_not_vary(rgb):
    model = parsed(size=0.4)
    params = mi.traverse(model.size)
    value = mi.Float(0.4)
    dr.enable_grad(value)
    params["value"] = value
    params.update()
    model.update()
    dr.backward(model.doubled)
    assert value.grad[0] == 2
    with pytest.raises(ParameterError, match="size: a texture, where one number"):
        parsed(size=mi.load_dict({"type": "checkerboard", "color0": 0.2, "color1": 0.3}))
    with pytest.raises(ParameterError, match=r"size = 2.0: expected a number in \[0.1, 1\]"):
        parsed(size=2.0)


def test_axes_that_do_not_vary(rgb):
    class Brushed(Declared):
        alpha = ConstantAxes("roughness", 0.3, low=0.01, high=1)

    model = parsed(Brushed, alpha_u=0.1)
    assert [float(x[0]) for x in model.at("alpha", dr.zeros(mi.SurfaceInteraction3f), True)] == pytest.approx(
        [0.1, 0.3]
    )
    assert {row.kind for row in Brushed.rows()} == {"number"}
    for given, complaint in (
        (2.0, r" = 2.0: expected a number in \[0.01, 1\]"),
        ("checkerboard", ": a texture, where one"),
    ):
        value = mi.load_dict({"type": given, "color0": 0.2, "color1": 0.3}) if given == "checkerboard" else given
        with pytest.raises(ParameterError, match="alpha_v" + complaint):
            parsed(Brushed, alpha_v=value)


def test_a_metal_is_its_reflectance(rgb):
    si = dr.zeros(mi.SurfaceInteraction3f)
    assert parsed().at("metal", si, True)(0.3) == 1
    gold = parsed(material="Au").at("metal", si, True)
    assert np.asarray(gold(mi.Float(0)))[0] == pytest.approx(1, abs=1e-6)
    assert np.asarray(gold(mi.Float(1)))[0] > 0.9


def test_usual_values_are_allowed():
    for model in MODELS.values():
        allowed = {name: both for parameter in model.declarations() for name, both in parameter.ranges().items()}
        usual = model.usual()
        assert set(allowed) == set(usual)
        for name, (low, high, logarithmic) in usual.items():
            assert allowed[name][0] <= low < high <= allowed[name][1] and not (logarithmic and low <= 0)
