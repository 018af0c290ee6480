"""d'Eon 2021, An analytic BRDF for materials with spherical Lambertian scatterers."""

from ...validation import lambertsphere
from ..results import Absent, Paper, Result

PAPER = Paper(
    "lambertsphere",
    lambertsphere.SECTIONS,
    [
        Result(
            "Eq. 1 to 5",
            "the phase function of a Lambertian sphere",
            "Its mean cosine is -4/9, and Eq. 5 samples it exactly.",
            "phase",
            "It does not.",
        ),
        Result(
            "Fig. 6",
            "the fit against random walks",
            "The fit of the zeroth mode agrees with a Monte Carlo simulation; fits of H are good to .5 and 1 %.",
            "brdf",
            "As printed it is not: Eqs. 22 and 28 are half of what they should be, and the product in Eqs. 23 and 24 "
            "is meant to be a power (4 % rms, and worse near the horizon). `published` has these corrected; "
            "`accurate` is fitted anew, with the second mode that Eq. 21 drops. The paper shows errors of single "
            "modes, without numbers; here they are of f.",
            findings=("accurate*",),
        ),
        Result(
            "Fig. 8",
            "the fast variant",
            "Eq. 41 is less accurate and cheaper.",
            "brdf",
            "It does not. Below an albedo of .25 it is clamped to zero over wide angles, and above .98 it gains "
            "energy, which the paper does not say.",
            findings=("fast*",),
        ),
        Result(
            "Eq. 39, 40",
            "albedo of the whole",
            "The Bond albedo follows from that of the spheres, and the reverse, by fits.",
            "energy",
            "Eqs. 39 and 40 err by .033 and .002; they are fitted anew to 1e-6. White spheres reflect all light here, "
            "to .3 %; with the paper's fits 98 to 99 %.",
        ),
        Result(
            "Fig. 1",
            "a ball of spheres, and the model on a smooth ball",
            "The finer the spheres (7 % of the volume), the nearer their appearance comes to the model's.",
            "ball",
            "With the spheres finite, there is a hot spot in front light that the model has not, so the ball is "
            "brighter than the model; see Fig. 10 for the limit. The paper's pictures have no numbers.",
            findings=(),
        ),
        Result(
            "Fig. 10",
            "packings from sparse to dense",
            "Fine sparse media darken and saturate; for dense packings a height field is a fair assumption.",
            "explicit",
            "In the sparse part it does not: away from retro-reflection ever sparser spheres come to the model. At "
            "exact retro-reflection single scattering is doubled at any density, which classical transport, and so "
            "the model, does not know. Dense packings, and the height-field models beside them, are not made.",
        ),
        Result(
            "Fig. 9, 11",
            "four diffuse BRDFs under three lights",
            "Lambertian spheres scatter back more, and have saturated silhouettes; Chandrasekhar's has a bright rim.",
            "sheet",
            "It does not, as far as one sees.",
            findings=(),
        ),
        Result(
            "Beyond the paper",
            "dust cloud and dusty surface",
            "Nothing: the paper has no volume with its phase function beside the surface.",
            "slab",
            "There is nothing to differ from. A deep slab by Mitsuba's `volpath` has the radiance of the BSDF.",
        ),
    ],
    [
        Absent(
            "Fig. 2",
            "three Legendre terms of the phase function",
            "The phase function is used as it is here, not truncated.",
        ),
        Absent(
            "Fig. 3",
            "how weak the second mode is",
            "It is not dropped here; `python -m asperity.models.lambertsphere.fit` has all modes by integral "
            "equations.",
        ),
        Absent("Fig. 4, 5, 7", "fits of constants and of the first mode", "These fits are replaced."),
    ],
)
