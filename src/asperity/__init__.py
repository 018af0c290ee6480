"""asperity: BSDF models from explicit microgeometry, as Mitsuba 3 plugins.

``import asperity`` makes every model available to ``mi.load_dict`` and to XML scenes, in every variant, whether
``import mitsuba`` and ``mi.set_variant`` come before or after, and after every later switch. It sets no variant.
"""

import sys

from . import llvm, on_import

__version__ = "0.1.0"
__all__ = ["__version__", "llvm"]

llvm.choose()

if "mitsuba" in sys.modules:
    on_import.follow()
else:
    on_import.follow_once_imported()
