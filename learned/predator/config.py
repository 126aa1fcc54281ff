# SPDX-License-Identifier: MIT
"""The configuration of a Predator network, and the published ones by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hybridreg.config import limits
from hybridreg.config.plain_values import build
from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig, architecture

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_MOST_BLOCKS = 64


@dataclass(frozen=True, kw_only=True)
class GraphConfig:
    """Between encoder and decoder: blocks over each cloud's own graph, and blocks of attention to the other cloud."""

    dim: int = 256
    neighbors: int = 10
    heads: int = 4
    blocks: tuple[str, ...] = ("self", "cross", "self")

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "dim", "neighbors", "heads")
        if len(self.blocks) > _MOST_BLOCKS:
            raise ValueError(f"{len(self.blocks)} graph blocks are more than {_MOST_BLOCKS}")
        unknown = sorted(set(self.blocks) - {"self", "cross"})
        if unknown:
            raise ValueError(f"unknown graph blocks {unknown}: use 'self' and 'cross'")
        if self.dim % self.heads:
            raise ValueError(f"dim {self.dim} must be divisible by heads {self.heads}")


@dataclass(frozen=True, kw_only=True)
class PredatorLossConfig:
    """Losses (lib/loss.py). Lengths in metres; the defaults are KITTI's at a voxel of 0.3 m.

    ``log_scale`` is 16 in every published training: the 48, 40 and 24 of the configuration files are never read.
    """

    positive_margin: float = 0.1
    negative_margin: float = 1.4
    positive_optimal: float = 0.1
    negative_optimal: float = 1.4
    log_scale: float = 16.0
    positive_radius: float = 0.21
    positive_slack: float = 0.001  # by which pairs must be nearer than positive_radius to be drawn
    safe_radius: float = 0.75  # pairs farther apart are negatives
    overlap_radius: float = 0.45
    matchability_radius: float = 0.3
    max_points: int = 512  # pairs drawn for the circle loss
    circle_weight: float = 1.0
    overlap_weight: float = 1.0
    saliency_weight: float | None = None  # None: switched, see `hybridreg.learned.predator.losses`

    def __post_init__(self) -> None:
        limits.within(
            self, 0.0, 4.0, "positive_margin", "negative_margin", "positive_optimal", "negative_optimal"
        )
        limits.positive(
            self, "log_scale", "positive_radius", "safe_radius", "overlap_radius", "matchability_radius"
        )
        limits.within(self, 0.0, 1e6, "positive_slack", "circle_weight", "overlap_weight")
        if self.saliency_weight is not None:
            limits.within(self, 0.0, 1e6, "saliency_weight")
        limits.at_least(self, 1, "max_points")


@dataclass(frozen=True, kw_only=True)
class PredatorConfig:
    """A whole network; the defaults are KITTI's."""

    backbone: KpfcnnConfig = field(default_factory=KpfcnnConfig)
    graph: GraphConfig = field(default_factory=GraphConfig)
    final_dim: int = 32  # of the features
    cross_score: bool = True  # the decoder also sees the other cloud's overlap scores, weighted by similarity
    condition_feature: bool = True  # the decoder sees the features after the graph blocks, not those before
    temperature_floor: float = 0.03
    loss: PredatorLossConfig = field(default_factory=PredatorLossConfig)

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "final_dim")
        limits.within(self, 1e-6, 1e6, "temperature_floor")
        if self.decoder_dim >> (self.backbone.stages - 1) < 1:
            raise ValueError(
                f"a graph dim of {self.graph.dim} is too narrow for {self.backbone.stages} stages"
            )

    @property
    def decoder_dim(self) -> int:
        """Width of the decoder's input: scores and features."""
        return self.graph.dim + 1 + self.cross_score

    @property
    def image(self) -> None:
        """It uses no image."""

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> PredatorConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(PredatorConfig, values, "config")


def _indoor() -> PredatorConfig:
    backbone = KpfcnnConfig(voxel=0.025, base_radius=2.5, neighbor_limits=(38, 36, 36, 38), init_dim=128)
    loss = PredatorLossConfig(
        positive_radius=0.0375,
        safe_radius=0.1,
        overlap_radius=0.0375,
        matchability_radius=0.05,
        max_points=256,
    )
    return PredatorConfig(backbone=backbone, loss=loss)


def _scaled(voxel: float) -> PredatorLossConfig:
    # The published radii in voxels.
    base, scale = PredatorLossConfig(), voxel / 0.3
    return dataclasses.replace(
        base,
        positive_radius=base.positive_radius * scale,
        safe_radius=base.safe_radius * scale,
        overlap_radius=base.overlap_radius * scale,
        matchability_radius=base.matchability_radius * scale,
    )


def _small() -> PredatorConfig:
    backbone = KpfcnnConfig(voxel=0.25, init_dim=64, neighbor_limits=(40,) * 4)
    return PredatorConfig(backbone=backbone, graph=GraphConfig(dim=128), loss=_scaled(0.25))


def _nano() -> PredatorConfig:
    backbone = KpfcnnConfig(blocks=architecture((1, 1, 1)), voxel=0.5, init_dim=16, neighbor_limits=(24,) * 3)
    return PredatorConfig(backbone=backbone, graph=GraphConfig(dim=32), final_dim=16, loss=_scaled(0.5))


SIZES = {"predator-kitti": PredatorConfig, "predator-3dmatch": _indoor, "small": _small, "nano": _nano}


def named_config(name: str) -> PredatorConfig:
    """``predator-kitti`` (22.8 M parameters) and ``predator-3dmatch`` (7.4 M) as published; ``small``; ``nano``.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of Predator; known are {', '.join(SIZES)}")
    return SIZES[name]()
