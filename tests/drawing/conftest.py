import pytest
from known import measurement

from asperity.materials import Material


@pytest.fixture
def measured():
    """A Lambertian, as if it had been measured."""
    return Material("measured", measured=measurement())
