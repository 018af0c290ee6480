import gc
import subprocess
import sys
import weakref
from importlib.metadata import entry_points

import drjit as dr
import mitsuba as mi
import pytest

import asperity

DUSTY = {"type": "micrograin", "tau_0": 0.4, "specular": False, "base": {"type": "diffuse"}}


def run(code: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)


def at_normal(n=1):
    si = dr.zeros(mi.SurfaceInteraction3f, n) if n > 1 else dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0, 0, 1)
    return si


@pytest.mark.parametrize(
    "code",
    [
        "import asperity, mitsuba as mi; mi.set_variant('llvm_ad_rgb')",
        "import asperity; import mitsuba as mi; mi.set_variant('llvm_ad_rgb')",
        "import mitsuba as mi; mi.set_variant('scalar_rgb'); import asperity",
        "import mitsuba as mi; import asperity; mi.set_variant('scalar_rgb')",
        "from asperity.models import MODELS; import mitsuba as mi; mi.set_variant('llvm_ad_rgb')",
        "import asperity.microfacet.albedo; import mitsuba as mi; mi.set_variant('scalar_rgb')",
        "import asperity.plugin; import mitsuba as mi; mi.set_variant('scalar_rgb')",
    ],
)
def test_registers_whatever_comes_first(code):
    result = run(code + "; print(mi.load_dict({'type': 'micrograin'}))")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("Micrograin")


def test_import_is_lazy():
    assert run("import asperity, sys; assert not {'mitsuba', 'drjit', 'numpy'} & set(sys.modules)").returncode == 0


def test_switching_there_and_back():
    for variant in ("llvm_ad_rgb", "scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral", "scalar_rgb"):
        mi.set_variant(variant)
        assert mi.load_dict(DUSTY).component_count() == 2


def test_evaluates_in_every_variant(any_variant):
    bsdf = mi.load_dict(DUSTY)
    value, _ = bsdf.eval_pdf(mi.BSDFContext(), at_normal(), mi.Vector3f(0, 0.6, 0.8))
    assert (
        0
        < float(
            dr.max(mi.unpolarized_spectrum(value), axis=None)[0] if dr.is_jit_v(value) else dr.max(value, axis=None)
        )
        < 1
    )
    albedo = bsdf.eval_diffuse_reflectance(at_normal())
    assert "nan" not in str(albedo)


def test_polarised_light_is_depolarised():
    mi.set_variant("llvm_ad_mono_polarized")
    value = mi.load_dict(DUSTY).eval(mi.BSDFContext(), at_normal(), mi.Vector3f(0, 0.6, 0.8))
    entries = [float(value[i, j][0][0]) for i in range(4) for j in range(4)]
    assert entries[0] > 0 and not any(entries[1:])


def test_xml_with_an_unnamed_base(rgb):
    xml = '<bsdf version="3.0.0" type="micrograin"><float name="tau_0" value="0.2"/><bsdf type="diffuse"/></bsdf>'
    assert "base = SmoothDiffuse" in str(mi.load_string(xml))


def test_xml_with_an_unnamed_texture_and_base(rgb):
    children = '<texture name="tau_0" type="checkerboard"/><bsdf type="diffuse"/>'
    xml = f'<bsdf version="3.0.0" type="micrograin">{children}</bsdf>'
    assert mi.load_string(xml).component_count() == 2


def test_values_that_no_check_can_see_stay_finite(rgb):
    """An optimiser's step out of range, or a vertex attribute."""
    bsdf = mi.load_dict(DUSTY)
    params = mi.traverse(bsdf)
    for key, value in (("tau_0.value", -0.2), ("tau_0.value", 1.2), ("beta.value", 0.0)):
        attached = mi.Float(value)
        dr.enable_grad(attached)
        params[key] = attached
        params.update()
        assert dr.all(dr.isfinite(bsdf.eval(mi.BSDFContext(), at_normal(), mi.Vector3f(0, 0.6, 0.8))), axis=None)


@pytest.mark.parametrize(
    "base", [{"type": "diffuse"}, {"type": "conductor", "material": "Ag"}], ids=["diffuse", "delta"]
)
def test_gradients_of_the_plain_path_integrator(rgb, base):
    """Of a weight, against finite differences: whatever was sampled, the density carries no gradient."""
    bsdf = mi.load_dict({"type": "micrograin", "material": "Au", "base": base})
    params, n = mi.traverse(bsdf), 1 << 18

    def mean_weight(tau_0):
        params["tau_0.value"] = tau_0
        params.update()
        rng = mi.PCG32(size=n)
        u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
        return dr.mean(bsdf.sample(mi.BSDFContext(), at_normal(n), *u)[1].x)

    value = mi.Float(0.3)
    dr.enable_grad(value)
    output = mean_weight(value)
    dr.forward(value)
    derivative = dr.grad(output)[0]
    difference = (mean_weight(mi.Float(0.31))[0] - mean_weight(mi.Float(0.29))[0]) / 0.02
    # Both are means of 2^18 weights with a standard deviation below 0.5, the difference over 0.02: 0.05 each.
    assert derivative == pytest.approx(difference, abs=0.15)


