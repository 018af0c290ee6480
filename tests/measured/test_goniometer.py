"""Tables of goniometers: how columns are found, and what is refused."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest
from data import real

from asperity.errors import UnreadableFileError
from asperity.goniophotometer.sensors import directions
from asperity.measured import BRDF, goniometer

NIST = "lambda,thetai,phi,thetar,phir,f_r11,f_r12/f_r11"


@pytest.fixture
def table(tmp_path):
    def write(text, **options):
        path = tmp_path / "sample.csv"
        path.write_text(text) if isinstance(text, str) else path.write_bytes(text)
        return goniometer.load(path, **options)

    return write


SAME = [
    "theta_i,phi_i,theta_o,phi_o,value\n30,0,45,180,0.25\n",
    "# measured by hand\nThetaI [deg];PhiI [deg];ThetaR [deg];PhiR [deg];BRDF\n30;0;45;180;0,25\n",
    "theta_in\ttheta_r\tphi_r\tf_r\n30\t45\t180\t0.25\n\n",
    "phi_o_rad theta_o_rad theta_i_rad brdf\n3.14159265 0.78539816 0.52359878 0.25\n",
    "ti,to,po,y\n-30,-45,180,0.25\n",
]


@pytest.mark.parametrize("text", SAME)
def test_columns_and_units_are_guessed(table, text):
    found = table(text)
    turn = 180 if "-30" in text else 0  # a negative θ is on the other side
    assert np.allclose(found.wi, directions([(30, turn)]), atol=1e-7)
    assert np.allclose(found.wo, directions([(45, 180 + turn)]), atol=1e-7)
    assert found.values == pytest.approx(0.25) and found.channels == ("Y",) and found.source == "sample"


def test_columns_and_units_are_as_named(table):
    columns = {"theta_i": "a", "theta_o": "b", "phi_o": "c", "value": "d"}
    found = table("a,b,c,d\n0.5,0.25,1,0.25\n", columns=columns, cosine=True, degrees=True)
    assert np.allclose(found.incident, [(0.5, 0)]) and np.allclose(found.outgoing, [(0.25, 1)])
    assert found.values == pytest.approx(0.25 / np.cos(np.radians(0.25)), rel=1e-12)
    with pytest.raises(UnreadableFileError, match=r"unknown column 'thing'\. Did you mean 'thin'"):
        table("thin,b\n1,2\n", columns={"theta_i": "thing"})


@pytest.mark.parametrize(
    "columns, channels, errors",
    [
        ("R,G,B", ("R", "G", "B"), False),
        ("red,green,blue,sigma red,sigma green,sigma blue", ("R", "G", "B"), True),
        ("450 nm,550.5 nm", ("450 nm", "550.5 nm"), False),
        ("450,550", ("450 nm", "550 nm"), False),
        ("value,error", ("Y",), True),
    ],
)
def test_channels_and_errors(table, columns, channels, errors):
    numbers = [0.1 * k for k in range(1, columns.count(",") + 2)]
    found = table(f"theta_i,theta_o,phi_o,{columns}\n30,45,0,{','.join(map(str, numbers))}\n")
    assert found.channels == channels and np.allclose(found.values, numbers[: len(channels)])
    assert found.errors is None if not errors else np.allclose(found.errors, numbers[len(channels) :])


def test_wavelengths_in_rows_are_put_together(table):
    """In µm; a pair measured twice is two; what lacks a wavelength is counted."""
    rows = ["0.532,-75,0,60,0,2,9", "0.351,-75,0,60,0,1,9", "0.351,-75,0,60,0,3,9", "0.351,-60,0,10,0,5,9"]
    found = table("\n".join([NIST, *rows, "0.532,-75,0,60,0,4,9"]))
    assert found.channels == ("351 nm", "532 nm") and found.values.tolist() == [[1, 2], [3, 4]]
    assert np.allclose(found.incident, (75, 180)) and np.allclose(found.outgoing[:, 0], 60)
    assert found.left_out == {"without all wavelengths": 1}


def test_rows_without_a_value_or_below_the_surface_are_counted(table):
    found = table("theta_i,theta_o,phi_o,value\n30,45,0,\n30,45,0,nan\n30,120,0,1\n30,45,0,-0.01\n")
    assert found.left_out == {"without a value": 2, "below the surface": 1}
    assert found.values.tolist() == [[-0.01]]  # noise about 0


def test_a_table_comes_back_as_it_was(tmp_path):
    wi, wo = directions([(0, 0), (60, 20)]), directions([(30, 0), (89, 200)])
    one = BRDF(wi, wo, np.array([[0.1, 2, 3], [4, 5, 6e-7]]), ("R", "G", "B"), np.ones((2, 3)), False)
    goniometer.save(one, tmp_path / "x.csv")
    found = goniometer.load(tmp_path / "x.csv")
    assert np.allclose(found.wi, wi, atol=1e-8) and np.allclose(found.wo, wo, atol=1e-8)  # nine digits
    assert np.allclose(found.values, one.values, rtol=1e-8) and np.allclose(found.errors, 1)
    assert found.channels == one.channels and not found.isotropic


HEAD = "theta_i,theta_o,phi_o,value\n"
FLAWED = {
    "empty": ("", "is empty"),
    "blank": ("\n\n", "no header"),
    "no rows": (HEAD, "a header, and no rows"),
    "cut short": (HEAD + "30,45,0,1\n30,4", "row 2 has 2 cells, and the header 4"),
    "no angle": ("theta_i,phi_o,value\n1,2,3\n", "no column looks like theta_o; it has theta_i, phi_o, value"),
    "no value": ("theta_i,theta_o,phi_o,x\n1,2,3,4\n", "no column looks like value"),
    "word": (HEAD + "30,45,0,1\n30,x,0,1\n", "theta_o \\(column 'theta_o'\\) is no number in row 2"),
    "infinite": (HEAD + "30,45,0,inf\n", "value in row 1 is inf"),
    "infinite angle": (HEAD + "30,inf,0,1\n", "theta_o .* is no number in row 1"),
    "wild angle": (HEAD + "30,1e9,0,1\n", "theta_o is 1e\\+09 degrees"),
    "all below": (HEAD + "30,95,0,1\n", "empty"),
    "all negative errors": (HEAD.replace("value", "value,error") + "30,45,0,1,-1\n", "below 0"),
    "binary": (b"\xff\xfe\0\1\2", "no table"),
    "zeros": (b"\0" * 100, "cannot read"),
    "one wavelength is 0": ("lambda," + HEAD + "0,30,45,0,1\n", "above 0"),
    "none is whole": ("lambda," + HEAD + "500,30,45,0,1\n600,30,46,0,1\n", "empty"),
}


@pytest.mark.parametrize("name", FLAWED)
def test_what_is_damaged_is_refused_by_name(table, name):
    text, words = FLAWED[name]
    with pytest.raises(UnreadableFileError, match=words) as refusal:
        table(text)
    assert "sample.csv" in str(refusal.value)


def test_the_sample_of_nist():
    """Its θi is negative and φr = 0 is forward: the largest value has to be near the mirrored direction."""
    found = goniometer.load(real("nist/PTFE.csv"))
    assert found.channels == ("351 nm", "532 nm", "633 nm", "1064 nm")
    assert len(found) == 1824 and not found.left_out and found.isotropic
    largest = found.values[:, 1].argmax()
    assert np.allclose(found.incident[largest], (75, 180)) and np.allclose(found.outgoing[largest], (80.0258, 336.0375))
    assert found.values[largest].tolist() == [0.639, 0.662, 0.660, 0.714]
