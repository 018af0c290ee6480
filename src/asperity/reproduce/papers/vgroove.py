"""Lee et al. 2018, Practical Multiple Scattering for Rough Surfaces."""

from ...validation import vgroove
from ..pictures.vgroove import PICTURES
from ..results import Absent, Paper, Result

OUR_OBJECT = "Their scene is not public: our object and light are others."

PAPER = Paper(
    "vgroove",
    vgroove.SECTIONS | PICTURES,
    [
        Result(
            "Fig. 1",
            "worn metals",
            "Gold, silver and copper of varying roughness keep their brightness and colour with all bounces.",
            "fig1",
            f"{OUR_OBJECT} So are the maps of roughness.",
        ),
        Result(
            "Fig. 6",
            "against one bounce",
            "Cook and Torrance's model gets duller as roughness grows; with all bounces it does not. That costs 15 to "
            "20 % more time.",
            "fig6",
            f"{OUR_OBJECT} `asperity bench vgroove` has the time on any machine.",
        ),
        Result(
            "Fig. 7",
            "anisotropic aluminium",
            "As roughness grows along y the metal keeps its appearance, highlights above all.",
            "fig7",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 8",
            "symmetric and non-symmetric grooves",
            "Non-symmetric grooves differ subtly for low roughness; for high roughness they scatter back more, and "
            "the reflection in the mirror direction is softer.",
            "fig8",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 9",
            "three distributions",
            "The model works with any distribution of normals.",
            "fig9",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 10",
            "chess pieces",
            "Metals and metal oxides of a chess set, with textured roughness.",
            "fig10",
            OUR_OBJECT,
        ),
        Result(
            "Table 1",
            "the kaleidoscope against random walks",
            "The L1 error of shares by bounces is .003 at most and .0005 in the mean for 6444 symmetric grooves, .004 "
            "and .0005 for non-symmetric ones.",
            "kaleidoscope",
            "It does not; but with independent random rays, as the paper has it, the noise alone would be some "
            "percent: ours are stratified, and what is left is their number. Eq. 6 as printed lets a share be "
            "negative, and then errs by up to 3.6; it is clamped here. Tilts of 90°, where a facet has no width, are "
            "left out.",
        ),
        Result(
            "Fig. 11",
            "the BRDF by bounces",
            "The analytic BRDF of symmetric grooves matches a Monte Carlo simulation closely, bounce by bounce: GGX, "
            "α .3, .5, .7 and 1, at 0 to 80°.",
            "bounces",
            "It does not, with a hundred times the paths of the paper. Within 6° of the mirror direction f has a pole "
            "that few paths find, so cells there are not judged. The densities of the paper's sampling (its Section "
            "6) are replaced.",
        ),
        Result(
            "Supplement",
            "other distributions, anisotropy, independent facets",
            "The same holds for Beckmann and Phong facets, and for non-symmetric grooves.",
            "nonsymmetric",
            "Not by the printed normalisations of Appendix C, which are all wrong (their reciprocals, and constants); "
            "with corrected ones it does not. The supplement itself is not at hand.",
        ),
        Result(
            "Fig. 12",
            "white furnace",
            "With all bounces spheres vanish before a white background, with symmetric and with non-symmetric "
            "grooves; with one, as by Cook and Torrance, they are dark: GGX, α .5.",
            "furnace",
            "By at most .1 %, which bounces more often than the default allows.",
        ),
        Result(
            "Table 2",
            "how many bounces there are",
            "For 90, 95 and 99 % of the facets, and α .5, .7 and 1: 2 to 4 bounces of Beckmann facets, 2 to 16 of "
            "Phong and 3 to 16 of GGX ones.",
            "number",
            "It does not. The columns of Phong are α too: the exponent is 2 / α² - 2, which the paper does not say.",
        ),
    ],
    [
        Absent("Fig. 2 to 5", "sketches of the geometry", "There is nothing to measure."),
        Absent(
            "Fig. 13",
            "convergence against Cook and Torrance",
            "Its samples are drawn in another way here: `asperity bench vgroove` has variance and time against "
            "`roughconductor`, `python benchmarks/convergence.py` against the paper's own sampling.",
        ),
        Absent(
            "Fig. 14", "discontinuities", "A render of a cylinder of theirs. The kinks are in the pictures of Fig. 11."
        ),
        Absent("Fig. 15", "against Heitz et al. 2016", "Their stochastic model is neither in Mitsuba nor here."),
    ],
)