def test_the_entry_point_of_mitsuba_3_10():
    (point,) = (p for p in entry_points(group="mitsuba") if p.name == "asperity")
    assert point.load() is asperity


def test_traverse_finds_what_is_used(rgb):
    params = mi.traverse(mi.load_dict({**DUSTY, "tau_0": {"type": "checkerboard"}}))
    assert {"tau_0.color0.value", "beta.value", "diffuse_reflectance.value", "base.reflectance.value"} <= set(
        params.keys()
    )
    assert not any(key.startswith(("int_ior", "eta", "beta_x")) for key in params.keys())  # noqa: SIM118


def test_flags_follow_the_parameters(rgb):
    def flags(**parameters):
        return mi.load_dict({"type": "micrograin", **parameters}).flags()

    assert flags() & int(mi.BSDFFlags.GlossyReflection)
    assert not flags(specular=False) & int(mi.BSDFFlags.Glossy)
    assert flags(beta_x=0.2) & int(mi.BSDFFlags.Anisotropic) and not flags() & int(mi.BSDFFlags.Anisotropic)
    assert flags(base={"type": "roughdielectric"}) & int(mi.BSDFFlags.GlossyTransmission)


def test_components_add_up(rgb):
    """Each component alone, the base's counted after the grains', sums to the whole."""
    bsdf = mi.load_dict(
        {"type": "micrograin", "int_ior": 1.5, "base": {"type": "roughdielectric", "distribution": "ggx"}}
    )
    wo = dr.normalize(mi.Vector3f(0.3, 0.2, 0.9))
    whole = bsdf.eval(mi.BSDFContext(), at_normal(), wo)
    parts = [
        bsdf.eval(mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), n), at_normal(), wo)
        for n in range(bsdf.component_count())
    ]
    assert dr.allclose(sum(parts), whole, rtol=1e-5) and sum(dr.max(p.x)[0] > 0 for p in parts) == 3


def test_albedo_is_right(rgb):
    """Against 10^6 random samples; 256 stratified ones are good to 1 %."""
    bsdf = mi.load_dict(
        {"type": "micrograin", "material": "Au", "tau_0": 0.4, "beta": 0.5, "base": {"type": "diffuse"}}
    )
    n = 1 << 20
    rng = mi.PCG32(size=n)
    _, weight = bsdf.sample(
        mi.BSDFContext(), at_normal(n), rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    )
    assert dr.allclose(bsdf.eval_diffuse_reflectance(at_normal()), dr.mean(weight, axis=1), rtol=0.01)


def test_a_twosided_material_renders_from_below(rgb):
    bsdf = mi.load_dict({"type": "twosided", "bsdf": DUSTY})
    si = at_normal()
    si.wi = mi.Vector3f(0, 0, -1)
    assert dr.all(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0.6, -0.8)) > 0, axis=None)


def test_gradients_reach_a_scene_parameter(rgb):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 3},
            "light": {"type": "constant"},
            "sensor": {"type": "perspective",
                       "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                       "film": {"type": "hdrfilm", "width": 8, "height": 8}},
            "ball": {"type": "sphere", "bsdf": {"type": "micrograin", "material": "Au", "tau_0": 0.4}},
        }, parallel=False,
    )  # fmt: skip
    params = mi.traverse(scene)
    key = "ball.bsdf.tau_0.value"
    dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.mean(mi.render(scene, params, spp=64), axis=None))
    assert dr.isfinite(dr.grad(params[key]))[0] and dr.grad(params[key])[0] != 0


def test_models_die_at_once(rgb):
    """Without waiting for the cyclic collector, which may strike while Mitsuba traces a call to all BSDFs."""
    model = mi.load_dict({**DUSTY, "tau_0": {"type": "settled"}}).model
    watched = [weakref.ref(model), weakref.ref(model.tau_0.model)]
    gc.disable()
    del model
    alive = [reference() for reference in watched]
    gc.enable()
    assert alive == [None, None]


def test_memory_stays_flat_over_updates(rgb):
    params = mi.traverse(bsdf := mi.load_dict({**DUSTY, "specular": True, "int_ior": 1.5, "base": {"type": "diffuse"}}))
    sizes = []
    for step in range(60):
        params["tau_0.value"] = 0.2 + 0.005 * step
        params.update()
        dr.eval(bsdf.eval(mi.BSDFContext(), at_normal(), mi.Vector3f(0, 0.6, 0.8)))
        sizes.append(len(dr.whos(True).splitlines()))  # a line for each variable that Dr.Jit keeps
    assert sizes[-1] <= sizes[10]
