# SPDX-License-Identifier: MIT
"""RoITr's configuration and its sizes by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build
from hybridreg.learned.cross3dreg.config import LossConfig, MatchingConfig, TransformerConfig

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 4096  # channels
_MOST_NEIGHBORS = 512  # of a point
_MOST_BLOCKS = 64


def _transformer() -> TransformerConfig:
    return TransformerConfig(hidden_dim=256, output_dim=256, sigma_d=0.2)


def _matching() -> MatchingConfig:
    return MatchingConfig(matching_radius=0.05, patch_points=64, topk=3)


def _loss() -> LossConfig:
    return LossConfig(log_scale=24.0, positive_radius=0.05)


@dataclass(frozen=True, kw_only=True)
class RoitrConfig:
    """The whole network; the defaults are the published 3DMatch one (haoyu94/RoITr, model/RIGA_v2.py)."""

    voxel: float = 0.025  # metres: spacing of the points that the network was trained with
    widths: tuple[int, ...] = (64, 128, 256, 256)
    hidden: tuple[int, ...] | None = None  # inner widths of the local attention; None: as the widths
    blocks: tuple[int, ...] = (2, 3, 3, 3)  # per level, the abstraction layer counted
    strides: tuple[int, ...] = (1, 4, 4, 4)
    neighbors: tuple[int, ...] = (8, 16, 16, 16)  # without the point itself
    heads: int = 4
    decoder_heads: int = 4
    interpolation: int = 3  # coarser points that a finer one is interpolated from
    normal_neighbors: int = 33  # the point itself counted
    # Orientation of normals: towards the origin of each cloud's frame, as released and as the published weights
    # expect, wherever the sensor stood; or towards the sensor, and upwards where its viewpoint is not known.
    facing: Literal["origin", "sensor"] = "origin"
    max_points: int = 30_000  # of a cloud; more are sampled down to this number
    fine_dim: int = 256  # width of the features that points are matched by
    transformer: TransformerConfig = field(default_factory=_transformer)
    matching: MatchingConfig = field(default_factory=_matching)
    # "dual": the best pairs after dual normalisation (3DMatch); "adaptive": all pairs of superpoints whose features
    # are nearer than max_feature_distance, and at least matching.superpoint_matches (4DMatch).
    coarse: Literal["dual", "adaptive"] = "dual"
    max_feature_distance: float = 0.75
    loss: LossConfig = field(default_factory=_loss)
    coarse_weight: float = 1.0
    fine_weight: float = 1.0
    target_overlap: float = 0.1  # training pairs overlap by more than this
    occlusion_radius: float = 0.0375  # metres

    def __post_init__(self) -> None:
        limits.within(self, 1e-4, 1e4, "voxel")
        limits.within(self, 1, _WIDEST, "widths", "heads", "decoder_heads", "fine_dim")
        limits.within(self, 1, _MOST_BLOCKS, "blocks", "strides")
        limits.within(self, 1, _MOST_NEIGHBORS, "neighbors", "interpolation")
        limits.within(self, 3, _MOST_NEIGHBORS, "normal_neighbors")
        limits.at_least(self, 64, "max_points")
        limits.positive(self, "max_feature_distance", "occlusion_radius")
        levels = {len(self.widths), len(self.inner), len(self.blocks), len(self.strides), len(self.neighbors)}
        if len(levels) > 1 or len(self.widths) < 2:
            raise ValueError(
                "widths, hidden, blocks, strides and neighbors need one value for each of 2+ levels"
            )
        if self.strides[0] != 1:
            raise ValueError(f"strides[0]={self.strides[0]} must be 1: the points of level 1 are matched")
        if any(dim % self.heads or dim % self.decoder_heads for dim in self.inner):
            raise ValueError(
                f"inner widths {self.inner} must be divisible by heads {self.heads} and {self.decoder_heads}"
            )
        if self.transformer.blocks[:1] != ("self",):
            raise ValueError(
                f"transformer blocks {self.transformer.blocks} must begin with 'self': a cross layer needs the "
                "position states that a self layer makes"
            )

    @property
    def inner(self) -> tuple[int, ...]:
        """Inner widths of the local attention, one a level."""
        return self.widths if self.hidden is None else self.hidden

    @property
    def levels(self) -> int:
        """Number of levels, the finest counted."""
        return len(self.widths)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> RoitrConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(RoitrConfig, values, "config")


def _4dmatch() -> RoitrConfig:
    # Twice as wide everywhere: the benchmark's name in the published configuration chooses the architecture.
    return RoitrConfig(
        widths=(128, 256, 512, 512),
        fine_dim=512,
        transformer=TransformerConfig(hidden_dim=512, output_dim=512, sigma_d=0.2),
        matching=MatchingConfig(superpoint_matches=128, matching_radius=0.05, patch_points=64, topk=2),
        coarse="adaptive",
    )


def _outdoor(voxel: float, dim: int, **fields: Any) -> RoitrConfig:
    # No published configuration is for outdoor scenes: lengths as GeoTransformer's KITTI network has them, scaled.
    plan: dict[str, Any] = {
        "transformer": TransformerConfig(hidden_dim=dim, output_dim=dim, sigma_d=16.0 * voxel),
        "matching": MatchingConfig(
            matching_radius=2.0 * voxel, patch_points=64, topk=3, sinkhorn_iterations=50
        ),
        "loss": LossConfig(log_scale=24.0, positive_radius=2.0 * voxel, targets=64),
        "occlusion_radius": 1.5 * voxel,
        "facing": "sensor",
    }
    return RoitrConfig(voxel=voxel, fine_dim=dim, **{**plan, **fields})


def _small() -> RoitrConfig:
    return _outdoor(0.25, 128, widths=(32, 64, 128, 128))


def _nano() -> RoitrConfig:
    return _outdoor(
        0.5,
        32,
        widths=(16, 32, 32),
        blocks=(2, 2, 2),
        strides=(1, 4, 4),
        neighbors=(8, 8, 8),
        heads=2,
        decoder_heads=2,
        transformer=TransformerConfig(
            hidden_dim=32, output_dim=32, heads=2, blocks=("self", "cross"), sigma_d=8.0
        ),
        matching=MatchingConfig(
            superpoint_matches=64, matching_radius=1.0, patch_points=32, sinkhorn_iterations=20, topk=3
        ),
        loss=LossConfig(log_scale=24.0, positive_radius=1.0, targets=32),
    )


SIZES: dict[str, Callable[[], RoitrConfig]] = {
    "nano": _nano,
    "small": _small,
    "roitr-3dmatch": RoitrConfig,
    "roitr-4dmatch": _4dmatch,
}


def named_config(name: str) -> RoitrConfig:
    """The configuration of a size.

    Parameters
    ----------
    name
        ``nano``, ``small`` (outdoor, ours), ``roitr-3dmatch`` or ``roitr-4dmatch`` (as published: 10.1 M and 40.3 M
        parameters).

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of RoITr; known are {', '.join(SIZES)}")
    return SIZES[name]()
