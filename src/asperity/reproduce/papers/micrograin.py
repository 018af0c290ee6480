"""Lucas et al. 2024, A Fully-correlated Anisotropic Micrograin BSDF Model."""

from ...validation import micrograin
from ..results import Absent, Paper, Result

THEIR_SCENE = "A render of their scene, which is not public. The preset `{}` is the same material on our object."

PAPER = Paper(
    "micrograin",
    micrograin.SECTIONS,
    [
        Result(
            "Fig. 5",
            "masking over the azimuth of the normal",
            "At θₘ 50° and θᵢ 64.5° G₁ depends on the azimuth of the normal through its local term alone: it is the "
            "distant term where the normal faces the direction, and 0 elsewhere, but for outliers that are numerical.",
            "masking",
            "It does not: the simulation agrees, without outliers. Ours decides on which side of the horizon a facet "
            "is before it traces, so the points where i·m is nearly 0 fall into cells that the border crosses.",
        ),
        Result(
            "Fig. 6",
            "the distant term over the angle of incidence",
            "The distant term of the masking function matches simulations exactly, for several τ₀ and elevations.",
            "distant",
            "It does not. The figure's parameters are not in the text: these are ours.",
        ),
        Result(
            "Eq. 23",
            "the base that two directions see",
            "The pores are visible by the area of two shadows less their overlap.",
            "pores",
            "Not with what follows from Eq. 23. The printed ellipse of the overlap (App. B) has a factor in the wrong "
            "place, and the printed probability of sampling the pores (Eq. 26) is too large: both are corrected here.",
        ),
        Result(
            "Fig. 7",
            "conductor grains at 86°",
            "With the correlation of directions (Eq. 18) the BRDF is that of the simulation, nearly perfectly; "
            "without it (Eq. 17) the peak of retro-reflection is missing.",
            "conductors",
            "It does not: every cell is within the noise, and Eq. 17 is refused. The figure's τ₀ and β are not in the "
            "text: these are ours.",
        ),
        Result(
            "Fig. 8",
            "diffuse grains at 86°",
            "The same for diffuse grains of albedo .5; the peak stays thin, as it is visibility's.",
            "diffuse",
            "It does not. The paper draws random points on grains in each evaluation; ours is a fixed quadrature, "
            "whose error of up to .5 % is allowed for.",
        ),
        Result(
            "Eq. 20",
            "grains on a base that reflects",
            "The BSDF of the bulk is seen through the pores, that of the grains beside it.",
            "bases",
            "It does not.",
        ),
        Result(
            "Fig. 9",
            "models of the same grains",
            "Only the new model reproduces the simulation (τ₀ .5, β 1, on black); those of Lucas 2023, d'Eon 2023 and "
            "Mérillou 2000 are alike, and far off. They assume other microgeometries.",
            "models",
            "It does not in this. Of the last two models only the paper's description was at hand, so their numbers "
            "are those of our reading of it.",
        ),
        Result(
            "Fig. 11",
            "exact retro-reflection",
            "With growing β the model without the correlation of directions, and that of Lucas 2023, deviate more: "
            "conductor grains, τ₀ .2, on a Lambertian base of albedo .5.",
            "retro",
            "It does not: both are refused from β 1 on. The paper shows renders and FLIP; here it is the BSDF.",
        ),
        Result(
            "Fig. 17",
            "the white furnace",
            "Single scattering loses energy: perfect conductors on a white diffuse base, for several τ₀ and β.",
            "furnace",
            "It does not: the model's albedo is the simulation's first order. The paper shows pictures, without "
            "numbers. `scattering: multiple`, which is not in the paper, gives the energy back.",
            tables=slice(0, 1),
        ),
        Result(
            "Fig. 18",
            "the share of single scattering in all",
            "What scatters more than once grows with τ₀, with β and with the angle of incidence.",
            "furnace",
            "With β it grows, as the paper says. With the angle it grows for flat grains (β .1) only: for others the "
            "share of the first order grows towards grazing, after a small dip at most. With τ₀ it grows near the "
            "normal, and shrinks at 85°. The simulation says so without the model; the paper gives no numbers.",
            findings=(),
            tables=slice(1, 2),
        ),
        Result(
            "Beyond the paper",
            "`scattering: multiple` against all orders",
            "Nothing: the paper leaves multiple scattering for later.",
            "multiple",
            "This lobe is an approximation. It is reported, not judged.",
        ),
    ],
    [
        Absent(
            "Fig. 1, 14, 16",
            "a Buddha of several materials",
            THEIR_SCENE.format("gilded`, `dirty-weave` or `verdigris"),
        ),
        Absent("Fig. 2 to 4, 19", "sketches of the geometry", "There is nothing to measure."),
        Absent("Fig. 10", "the models in a scene", THEIR_SCENE.format("gold-dust")),
        Absent(
            "Fig. 12, 13, 15", "mixtures, anisotropy and retro-reflection in scenes", THEIR_SCENE.format("dusty-wood")
        ),
        Absent("Supplement", "more of Fig. 7 to 9", "It is not at hand."),
    ],
)
