"""Values against the wavelength."""

from known import lambertian  # isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.drawing import plot
from asperity.errors import ParameterError
from asperity.materials import Material

RAMP = {"type": "irregular", "wavelengths": "400, 700", "values": "0.1, 0.7"}


@pytest.fixture
def spectral():
    mi.set_variant("llvm_ad_spectral")


def test_a_lambertian_has_its_spectrum(spectral):
    """ρ(λ)/π cos θ_o towards the mirrored direction, the normal and the light."""
    axes = plot([Material("ramp", {"type": "diffuse", "reflectance": RAMP})], "spectrum").axes[0]
    for line, angle in zip(axes.lines, (45, 0, -45)):
        wavelength, value = line.get_data()
        assert (wavelength[0], wavelength[-1], len(wavelength)) == (400, 700, 61)
        reflectance = 0.1 + 0.6 * (wavelength - 400) / 300
        assert value == pytest.approx(reflectance / np.pi * np.cos(np.radians(angle)), rel=1e-5)


def test_one_angle_of_incidence_above_the_surface(spectral):
    with pytest.raises(ParameterError, match="one angle of incidence; 2 were given"):
        plot([lambertian()], "spectrum", theta=(10, 20))
    with pytest.raises(ParameterError, match=r"theta_o = \[95.0\]: expected signed angles in \(-90, 90\)"):
        plot([lambertian()], "spectrum", theta_o=(95,))
