import mitsuba as mi
import numpy as np
import pytest

from asperity.cli import channels

PATH = {"type": "path"}
INTEGRATORS = {
    "path": PATH,
    "aov": {"type": "aov", "aovs": "d:depth,al:albedo", "i": PATH},
    "two": {"type": "aov", "aovs": "d:depth", "i": PATH, "j": PATH},
    "blind": {"type": "aov", "aovs": "al:albedo,d:depth"},
    "moment": {"type": "moment", "i": PATH},
    "moments": {"type": "aov", "aovs": "d:depth", "i": {"type": "moment", "p": PATH}},
}
AOVS = {"path": [], "aov": ["d.T", "al.R", "al.G", "al.B"], "blind": ["al.R", "al.G", "al.B", "d.T"]}
FORMATS = {"rgb": "RGB", "rgba": "RGBA", "xyz": "XYZ", "xyza": "XYZA", "luminance": "Y", "luminance_alpha": "YA"}
SKY, DEPTH = [0.8, 0.2, 0.1], 5.0


def render(pixel_format, integrator):
    """A black disk, in the left half of the picture, before a coloured sky; and the names of its channels."""
    film = {"type": "hdrfilm", "width": 2, "height": 1, "rfilter": {"type": "box"}, "pixel_format": pixel_format}
    to_world = mi.ScalarTransform4f().translate([0, 0, DEPTH]) @ mi.ScalarTransform4f().rotate([0, 1, 0], 180)
    black = {"type": "diffuse", "reflectance": 0.0}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": INTEGRATORS[integrator],
            "sensor": {"type": "perspective", "film": film, "fov": 1.0},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": SKY}},
            "wall": {"type": "rectangle", "to_world": to_world @ mi.ScalarTransform4f().translate([-1, 0, 0]),
                     "bsdf": black},
        }
    )  # fmt: skip
    image = np.array(mi.render(scene, spp=16))
    return image, channels.names(scene, image.shape[-1])


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("pixel_format", FORMATS)
def test_every_channel_has_its_name(rgb, pixel_format, integrator):
    image, names = render(pixel_format, integrator)
    assert len(names) == len(set(names)) == image.shape[-1]
    colours = list(FORMATS[pixel_format]) if integrator != "blind" else []
    assert names[: len(colours)] == colours
    if integrator in AOVS:
        assert names[len(colours) :] == AOVS[integrator]
    for name, value in zip(names, image.max(axis=(0, 1))):
        if name == "d.T":
            assert value == pytest.approx(DEPTH, rel=0.01)
        if name in ("A", "j.A"):
            assert value == 1


@pytest.mark.parametrize("pixel_format", FORMATS)
def test_a_png_shows_the_colours(rgb, pixel_format):
    """In sRGB, of the sky: 0.8, 0.2, 0.1, whose luminance is 0.32; grey where the film is."""
    image, names = render(pixel_format, "aov")
    png = np.array(channels.png(image, names)).reshape(1, 2, -1)
    (sky,) = png[0, image[0, :, names.index("d.T")] == 0]
    grey = pixel_format.startswith("luminance")
    linear = np.array([0.320] if grey else SKY)
    expected = 255 * (1.055 * linear ** (1 / 2.4) - 0.055)
    assert sky[: len(linear)] == pytest.approx(expected, abs=1)  # rounding
    assert len(sky) == len(linear) + ("a" in pixel_format.removeprefix("luminance"))


def test_a_png_is_not_premultiplied(rgb):
    image = np.array([[[0.4, 0.1, 0.05, 0.5]]])
    assert np.array(channels.png(image, list("RGBA"))).ravel().tolist() == [231, 123, 89, 127]


def test_of_other_channels_a_png_shows_colours_or_the_first(rgb):
    image = np.array([[[0.8, 0.2, 0.1, 0.5]]], np.float32)
    assert np.array(channels.png(image, ["al.R", "al.G", "al.B", "d.T"])).ravel().tolist() == [231, 123, 89]
    assert np.array(channels.png(image, ["n.X", "n.Y", "n.Z", "d.T"])).ravel().tolist() == [231]


def test_pixels_that_are_not_finite_are_found():
    image = np.zeros((3, 4, 2))
    assert channels.fault(image) is None
    image[2, 0, 0] = image[1, 3, 1] = np.nan
    image[2, 0, 1] = np.inf
    assert channels.fault(image).startswith("2 of 12 pixels are not finite") and "row 1, column 3" in channels.fault(
        image
    )
