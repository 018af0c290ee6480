"""Meneveaux et al. 2018, Rendering Rough Opaque Materials with Interfaced Lambertian Microfacets."""

from ...validation import interfacedlambertian
from ..pictures.interfacedlambertian import PICTURES
from ..results import Absent, Paper, Result

OUR_OBJECT = "Their scene is not public: our object and light are others."

PAPER = Paper(
    "interfacedlambertian",
    interfacedlambertian.SECTIONS | PICTURES,
    [
        Result(
            "Fig. 12",
            "materials of their elephants",
            "Glossy and rough materials, whose highlights show the roughness.",
            "fig12",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 13",
            "by index and roughness",
            "Highlights widen and bodies flatten as roughness grows; without an interface facets are Lambertian.",
            "fig13",
            OUR_OBJECT,
        ),
        Result(
            "Fig. 16",
            "beside Mitsuba's plastics",
            "`roughplastic` is much brighter; two bounces are slightly brighter than one, which is seen for large σ, "
            "and all bounces add little; neither plastic scatters back as the model does. One bounce takes the "
            "plastics' time, all bounces 30 to 60 % more.",
            "fig16",
            f"{OUR_OBJECT} At σ 1.5 `roughplastic` is no brighter any more. Bounces take no random paths here: "
            "`asperity bench interfacedlambertian` has the times.",
        ),
        Result(
            "Fig. 7",
            "reflectance of a rough white surface",
            "What reflects from one facet to the next grows with the roughness, and is more than 20 % of the light at "
            "σ 1 (Beckmann, index 1.5, K_d 1).",
            "reflectance",
            "It does not: 24 % is lost after one bounce, and 8 % after two. The paper has a curve, without numbers; "
            "an independent tracer's are beside ours.",
        ),
        Result(
            "Fig. 9",
            "one bounce, two, and all",
            "Bounces between facets matter for rough facets with bodies, and hardly for mirrors.",
            "bounces",
            "It does not, and there is no noise: the paper follows random paths, here two bounces are summed in "
            "closed form, and more are what two leave, spread as reciprocity allows. That is an approximation, whose "
            "errors are below; GGX and Gaussian facets of α 1 have larger ones, which are reported and not judged.",
            findings=("beckmann, α [0-9]*", "ggx*", "gaussian*"),
        ),
        Result(
            "Fig. 14",
            "anisotropic facets",
            "The model takes a roughness in each direction.",
            "bounces",
            "It does not. The paper shows a render under a point light; here the BRDF is compared.",
            findings=("beckmann, α (*",),
            pictures=(),
            tables=slice(0, 0),
        ),
        Result(
            "Fig. 10",
            "distributions and masking at 60°",
            "V-cavities differ from Smith's masking at grazing angles, less so for small σ and for an index near 1.",
            "curves",
            "It does not: V-cavities are traced, and Smith's masking, which no explicit surface has, is a sum over "
            "many facets. The text has the two roughnesses of Eq. 21 swapped.",
            findings=("*V-cavities, index*", "Smith*"),
            pictures=("fig10",),
        ),
        Result(
            "Fig. 15",
            "the fast approximation",
            "It deviates most for large indices and roughnesses, and at grazing angles.",
            "curves",
            "Eqs. 32 and 33 err by 9 to 60 % against the integral. They are replaced by a coarse sum, `approximate`, "
            "with an error of 2 %.",
            findings=("`approximate`*",),
            pictures=("fig15",),
        ),
    ],
    [
        Absent("Fig. 1, 11, 17", "renders of a mug and of elephants", "Their scenes are not public."),
        Absent("Fig. 2 to 4, 8; Table 1", "sketches and notation", "There is nothing to measure."),
        Absent(
            "Fig. 5",
            "colours under an interface",
            "Their reflectance spectra are not at hand; by sRGB patches of the ColorChecker it is in "
            "docs/interfacedlambertian.md.",
        ),
        Absent("Fig. 6", "a flat surface by the index", "Flat interfaces are Mitsuba's `plastic`; α is above 0 here."),
        Absent("Fig. 18", "Oren-Nayar with specular facets", "That combination is neither in Mitsuba nor here."),
        Absent("Fig. 19", "fits of measured materials", "asperity brings no measured data."),
        Absent(
            "Table 2",
            "distributions and masking",
            "A table of names: all of them are values of `distribution` and `masking`.",
        ),
    ],
)
