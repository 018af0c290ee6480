"""Shared fixtures. asperity comes before mitsuba, since it chooses the LLVM that Dr.Jit loads."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import pytest


@pytest.fixture
def rgb():
    """The variant that most tests need."""
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture
def registry():
    """The models; those that a test registers are forgotten."""
    from asperity.models import MODELS

    before = dict(MODELS)
    yield MODELS
    MODELS.clear()
    MODELS.update(before)


@pytest.fixture(params=[v for v in mi.variants() if not v.startswith("cuda")])
def any_variant(request):
    """Every variant that runs without a GPU."""
    mi.set_variant(request.param)
    return request.param
