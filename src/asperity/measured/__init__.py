"""Measured BRDFs from files, one file a format; all become a `BRDF`.

>>> chrome = load("chrome.binary")
>>> chrome.values[:, 0]
"""

from .brdf import BRDF as BRDF
from .brdf import from_measurement as from_measurement
