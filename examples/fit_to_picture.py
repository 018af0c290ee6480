"""Where dust lies on a ball, and of what colour it is: a texture and a colour from one picture, by gradient descent."""

from pathlib import Path

import asperity  # isort: skip  (before mitsuba: it chooses an LLVM that works)
import drjit as dr
import mitsuba as mi
import numpy as np
from matplotlib import pyplot as plt

from asperity.models import MODELS

mi.set_variant("llvm_ad_rgb")
N, STEPS, START = 64, 100, 0.3  # rows of the texture; half of its 2 N columns are on the far side
LACQUER = {"type": "roughplastic", "alpha": 0.25, "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.06, 0.03]}}
TRUE_COLOUR = np.array([0.55, 0.45, 0.33])
PATINA = Path(asperity.__file__).parent / "scenes" / "textures" / "patina.png"
TRUE_TAU = np.tile(np.float32(mi.Bitmap(str(PATINA))), 2)[..., None] / 255  # eight times as fine as what is sought


def scene(tau_0, colour):
    """A lacquered ball on a floor, with so much dust of that colour on it."""
    to_world, texture = mi.ScalarTransform4f(), mi.Bitmap(np.float32(tau_0))
    grains = {"type": "micrograin", "specular": False, "diffuse_reflectance": {"type": "rgb", "value": list(colour)}}
    grains |= {"tau_0": {"type": "bitmap", "bitmap": texture, "raw": True}, "base": LACQUER}  # raw: numbers, no colours
    film = {"type": "hdrfilm", "width": 96, "height": 96, "rfilter": {"type": "box"}}
    camera = {"type": "perspective", "fov": 30, "film": film, "sampler": {"type": "multijitter"}}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 3},
            "camera": camera | {"to_world": to_world.look_at([0, -4, 1], [0, 0, 0], [0, 0, 1])},
            "sky": {"type": "constant", "radiance": 0.3},
            "sun": {"type": "directional", "direction": [1, 2, -1.5], "irradiance": 2.5},
            "floor": {"type": "rectangle", "to_world": to_world.translate([0, 0, -1]).scale(8)},
            "ball": {"type": "sphere", "to_world": to_world.rotate([0, 0, 1], 180), "bsdf": grains},
        },
        parallel=False,
    )


picture = mi.render(scene(TRUE_TAU, TRUE_COLOUR), spp=64, seed=STEPS)
fitted = scene(np.full((N, 2 * N, 1), START), [0.5, 0.5, 0.5])  # even, and grey
start = mi.render(fitted, spp=64)

parameters, usual = mi.traverse(fitted), MODELS["micrograin"].usual()
TAU, COLOUR = "ball.bsdf.tau_0.data", "ball.bsdf.diffuse_reflectance.value"
descent = mi.ad.Adam(lr=0.05, params={name: parameters[name] for name in (TAU, COLOUR)}, beta_2=0.95)
losses = []
for step in range(STEPS):
    parameters.update(descent)
    loss = dr.mean(dr.square(mi.render(fitted, parameters, spp=16, seed=step) - picture), axis=None)
    dr.backward(loss)
    descent.step()
    descent.set_learning_rate(0.05 * 0.97**step)
    for name in (TAU, COLOUR):
        descent[name] = dr.clip(descent[name], *usual[name.split(".")[2]][:2])
    losses.append(loss.array[0])
parameters.update(descent)

# What is seen of the ball, which is 1 from the origin: a texel counts if it is in the middle of a pixel.
what = np.array(mi.render(fitted, integrator=mi.load_dict({"type": "aov", "aovs": "p:position,uv:uv"}), spp=1))
u, v = what[abs(np.linalg.norm(what[..., -5:-2], axis=-1) - 1) < 0.01][:, -2:].T
seen = np.histogram2d(v, u, bins=(N, 2 * N), range=[[0, 1], [0, 1]])[0] > 0
tau_0, colour = np.array(descent[TAU])[..., 0], np.array(descent[COLOUR]).ravel()
true = TRUE_TAU.reshape(N, len(TRUE_TAU) // N, 2 * N, -1).mean(axis=(1, 3))
before, after = abs(START - true)[seen].mean(), abs(tau_0 - true)[seen].mean()

panels = {"picture": picture, "start": start, "found": mi.render(fitted, spp=64)}
panels = {title: mi.util.convert_to_bitmap(image) for title, image in panels.items()}
panels |= {"tau_0": true[:, :N], "tau_0 found, where it is seen": np.where(seen, tau_0, np.nan)[:, :N]}
figure, axes = plt.subplots(2, 3, figsize=(9, 6), layout="constrained")
for axis, (title, panel) in zip(axes.flat, panels.items()):
    axis.imshow(panel, vmin=0, vmax=1, cmap="gray")
    axis.set(title=title, xticks=[], yticks=[], facecolor="tab:blue")  # which shows where there is no number
axes[1, 2].semilogy(losses)
axes[1, 2].set(title="loss", xlabel="step")
figure.savefig("fit_to_picture.png", dpi=200)

print(f"Of the filling factor of {seen.sum()} texels, the mean error was {before:.3f}, and is {after:.3f}.")
print("The colour is", *(f"{x:.3f}" for x in colour), "where it was", *TRUE_COLOUR)
print(f"The loss fell to 1 / {losses[0] / np.mean(losses[-10:]):.0f}, of which most is noise.")
assert after < 0.06 and np.all(abs(colour / TRUE_COLOUR - 1) < 0.08) and np.mean(losses[-10:]) < losses[0] / 10
