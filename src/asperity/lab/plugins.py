"""Plugins of your own, from a Python file, in every variant.

A class of Mitsuba belongs to the variant in which it was defined: a file that derives one, and calls
``mi.register_bsdf``, is run anew in each.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import mitsuba as mi

from asperity.errors import ParameterError, readable

_loaded: dict[Path, Callable[[str | None, str | None], None]] = {}


def load(path: str | Path) -> None:
    """Run a file that registers plugins: now, if a variant is set, and after every later switch of variant.

    >>> load("my_bsdf.py")
    >>> check({"type": "my_bsdf"})

    It may import what lies beside it. A variant that it sets itself is ignored while it runs. Loaded again, it is read
    again. Raises UnreadableFileError, or ParameterError if it cannot be run.
    """
    path = readable("plugin", path, (".py",)).resolve()
    if (folder := str(path.parent)) not in sys.path:
        sys.path.insert(0, folder)

    helpers: set[str] = set()

    def run(_old: str | None, _new: str | None) -> None:
        for name in helpers:  # they belong to a variant, too
            sys.modules.pop(name, None)
        others = set(sys.modules)
        try:
            with _same_variant():
                runpy.run_path(str(path), run_name=path.stem)
        except Exception as error:
            raise ParameterError(f"{path.name} fails: {type(error).__name__}: {error}") from error
        finally:
            new = {name: getattr(sys.modules[name], "__file__", None) for name in sys.modules.keys() - others}
            helpers.update(name for name, file in new.items() if file and Path(file).parent == path.parent)

    forget(path)
    if mi.variant() is not None:
        run(None, mi.variant())
    mi.detail.add_variant_callback(run)
    _loaded[path] = run


@contextmanager
def _same_variant() -> Iterator[None]:
    """Let ``mi.set_variant`` do nothing: it would call back whoever is called."""
    switch, mi.set_variant = mi.set_variant, lambda *_: None
    try:
        yield
    finally:
        mi.set_variant = switch


def forget(path: str | Path) -> None:
    """Run a file no longer, if it was loaded; what it registered stays."""
    if (run := _loaded.pop(Path(path).resolve(), None)) is not None:
        mi.detail.remove_variant_callback(run)
