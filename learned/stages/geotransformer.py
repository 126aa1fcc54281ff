# SPDX-License-Identifier: MIT
"""GeoTransformer as a stage."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.learned.stages.network_matcher import NetworkMatcher

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridreg.learned.network import RegistrationNetwork


@dataclass(frozen=True, kw_only=True)
class GeoTransformer(NetworkMatcher):
    """Superpoints matched by a geometric transformer, points by optimal transport (Qin et al. 2022).

    Weights whose configuration says `self_attention="vanilla"` run without the geometric embedding. Weights with
    an overlapping mask predictor fit too: it takes part through the overlap stage alone.
    """

    image: ClassVar[bool] = False

    @classmethod
    def load_official(cls, path: str | os.PathLike[str], **fields: Any) -> Self:
        """Stage of a checkpoint that GeoTransformer's authors published (KITTI or 3DMatch), read at once.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        return cls.from_pretrained(path, **fields)

    def check(self, network: RegistrationNetwork) -> None:
        """Refuse weights that were trained to look at the image."""
        if network.vgam is not None:
            raise ValueError(
                f"GeoTransformer: the weights {self.weights!r} were trained with a visual-geometric attention, "
                'without which their features mean nothing; Vgam ("match.vgam") takes them'
            )
