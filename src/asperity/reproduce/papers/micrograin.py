"""Lucas et al. 2024, A Fully-correlated Anisotropic Micrograin BSDF Model."""

from ...validation import micrograin
from ..pictures.micrograin import PICTURES
from ..results import Absent, Paper, Result

OUR_OBJECT = "Their scene is not public: our object and light are others."
OUR_COLOURS = f"{OUR_OBJECT} Where the paper gives no colours they are ours."


PAPER = Paper(
    "micrograin",
    micrograin.SECTIONS | PICTURES,
    [
        Result(
            "Fig. 1",
            "five materials",
            "Grains on gold, dusty wood, moldy glass, grains with two colours on aluminium, and dirty weave.",
            "fig1",
            OUR_COLOURS,
        ),
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
            "Fig. 10",
            "the models in a render",
            "The model of Mérillou 2000 differs markedly; that of d'Eon 2023 is nearer.",
            "fig10",
            f"{OUR_OBJECT} Its filling factors are not in the text, these are ours. The paper has FLIP differences.",
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
            "Fig. 12",
            "mixtures by the filling factor",
            "τ₀ mixes the appearance of grains and bulk.",
            "fig12",
            f"{OUR_OBJECT} So are the values of τ₀.",
        ),
        Result(
            "Fig. 13",
            "diffuse anisotropy",
            "Effects at grazing angles vary in intensity with τ₀, and in orientation with the anisotropy.",
            "fig13",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 14",
            "specular anisotropy",
            "Two crossed layers of anisotropic grains change with the view: coated ones are like a corrugated sheet, "
            "aluminium ones like a sculpture.",
            "fig14",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 15",
            "retro-reflection in a render",
            "The correlation of directions is subtle in light from the side, and pronounced where light and view are "
            "aligned.",
            "fig15",
            f"{OUR_OBJECT} The paper has FLIP differences.",
        ),
        Result(
            "Fig. 16",
            "correlated colours",
            "Grains whose reflectance varies with their height or normal show colours that shift with the angle.",
            "fig16",
            OUR_COLOURS,
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
        Absent("Fig. 2 to 4, 19", "sketches of the geometry", "There is nothing to measure."),
        Absent("Supplement", "more of Fig. 7 to 9", "It is not at hand."),
    ],
)
