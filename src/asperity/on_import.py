"""Registers the plugins right after Mitsuba is imported: ``import asperity`` and ``asperity --help`` are instant."""

from __future__ import annotations

import importlib.abc
import importlib.util
import sys


class _AfterMitsuba(importlib.abc.MetaPathFinder):
    """Steps in once, when somebody imports ``mitsuba``, lets it load as usual, then registers."""

    def find_spec(self, name, path=None, target=None):
        if name != "mitsuba":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_register(module):
                load(module)
                from . import plugin

                plugin.register()

            spec.loader.exec_module = load_and_register
        return spec


def register_after_mitsuba() -> None:
    """Arrange for `plugin.register` to run when Mitsuba is imported."""
    sys.meta_path.insert(0, _AfterMitsuba())
