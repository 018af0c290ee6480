"""One dust, twice: a cloud of it in the air, and a ball whose surface is of it. From afar they look alike."""

import asperity  # noqa: F401  isort: skip  (before mitsuba: it chooses an LLVM that works)
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

ALBEDO = {"type": "rgb", "value": [0.9, 0.8, 0.6]}  # of a particle
CLOUD = {
    "bsdf": {"type": "null"},  # nothing but air around it; light flies a 40th of its width from particle to particle
    "interior": {"type": "homogeneous", "sigma_t": 20.0, "albedo": ALBEDO, "phase": {"type": "lambertsphere_phase"}},
}
SURFACE = {"bsdf": {"type": "lambertsphere", "albedo": ALBEDO}}

scene = mi.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1},
        "sensor": {
            "type": "orthographic",  # so that both are seen from the same direction
            "to_world": mi.ScalarTransform4f().look_at([0, -5, 0], [0, 0, 0], up=[0, 0, 1]).scale(2.2),
            "film": {"type": "hdrfilm", "width": 128, "height": 64},
        },
        "sun": {"type": "directional", "direction": [1, 2, -1], "irradiance": 3.0},
        "cloud": {"type": "sphere", "center": [-1.1, 0, 0]} | CLOUD,
        "ball": {"type": "sphere", "center": [1.1, 0, 0]} | SURFACE,
    },
    parallel=False,
)
image = np.array(mi.render(scene, spp=64))
mi.util.write_bitmap("dust.png", image)

cloud, ball = image[:, :64].mean(axis=(0, 1)), image[:, 64:].mean(axis=(0, 1))
print(
    "The cloud is", *(f"{ratio:.3f}" for ratio in cloud / ball), "times as bright as the ball, in red, green and blue."
)
assert np.all(abs(cloud / ball - 1) < 0.05)
