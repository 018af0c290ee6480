"""How much light does rough silver lose? Albedos of Mitsuba's model and of one that follows all bounces, in a table."""

import numpy as np

import asperity as asp

ALPHA, THETA = (0.1, 0.3, 0.5, 0.7, 1.0), (0, 30, 60, 80)

albedo = {
    model: np.array(
        [asp.albedo({"type": model, "material": "Ag", "alpha": alpha}, THETA).mean(axis=-1) for alpha in ALPHA]
    )
    for model in ("roughconductor", "vgroove")
}  # of each model: roughness x angle of incidence

for model, table in albedo.items():
    print(f"{model:15}", *(f"{theta:6}°" for theta in THETA))
    for alpha, row in zip(ALPHA, table):
        print(f"  alpha = {alpha:3}   ", *(f"{value:7.3f}" for value in row))

lost = albedo["vgroove"] - albedo["roughconductor"]
print(f"The rougher, the more is lost: up to {lost.max():.0%} of the light.")
assert lost[-1].max() > 0.1 > abs(lost[0]).max()
