"""Where light goes that comes in at 60 degrees: a slice through the plane of incidence, of three materials."""

import numpy as np
from matplotlib import pyplot as plt

import asperity as asp

theta = np.linspace(-89, 89, 357)  # below 0: on the side that the light comes from
wo = np.stack([np.abs(theta), np.where(theta < 0, 0, 180)], axis=-1)

peaks = {}
for material in ("rusty-aluminium", "regolith", {"type": "diffuse", "reflectance": 0.2}):
    f = asp.evaluate(material, (60, 0), wo).mean(axis=-1)  # f cos θo, averaged over R, G and B
    name = material if isinstance(material, str) else "Lambert"
    plt.plot(theta, f, label=name)
    peaks[name] = theta[f.argmax()]

plt.xlabel("θo in the plane of incidence [°]")
plt.ylabel("f cos θo [1/sr]")
plt.legend()
plt.savefig("slice.png")

print(", ".join(f"{name}: brightest at {peak:g}°" for name, peak in peaks.items()))
assert peaks["regolith"] < peaks["Lambert"] == 0 < peaks["rusty-aluminium"]
