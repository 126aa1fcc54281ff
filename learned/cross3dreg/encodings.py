# SPDX-License-Identifier: MIT
"""Intermediate results of the network for a pair."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from torch import Tensor

from hybridreg.learned.cross3dreg.image_encoder import ImageFeatures
from hybridreg.learned.cross3dreg.overlap_predictor import OverlapLogits
from hybridreg.learned.cross3dreg.superpoint_mask import Kept
from hybridreg.learned.matching.point_matching import PointMatches
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches
from hybridreg.learned.pyramid.patches import Patches


@dataclass(frozen=True, kw_only=True)
class CloudEncoding:
    """One cloud after the encoders."""

    nodes: Tensor  # (n, 3) superpoints, metres
    node_features: Tensor  # (n, C)
    points: Tensor  # (N, 3) fine points, metres
    point_features: Tensor  # (N, d)
    patches: Patches


@dataclass(frozen=True, kw_only=True)
class Encoding:
    """A pair after the encoders, shared by all later parts."""

    target: CloudEncoding
    source: CloudEncoding
    image: ImageFeatures | None
    evidence: tuple[Tensor, Tensor] | None = None  # of target and source, where OMP uses it


class Known(NamedTuple):
    """Results that are invariant to yaw and shifts: output of the backbone, evidence for the overlap, and patches."""

    coarse: Tensor  # (n, C), both clouds
    fine: Tensor  # (N, d)
    evidence: tuple[Tensor, Tensor] | None = None
    patches: tuple[Patches, Patches] | None = None  # of target and source


@dataclass(frozen=True, kw_only=True)
class Output:
    """What a forward pass gives."""

    encoding: Encoding
    overlap: OverlapLogits | None
    kept: tuple[Kept, Kept]  # target, source
    node_features: tuple[Tensor, Tensor]  # unit length, of the kept superpoints
    superpoints: SuperpointMatches  # indices into all superpoints
    matches: PointMatches
