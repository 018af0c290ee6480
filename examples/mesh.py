"""A mesh of one's own, golden bumps, as a material: light is traced through it, and the result rendered."""

from itertools import product

import numpy as np

import asperity as asp

GOLD, N = {"type": "roughconductor", "material": "Au", "alpha": 0.1}, 32

# A tile of bumps that repeats: its opposite borders match.
grid = np.linspace(0, 2 * np.pi, N + 1)
x, y = np.meshgrid(grid, grid)
z = 1.2 * np.sin(x) * np.sin(y)
with open("bumps.obj", "w") as file:
    for vertex in np.stack([x, y, z], axis=-1).reshape(-1, 3):
        print("v {:.6f} {:.6f} {:.6f}".format(*vertex), file=file)
    for row, column in product(range(N), range(N)):
        a = row * (N + 1) + column + 1  # vertices of .obj files count from 1
        print("f", a, a + 1, a + N + 2, a + N + 1, file=file)

bumps = asp.measure("bumps.obj", theta=[0, 30, 60, 89], bsdf=GOLD, paths=100_000)
bumps.save("bumps.npz")  # values with standard errors; asp.evaluate("bumps.npz", ...) reads them
asp.render(bumps, size=96, spp=36).save("bumps.png")

flat, bumpy = asp.albedo(GOLD, 0), bumps.total_albedo.value[0]
print(f"Of green light, {flat[1]:.3f} leave flat gold, and {bumpy[1]:.3f} the bumps, where it bounces more than once.")
assert bumpy[1] < flat[1] - 0.03
