"""`asperity convert`."""

import re
from pathlib import Path

import numpy as np
import pytest

from asperity.measured import load

GREY = '{"type": "diffuse", "reflectance": 0.5}'


def worked(result):
    assert result.exit_code == 0, result.output
    return result.output


def files():
    return sorted(path.name for path in Path().iterdir())


def test_a_material_goes_through_all_formats(asperity):
    """A diffuse one; the table is of f cosθ_i cosθ_o, linear in between: h² / 8 of 0.5 or so, h of 7.5 degrees."""
    given = GREY
    for name in ("a.bsdf", "b.npz", "c.csv", "d.binary"):
        output = worked(asperity("convert", given, name, "--resolution", "24"))
        worst = [float(x) for x in re.findall(r"([\d.]+)%", output)[1:4]]
        assert worst == sorted(worst) and worst[0] < 1 and output.endswith(f"{name}\n")
        given = name
    assert files() == ["a.bsdf", "b.npz", "c.csv", "d.binary"]
    assert np.median(load("d.binary").values) == pytest.approx(0.5 / np.pi, rel=0.01)


def test_settings_and_wavelengths_are_those_of_other_commands(asperity):
    options = ("--wavelengths", "450,550,650", "--set", "reflectance=0.25", "--resolution", "12")
    worked(asperity("convert", "diffuse", "a.csv", *options))
    found = load("a.csv")
    assert found.channels == ("450 nm", "550 nm", "650 nm") and np.allclose(found.values, 0.25 / np.pi, rtol=1e-5)
    result = asperity("convert", "a.csv", "b.bsdf", "--wavelengths", "450")
    assert result.exit_code == 2 and "a has its own channels" in result.output
    worked(asperity("convert", "a.csv", "b.bsdf", "--resolution", "12"))  # in a variant with its channels


def test_columns_are_named(asperity):
    Path("x.csv").write_text("in,out,around,much\n30,45,180,0.25\n30,40,180,0.25\n")
    columns = ("theta_i=in", "theta_o=out", "phi_o=around", "value=much")
    worked(asperity("convert", "x.csv", "y.npz", *(word for column in columns for word in ("--column", column))))
    assert load("y.npz").values.tolist() == [[0.25], [0.25]]


def test_nothing_is_overwritten_unasked(asperity):
    Path("x.csv").write_text("mine")
    result = asperity("convert", GREY, "x.csv", "--resolution", "8")
    assert result.exit_code == 2 and "it exists" in result.output and Path("x.csv").read_text() == "mine"
    worked(asperity("convert", GREY, "x.csv", "--resolution", "8", "--force"))
    result = asperity("convert", "x.csv", "x.csv", "--force")
    assert result.exit_code == 2 and "it is an input of this command" in result.output


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((GREY, "x.txt"), "the ending is '.txt'"),
        ((GREY, "x.csv", "--resolution", "3"), "resolution = 3"),
        (("none.binary", "x.csv"), "no such file"),
        (("brushed-steel", "x.binary", "--resolution", "8"), "anisotropic"),
        (("diffuse", "x.binary", "--wavelengths", "450,550,650"), ".binary holds R, G and B"),
    ],
    ids=lambda one: " ".join(one) if isinstance(one, tuple) else "",
)
def test_what_makes_no_sense_is_refused_and_leaves_no_file(asperity, arguments, words):
    result = asperity("convert", *arguments)
    assert result.exit_code == 2 and words in result.output and files() == []
