"""Registers the plugins at every switch of variant, without importing Mitsuba: `asperity --help` is instant.

Nothing of ours that imports Mitsuba is imported before the first switch: it may itself be what brings Mitsuba in, and
half imported.
"""

from __future__ import annotations

import importlib.abc
import importlib.util
import sys
from typing import Any


def follow() -> None:
    """Register the plugins in the active variant, if there is one, and whenever it is switched from now on."""
    import mitsuba  # anew: importing it, it puts another module in its place

    mitsuba.detail.add_variant_callback(_switched)
    if mitsuba.variant() is not None:
        _switched(None, mitsuba.variant())


def follow_once_imported() -> None:
    """`follow` Mitsuba as soon as somebody imports it."""
    sys.meta_path.insert(0, _AfterMitsuba())


def _switched(_old: str | None, _new: str) -> None:
    from . import plugin

    plugin.register()


class _AfterMitsuba(importlib.abc.MetaPathFinder):
    """Steps in once, when somebody imports ``mitsuba``, and lets it load as usual."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        if name != "mitsuba":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_follow(module: Any) -> None:
                load(module)
                follow()

            spec.loader.exec_module = load_and_follow  # type: ignore[method-assign]
        return spec
