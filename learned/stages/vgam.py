# SPDX-License-Identifier: MIT
"""Visual-geometric matching as a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from hybridreg.learned.stages.network_matcher import NetworkMatcher

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork


@dataclass(frozen=True, kw_only=True)
class Vgam(NetworkMatcher):
    """Superpoints attend to the image and their own cloud before GeoTransformer matches them (Cross3DReg, section 3.3).

    Works without an image too, from the clouds alone.
    """

    image: ClassVar[bool] = True
    parts: ClassVar[frozenset[str]] = frozenset({"backbone", "vgam", "transformer"})

    def check(self, network: RegistrationNetwork) -> None:
        """Refuse weights without a visual-geometric attention."""
        if network.vgam is None:
            raise ValueError(
                f"Vgam: the weights {self.weights!r} hold no visual-geometric attention; GeoTransformer "
                '("match.geotransformer") takes them'
            )
