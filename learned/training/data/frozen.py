# SPDX-License-Identifier: MIT
"""What comes of a backbone that a phase does not train, computed once a pair where no augmentation changes it."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import BackboneConfig
from hybridreg.learned.cross3dreg.encodings import Known
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.pyramid.patches import Patches
from hybridreg.learned.training.data.augmentation import Augmentation
from hybridreg.learned.training.recipe import Phase


class FrozenFeatures:
    """The backbone's output and the patches by pair, in half precision and short integers: 1.2 MB for 5,000 points.

    ``active`` is `lasting` of the phase; where it is false nothing is stored or found.
    """

    def __init__(self, network: RegistrationNetwork, active: bool) -> None:
        self._network, self._active = network, active
        self._known: dict[Hashable, Known] = {}

    def of(self, pair: Hashable, batch: Batch) -> Known | None:
        """Features, evidence and patches without a graph; None where they must be computed each time."""
        if not self._active:
            return None
        if pair not in self._known:
            with torch.no_grad():
                known = Known(*self._network.backbone(batch.features, batch.pyramid))
                encoding = self._network.encode(batch, known)
            patches = (encoding.target.patches, encoding.source.patches)
            known = known._replace(evidence=encoding.evidence, patches=patches)
            self._known[pair] = _moved(known, lambda one: one.cpu().half(), lambda one: one.cpu().int())
        device = batch.features.device
        return _moved(
            self._known[pair], lambda one: one.to(device).float(), lambda one: one.to(device).long()
        )


Move = Callable[[Tensor], Tensor]


def _moved(known: Known, numbers: Move, rows: Move) -> Known:
    """Features and evidence moved by one function, the rows of patches by the other."""
    evidence = None if known.evidence is None else (numbers(known.evidence[0]), numbers(known.evidence[1]))
    patches = (
        None if known.patches is None else (_rows(known.patches[0], rows), _rows(known.patches[1], rows))
    )
    return Known(numbers(known.coarse), numbers(known.fine), evidence, patches)


def _rows(patches: Patches, move: Move) -> Patches:
    index = move(patches.index)
    return Patches(move(patches.owner), index, patches.mask.to(index.device))


def lasting(phase: Phase, augmentation: Augmentation, backbone: BackboneConfig) -> bool:
    """Whether each pair keeps its features throughout a phase.

    True for a frozen backbone, yaw-invariant kernel points, and an augmentation of yaw rotations and shifts only.
    """
    return phase.backbone_rate == 0 and backbone.kernel == "cylindrical" and augmentation.upright
