"""Smith's microfacet theory with an NDF that depends on height (d'Eon et al. 2023), for grains on a flat base."""

from __future__ import annotations

from typing import Any

import drjit as dr

from ...microfacet.numerics import one_minus_exp
from ..micrograin.grains import density
from .mixture import Layer, Mixture, Share

CITATION = """\
@inproceedings{DEon2023NonUniform,
  author    = {d'Eon, Eugene and Bitterli, Benedikt and Weidlich, Andrea and Zeltner, Tizian},
  title     = {Microfacet Theory for Non-Uniform Heightfields},
  booktitle = {ACM SIGGRAPH 2023 Conference Proceedings},
  year      = {2023},
  doi       = {10.1145/3588432.3591486}
}"""


class DEon(Mixture):
    """d'Eon et al. 2023: heights above 1 - tau_0 (as a quantile) belong to GGX metal, those below to a flat base.

    Single scattering. Reconstructed: the publication's text was not at hand, only its description in Lucas 2024,
    Sec. 5.2. Not verified: that the authors make two layers in this way, and that masking and shadowing are
    correlated by height as here. Roughness follows from beta by Lucas 2024, Eq. 28.
    """

    citation = CITATION

    def shares(self, si: Any, active: Any, layer: Layer) -> tuple[Share, Share]:
        """See `grain_share` and `base_share`."""
        depth = dr.pi * density(layer.tau_0)

        def slopes(i: Any, o: Any) -> Any:
            return layer.smith_lambda(i) + layer.smith_lambda(o)

        return lambda i, o: grain_share(depth, slopes(i, o)), lambda i, o: base_share(depth, slopes(i, o))


def grain_share(depth: Any, slopes: Any) -> Any:
    """Part of the grains' heights that both directions reach, int_w^1 u^(Lambda_i + Lambda_o) du, in [0, tau_0].

    w = 1 - tau_0 = exp(-depth), ``slopes`` = Lambda_i + Lambda_o >= 0. At the height of quantile u, Smith's masking is
    u^Lambda. Reconstructed: not verified against the publication's text.
    """
    return one_minus_exp(depth * (1 + slopes)) / (1 + slopes)


def base_share(depth: Any, slopes: Any) -> Any:
    """Part of the base that both directions reach, int_0^w w^(Lambda_i + Lambda_o) du, in [0, 1 - tau_0].

    Being flat, the base masks nothing itself. Reconstructed: not verified against the publication's text.
    """
    return dr.exp(-depth * (1 + slopes))
