# SPDX-License-Identifier: MIT
"""GeoTransformer as a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hybridreg.learned.stages.network_matcher import NetworkMatcher

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork


@dataclass(frozen=True, kw_only=True)
class GeoTransformer(NetworkMatcher):
    """Superpoints matched by a geometric transformer, points by optimal transport (Qin et al. 2022).

    Weights whose configuration says `self_attention="vanilla"` run without the geometric embedding. Weights with an
    overlapping mask predictor fit too: it is used only through the overlap stage.
    """

    def check(self, network: RegistrationNetwork) -> None:
        """Refuse weights that were trained with the image."""
        if network.vgam is not None:
            raise ValueError(
                f"GeoTransformer: the weights {self.weights!r} were trained with a visual-geometric attention, "
                'without which their features are meaningless; Vgam ("match.vgam") takes them'
            )
