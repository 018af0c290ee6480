"""All views: each draws any material, and says what it cannot draw."""

from known import GOLD, GRAINS, GROOVES, lambertian, measurement  # isort: skip
import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from asperity import drawing
from asperity.errors import ParameterError, UnknownNameError
from asperity.goniophotometer import Points, Window
from asperity.lab import evaluate
from asperity.materials import Material

MODELS = [lambertian(), GOLD, GRAINS, GROOVES]


def numbers(figure):
    """All that lines, error bars and images hold."""
    for axes in figure.axes:
        yield from (np.asarray(line.get_ydata(), dtype=float) for line in axes.lines)
        yield from (np.ma.filled(image.get_array(), np.nan) for image in axes.images)


@pytest.mark.parametrize("view", drawing.VIEWS)
def test_every_view_draws_every_material(rgb, measured, view):
    """In one picture; where there is nothing to draw, below the surface, is NaN, and elsewhere no number is."""
    if view == "spectrum":
        mi.set_variant("llvm_ad_spectral")
    materials = MODELS if view == "spectrum" else [*MODELS, measured]
    figure = drawing.plot(materials, view)
    drawn = list(numbers(figure))
    assert drawn and all(np.isfinite(one).any() and not np.isinf(one).any() for one in drawn)
    text = " ".join(text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text")))
    assert all(material.name in text for material in materials)


OPTIONS = {"theta": (20.0,), "phi": 40.0, "scale": "log", "cosine": False, "channel": "R", "isolines": True}


@pytest.mark.parametrize("view", drawing.VIEWS)
def test_every_option_of_a_view_works(rgb, view):
    if view == "spectrum":
        mi.set_variant("llvm_ad_spectral")
    given = {name: OPTIONS[name] for name in drawing.option_names(view) if name in OPTIONS}
    assert any(np.isfinite(one).any() for one in numbers(drawing.plot([GROOVES], view, **given)))


BAD = {
    "view": ("polar", {}, UnknownNameError, r"unknown view 'polar'\. .*Allowed: lobes, slices"),
    "near view": ("lobe", {}, UnknownNameError, "Did you mean 'lobes'"),
    "option": ("lobes", {"theat": (3,)}, ParameterError, "theat: makes no sense with view lobes.*Did you mean 'theta'"),
    "below": ("lobes", {"theta": (95,)}, ParameterError, r"theta = 95.*\[0, 90\)"),
    "negative": ("hemisphere", {"theta": (-5,)}, ParameterError, r"theta = -5.*\[0, 90\)"),
    "NaN": ("slices", {"theta": (np.nan,)}, ParameterError, r"theta = nan.*\[0, 90\)"),
    "NaN azimuth": ("albedo", {"phi": np.nan}, ParameterError, "phi = nan"),
    "NaN difference": ("rusinkiewicz", {"phi_d": np.inf}, ParameterError, "phi_d = inf"),
    "none": ("lobes", {"theta": ()}, ParameterError, "theta: expected at least one number"),
    "many": ("lobes", {"theta": range(13)}, ParameterError, "theta: 13 angles of incidence.*room for 12"),
    "scale": ("lobes", {"scale": "logarithmic"}, UnknownNameError, "unknown scale.*Allowed: linear, log"),
    "channel": ("slices", {"channel": "X"}, UnknownNameError, "unknown channel 'X'.*mean, each, R, G, B"),
    "channels": ("hemisphere", {"channel": "each"}, ParameterError, "a map shows one channel"),
    "wavelengths": ("slices", {"wavelengths": (500,)}, ParameterError, "variant [a-z]*_ad_rgb has none"),
    "spectrum": ("spectrum", {}, ParameterError, "variant [a-z]*_ad_rgb: it has no spectra"),
    "several": ("sampling", {"theta": (1, 2)}, ParameterError, "one angle of incidence; 2 were given"),
}


@pytest.mark.parametrize("view, options, error, message", BAD.values(), ids=BAD)
def test_bad_options(rgb, view, options, error, message):
    with pytest.raises(error, match=message):
        drawing.plot([lambertian()], view, **options)


def test_bad_materials(rgb):
    with pytest.raises(ParameterError, match="at least one"):
        drawing.plot([])
    mirror, glass = (Material(name, {"type": name}) for name in ("conductor", "dielectric"))
    for one in (mirror, glass):
        with pytest.raises(ParameterError, match=f"{one.name} is all mirror.*view albedo"):
            drawing.plot([one])
    assert drawing.plot([mirror, glass], "albedo")
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match=r"variant scalar_rgb.*llvm_ad_rgb"):
        drawing.plot([lambertian()])


def test_a_bsdf_that_is_not_finite_is_named(rgb, monkeypatch):
    values = evaluate.at_pairs

    def broken(*arguments):
        found = values(*arguments).copy()
        found[0, 5] = np.nan
        return found

    monkeypatch.setattr(evaluate, "at_pairs", broken)
    with pytest.raises(ParameterError, match=r"matte is not finite at 1 of \d+ pairs.*the first at θ_i = 0°"):
        drawing.plot([lambertian()])


def test_part_of_a_bsdf_that_is_a_mirror_is_said_to_be_missing(rgb):
    figure = drawing.plot([Material("plastic", {"type": "plastic"})], "slices")
    assert figure.axes[0].get_title() == "plastic without its mirror"


def test_names_that_are_the_same_get_what_differs(measured):
    one, two = ({"type": "micrograin", "tau_0": tau, "beta": 1} for tau in (0.2, 0.4))
    named = drawing.distinct_names([Material("rust", one), Material("dust", one), Material("rust", two)])
    assert named == ["rust, tau_0 = 0.2", "dust", "rust, tau_0 = 0.4"]
    nested = [
        Material("rust", {"type": "micrograin", "base": {"type": "diffuse", "reflectance": r}}) for r in (0.2, 0.5)
    ]
    assert drawing.distinct_names(nested) == ["rust, base.reflectance = 0.2", "rust, base.reflectance = 0.5"]
    assert drawing.distinct_names([measured, measured]) == ["measured (1)", "measured (2)"]


def test_what_was_not_measured_is_not_drawn(rgb, measured):
    with pytest.raises(ParameterError, match=r"measured: not measured at θ_i = 45°, φ_i = 0°, but at \(0°, 0°\), \(30"):
        drawing.plot([lambertian(), measured], "slices", theta=(30, 45))
    with pytest.raises(ParameterError, match=r"measured: not measured at θ_i = 30°, φ_i = 90°"):
        drawing.plot([measured], "hemisphere", theta=(30,), phi=90)
    window = Material("window", measured=measurement(sensor=Window("retro", 10, 4)))
    with pytest.raises(ParameterError, match="window: a window was measured, not the hemisphere"):
        drawing.plot([window], "hemisphere")
    aside = Material("aside", measured=measurement(sensor=Points(((30.0, 90.0),))))
    with pytest.raises(ParameterError, match="nothing was measured in the plane"):
        drawing.plot([aside], "slices")
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(ParameterError, match=r"variant .*_ad_spectral.*other channels there than measured.*R, G, B"):
        drawing.plot([measured, lambertian()], "slices")


def test_the_page_shows_every_view():
    """A section each, with a picture that is there, and small."""
    docs = Path(__file__).parents[2] / "docs"
    page = (docs / "plotting.md").read_text()
    assert set(drawing.VIEWS) <= set(re.findall("^## (.*)$", page, re.MULTILINE))
    pictures = re.findall(r"\]\((pictures/.*?)\)", page)
    assert len(pictures) == len(drawing.VIEWS) + 1
    assert all((docs / picture).stat().st_size <= 60_000 for picture in pictures)
