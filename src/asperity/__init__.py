"""asperity: BSDF models from explicit microgeometry, as Mitsuba 3 plugins.

``import asperity`` makes every model available to ``mi.load_dict`` and to XML scenes, in every variant, whether
``mi.set_variant`` comes before or after, and after every later switch. It sets no variant.
"""

from asperity import llvm as _llvm

_llvm.choose()

from asperity import plugin as _plugin  # noqa: E402  (Dr.Jit reads the choice made above when it is imported)

_plugin.register()

__version__ = "0.1.0"
__all__ = ["__version__"]
