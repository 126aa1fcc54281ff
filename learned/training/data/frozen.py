# SPDX-License-Identifier: MIT
"""Features of a backbone that a phase does not train, computed once a pair where no augmentation changes them."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import BackboneConfig
from hybridreg.learned.cross3dreg.encodings import Known
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.training.data.augmentation import Augmentation
from hybridreg.learned.training.recipe import Phase


class FrozenFeatures:
    """The backbone's output by pair, in half precision: about 1 MB for 5,000 points.

    ``active`` is `lasting` of the phase; where it is false nothing is stored or found.
    """

    def __init__(self, network: RegistrationNetwork, active: bool) -> None:
        self._network, self._active = network, active
        self._known: dict[Hashable, Known] = {}

    def of(self, pair: Hashable, batch: Batch) -> Known | None:
        """Features and evidence, float32 without a graph; None where they must be computed each time."""
        if not self._active:
            return None
        if pair not in self._known:
            with torch.no_grad():
                known = Known(*self._network.backbone(batch.features, batch.pyramid))
                evidence = self._network.encode(batch, known).evidence
            self._known[pair] = _moved(known._replace(evidence=evidence), lambda one: one.cpu().half())
        device = batch.features.device
        return _moved(self._known[pair], lambda one: one.to(device).float())


def _moved(known: Known, move: Callable[[Tensor], Tensor]) -> Known:
    target, source = known.evidence or (None, None)
    evidence = None if target is None or source is None else (move(target), move(source))
    return Known(move(known.coarse), move(known.fine), evidence)


def lasting(phase: Phase, augmentation: Augmentation, backbone: BackboneConfig) -> bool:
    """Whether each pair keeps its features throughout a phase.

    True for a frozen backbone, yaw-invariant kernel points, and an augmentation of yaw rotations and shifts only.
    """
    return phase.backbone_rate == 0 and backbone.kernel == "cylindrical" and augmentation.upright
