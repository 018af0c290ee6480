"""How much dust lies on that ball? The filling factor that makes a rendering match a picture, by gradient descent."""

import asperity  # noqa: F401  isort: skip  (before mitsuba: it chooses an LLVM that works)
import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

COPPER = {"type": "roughconductor", "material": "Cu", "alpha": 0.3}
scene = mi.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "prb"},
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 48, "height": 48},
        },
        "sky": {"type": "constant", "radiance": 0.5},
        "sun": {"type": "directional", "direction": [1, 2, -1]},
        "ball": {"type": "sphere", "bsdf": {"type": "micrograin", "tau_0": 0.6, "specular": False, "base": COPPER}},
    },
    parallel=False,
)
picture = mi.render(scene, spp=64)

parameters, name = mi.traverse(scene), "ball.bsdf.tau_0.value"
descent = mi.ad.SGD(lr=6.0, params={name: mi.Float(0.1)})  # nobody knows that it was 0.6
for step in range(25):
    parameters.update(descent)
    error = mi.render(scene, parameters, spp=8, seed=step) - picture
    dr.backward(dr.mean(dr.square(error), axis=None))
    descent.step()

found = descent[name][0]
print(f"Grains cover {found:.3f} of the ball; in the picture it was 0.6.")
assert abs(found - 0.6) < 0.02
