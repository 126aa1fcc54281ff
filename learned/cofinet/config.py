# SPDX-License-Identifier: MIT
"""The configuration of a CoFiNet network, and the published one by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build
from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig, architecture

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_MOST_PAIRS = 1_000_000  # of superpoints


@dataclass(frozen=True, kw_only=True)
class SelectionConfig:
    """Which superpoint pairs are kept for point matching, at inference.

    Pairs above a probability; while there are too few the threshold is lowered step by step. In the released code it
    falls below 0, where every pair is kept, and loops forever where there are fewer pairs; here it stops there.
    """

    threshold: float = 0.2
    step: float = 0.01
    min_pairs: int = 200
    max_pairs: int | None = 2000  # the most probable ones, so that memory stays bounded; ours

    def __post_init__(self) -> None:
        limits.within(self, 0.0, 1.0, "threshold")
        limits.within(self, 1e-4, 1.0, "step")
        limits.within(self, 1, _MOST_PAIRS, "min_pairs")
        if self.max_pairs is not None:
            limits.within(self, 1, _MOST_PAIRS, "max_pairs")


@dataclass(frozen=True, kw_only=True)
class CofinetLossConfig:
    """Targets and losses. Lengths in metres; the defaults are KITTI's at a voxel of 0.3 m."""

    pairs: int = 128  # true pairs of superpoints drawn a step, with replacement
    patch_points: int = 64  # of a patch in training
    min_overlap: float = 0.2  # superpoint pairs with at most this weight are not pairs; 0 indoors
    overlap_radius: float = 0.45
    fine_radius: float = 0.5
    coarse_weight: float = 1.0
    fine_weight: float = 1.0

    def __post_init__(self) -> None:
        limits.within(self, 1, _MOST_PAIRS, "pairs", "patch_points")
        limits.within(self, 0.0, 1.0, "min_overlap")
        limits.positive(self, "overlap_radius", "fine_radius")
        limits.within(self, 0.0, 1e6, "coarse_weight", "fine_weight")


@dataclass(frozen=True, kw_only=True)
class CofinetConfig:
    """A whole network; the defaults are KITTI's as published, but for ``padding`` and ``patch_rule``.

    ``padding`` says what the empty slots of a patch contain. "point0" is what the released weights were
    trained with and are loaded with: the features of the cloud's point 0, which take part in the attention, in its
    normalisation, and in deciding which training point has no correspondence. "masked" is the correct one: they take no
    part.

    ``patch_rule`` says which points of a superpoint make up a patch that overflows: "nearest" to it, or the "first" by
    index. The released code overwrites slots at random, seeded by the clock: no two runs are equal.
    """

    backbone: KpfcnnConfig = field(
        default_factory=lambda: KpfcnnConfig(blocks=architecture((1, 1, 1, 1)), init_dim=128)
    )
    dim: int = 256  # width of the superpoint features; that of the points is halved with each stage
    heads: int = 4
    fine_heads: int = 4
    sinkhorn_iterations: int = 100
    sinkhorn_form: Literal["log", "kernel"] = (
        "kernel"  # of superpoints at inference; training uses the log form
    )
    patch_points: int = 32  # at inference
    patch_rule: Literal["nearest", "first"] = "nearest"
    padding: Literal["masked", "point0"] = "masked"
    selection: SelectionConfig = field(default_factory=SelectionConfig)
    loss: CofinetLossConfig = field(default_factory=CofinetLossConfig)

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "dim", "heads", "fine_heads", "patch_points", "sinkhorn_iterations")
        if self.dim % self.heads:
            raise ValueError(f"dim {self.dim} must be divisible by heads {self.heads}")
        if self.fine_dim < 1 or self.fine_dim % self.fine_heads:
            raise ValueError(
                f"fine dim {self.fine_dim}, which is dim {self.dim} halved {self.backbone.stages - 1} times, must be "
                f"divisible by fine_heads {self.fine_heads}"
            )

    @property
    def fine_dim(self) -> int:
        """Width of the point features."""
        return self.dim >> (self.backbone.stages - 1)

    @property
    def image(self) -> None:
        """It uses no image."""

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> CofinetConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(CofinetConfig, values, "config")


def _loss(voxel: float, **changes: Any) -> CofinetLossConfig:
    # The published radii in voxels.
    base, scale = CofinetLossConfig(), voxel / 0.3
    return dataclasses.replace(
        base, overlap_radius=base.overlap_radius * scale, fine_radius=base.fine_radius * scale, **changes
    )


def _kitti() -> CofinetConfig:
    return CofinetConfig(padding="point0")


def _small() -> CofinetConfig:
    blocks = architecture((1, 1, 1, 1))
    backbone = KpfcnnConfig(blocks=blocks, voxel=0.25, init_dim=64, neighbor_limits=(40,) * 4)
    return CofinetConfig(backbone=backbone, dim=128, sinkhorn_iterations=50, loss=_loss(0.25, pairs=64))


def _nano() -> CofinetConfig:
    backbone = KpfcnnConfig(blocks=architecture((1, 1, 1)), voxel=0.5, init_dim=16, neighbor_limits=(24,) * 3)
    return CofinetConfig(
        backbone=backbone,
        dim=64,
        sinkhorn_iterations=20,
        selection=SelectionConfig(min_pairs=60, max_pairs=400),
        loss=_loss(0.5, pairs=32, patch_points=32),
    )


SIZES = {"cofinet-kitti": _kitti, "small": _small, "nano": _nano}


def named_config(name: str) -> CofinetConfig:
    """``cofinet-kitti`` as published, 5.5 M parameters; ``small``; ``nano``.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of CoFiNet; known are {', '.join(SIZES)}")
    return SIZES[name]()
