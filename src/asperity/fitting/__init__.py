"""Any model to any measured BRDF: which parameters explain it, how sure they are, and how good the model is.

>>> found = fit(measured.load("chrome.binary"), "twoscale")
>>> found["bsdf_0.alpha"], found.errors.log_cosine
>>> rank(measured.load("chrome.binary"))[0].name
"""

from .candidates import CANDIDATES as CANDIDATES
from .data import data as data
from .fit import fit as fit
from .fit import rank as rank
from .result import Fit as Fit
