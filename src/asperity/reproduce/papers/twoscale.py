"""Holzschuch and Pacanowski 2017, A Two-Scale Microfacet Reflectance Model Combining Reflection and Diffraction."""

from ...validation import twoscale
from ..results import Absent, Paper, Result

PAPER = Paper(
    "twoscale",
    twoscale.SECTIONS,
    [
        Result(
            "Eq. 19, 25",
            "diffraction on one facet",
            "A facet keeps the share A of the light in the mirror direction, and diffracts the rest as generalised "
            "Harvey and Shack's theory says.",
            "heights",
            "Waves over random heights confirm A at all heights, and the lobe up to σ/λ .02, where it is of first "
            "order. The authors' plugin has twice the lobe, with which a mirror returns 1.44 of the light: the waves "
            "refuse it, and a lobe without (h·m)², which is not on the slides, too.",
        ),
        Result(
            "Eq. 32",
            "the convolution with the distribution of facets",
            "The lobe of all facets is the convolution of D and S, apart from masking and obliquity; it works better "
            "for smooth surfaces.",
            "facets",
            "It does not: the separation is good to a few percent up to α .05, and wrong by factors at grazing angles "
            "of rough facets.",
        ),
        Result(
            "Tables",
            "what is looked up",
            "The convolution is approximated by the lobe of other parameters, which a table of 2.5 MB gives; masking "
            "and σ_rel are tables of .4 and 8.9 MB.",
            "tables",
            "The fit of the convolution is 5 % off at best, and by factors beyond 45°. Here the integrals themselves "
            "are tabulated for a material, when it is loaded, in 60 KB.",
        ),
        Result(
            "Renormalisation",
            "energy",
            "S is divided by σ_rel, which is important for the conservation of energy.",
            "energy",
            "With it mirrors still return up to 1.003 to 1.23 of the light for σ/λ .02 to .25: that is Harvey and "
            "Shack's theory, not ours. `energy: conserving`, which is not in the paper, returns 1.005 at most.",
        ),
        Result(
            "Spectrum samples",
            "RGB against thirty wavelengths",
            "Alum-bronze and aluminium look alike with three colours and with thirty samples of the spectrum.",
            "wavelengths",
            "It does not by much: 1 to 6 % of the luminance, most of it the metal's index, of which RGB has three "
            "values. Aluminium, hematite, nickel and copper are ours; the bronze's index is not public.",
        ),
    ],
    [
        Absent(
            "measured materials",
            "nickel, grey and yellow plastic of MERL, and fits of them",
            "asperity brings no measured data, and the fitted parameters are not public.",
        ),
        Absent("lobe shapes", "against the Shifted Gamma Distribution", "Its fits are not at hand."),
        Absent("computation time", "+ 10 %", "`asperity bench twoscale` measures it on any machine."),
        Absent("the paper itself", "figures that are not on the slides", "Only the slides are at hand."),
    ],
)
