"""Shared fixtures. asperity comes before mitsuba, since it chooses the LLVM that Dr.Jit loads."""

import asperity  # noqa: F401  isort: skip
import sys

import mitsuba as mi
import pytest

from asperity.lab.checks.variants import usable_variants


def pytest_addoption(parser):
    parser.addoption("--variant", choices=mi.variants(), default="llvm_ad_rgb", help="in place of llvm_ad_rgb")


def pytest_configure(config):
    """Whoever sets `llvm_ad_rgb` gets `--variant`, and of others the one on the same backend.

    Not so in child processes, and where the check `variants` goes through all.
    """
    wanted, original = config.getoption("variant"), mi.set_variant
    backend, others = wanted.partition("_")[0], {"llvm_ad_rgb": wanted}

    def set_variant(*names):
        if sys._getframe(1).f_globals["__name__"] != usable_variants.__module__:
            names = [others.get(name, name.replace("llvm", backend)) for name in names]
        original(*names)

    if wanted != "llvm_ad_rgb":
        mi.set_variant = set_variant


@pytest.fixture
def rgb():
    """The variant that most tests need; its name."""
    mi.set_variant("llvm_ad_rgb")
    return mi.variant()


@pytest.fixture
def registry():
    """The models; those that a test registers are forgotten."""
    from asperity.models import MODELS

    before = dict(MODELS)
    yield MODELS
    MODELS.clear()
    MODELS.update(before)


@pytest.fixture(params=usable_variants()[0])
def any_variant(request):
    """Every variant that runs on this machine."""
    mi.set_variant(request.param)
    return request.param
