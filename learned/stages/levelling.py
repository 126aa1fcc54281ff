# SPDX-License-Identifier: MIT
"""Levelling of tilted clouds for a network that takes z as the vertical, and the transformation back."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional as F

from hybridreg.geometry import ground
from hybridreg.learned.cross3dreg.encodings import CloudEncoding, Encoding
from hybridreg.learned.cross3dreg.superpoint_evidence import partners
from hybridreg.scene import Scene

Array = NDArray[np.float64]

# Training clouds are tilted by up to 5 degrees, and a network tolerates a few more.
_TILTED_DEG = 10.0


@dataclass(frozen=True)
class Turns:
    """Rotations (3, 3) of the two clouds, points to the levelled frame."""

    target: Array
    source: Array

    @classmethod
    def none(cls) -> Turns:
        """Both clouds as they are."""
        return cls(np.eye(3), np.eye(3))

    @classmethod
    def upright(cls, scene: Scene) -> Turns | None:
        """The rotations that level the clouds by their ground; None where neither is tilted."""
        turns = [_upright(scene.level(side).ground) for side in ("target", "source")]
        if all(turn is None for turn in turns):
            return None
        return cls(*(np.eye(3) if turn is None else turn for turn in turns))

    def back(self, encoding: Encoding) -> Encoding:
        """The encoding of rotated clouds with its points rotated back."""
        return replace(
            encoding,
            target=_turned_back(encoding.target, self.target),
            source=_turned_back(encoding.source, self.source),
        )


def likeness(encoding: Encoding) -> float:
    """Mean cosine of each fine point's feature with the most similar one of the other cloud.

    A ground may be a wall: of the original and the levelled clouds those with more similar features are right.
    """
    target, source = (
        F.normalize(cloud.point_features, dim=1) for cloud in (encoding.target, encoding.source)
    )
    return sum(float(one.best.mean()) for one in partners(target, source, temperature=1.0)) / 2


def _upright(found: ground.Ground | None) -> Array | None:
    if found is None or found.up[2] > np.cos(np.radians(_TILTED_DEG)):
        return None
    return found.levelling


def _turned_back(cloud: CloudEncoding, turn: Array) -> CloudEncoding:
    R = torch.from_numpy(turn.astype(np.float32)).to(cloud.nodes.device)
    return replace(cloud, nodes=cloud.nodes @ R, points=cloud.points @ R)
