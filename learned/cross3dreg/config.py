# SPDX-License-Identifier: MIT
"""The configuration of a registration network: frozen dataclasses, one for each part."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build

DEFAULT_NEIGHBOR_LIMITS = (65, 80, 60, 60, 65)

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_MOST_KERNEL_POINTS = 256
_MOST_BLOCKS = 64
_MOST_NEIGHBORS = 10_000  # of a point


@dataclass(frozen=True, kw_only=True)
class BackboneConfig:
    """KPConv-FPN. Lengths in metres; stage s has voxel ``voxel * 2**s`` (docs/methods.md 2.3, 3.4)."""

    stages: int = 5
    voxel: float = 0.25
    max_range: float | None = None  # metres from the cloud's median; farther points are left out
    base_radius: float = 4.25  # search radius in voxels of the stage
    base_sigma: float = 2.0  # influence radius of a kernel point in voxels of the stage
    neighbor_limits: tuple[int, ...] = DEFAULT_NEIGHBOR_LIMITS
    init_dim: int = 64
    groups: int = 32
    fine_dim: int = 256
    fine_stage: int = 2  # counted from 1: the stage whose points are matched
    kernel_points: int = 15
    shared_kernel_points: bool = False  # one set of kernel points a stage: influences are computed once
    # Coordinates of a neighbour: three as published, or its distance from the vertical axis through the query and its
    # height, which are invariant to yaw.
    kernel: Literal["spatial", "cylindrical"] = "spatial"
    input_features: Literal["ones", "geometric"] = "ones"
    norm_scope: Literal["stacked", "per_cloud"] = "stacked"

    def __post_init__(self) -> None:
        limits.within(self, 1e-4, 1e4, "voxel", "base_radius", "base_sigma")
        limits.positive(self, "max_range")
        limits.within(self, 1, _WIDEST, "init_dim", "groups", "fine_dim")
        limits.within(self, 2, _MOST_KERNEL_POINTS, "kernel_points")
        limits.within(self, 1, _MOST_NEIGHBORS, "neighbor_limits")
        if len(self.neighbor_limits) != self.stages:
            raise ValueError(
                f"{len(self.neighbor_limits)} neighbor_limits for {self.stages} stages: give one a stage"
            )
        if not 1 <= self.fine_stage < self.stages:
            raise ValueError(f"fine_stage {self.fine_stage} must lie in 1..{self.stages - 1}")
        if (self.init_dim // 2) % self.groups:
            raise ValueError(f"init_dim {self.init_dim} halved must be divisible by groups {self.groups}")

    @property
    def fine_voxel(self) -> float:
        """Spacing (m) of the points that are matched."""
        return self.voxel * 2 ** (self.fine_stage - 1)

    @property
    def coarse_dim(self) -> int:
        """Width of the superpoint features."""
        return self.init_dim * 2**self.stages

    @property
    def input_dim(self) -> int:
        """Width of the input features."""
        return 1 if self.input_features == "ones" else 4

    def radius(self, stage: int) -> float:
        """Search radius (m) of a stage counted from 0."""
        return self.voxel * self.base_radius * 2**stage

    def sigma(self, stage: int) -> float:
        """Influence radius (m) of a kernel point at a stage counted from 0."""
        return self.voxel * self.base_sigma * 2**stage


@dataclass(frozen=True, kw_only=True)
class ImageConfig:
    """Residual U-Net on the camera image (docs/methods.md 4)."""

    height: int = 288
    width: int = 512
    dim: int = 128
    stem_dim: int = 32
    widths: tuple[int, ...] = (32, 64, 96, 128, 160)  # after strides 2, 4, 8, 16, 32
    groups: int = 8
    output_stride: Literal[1, 2, 4, 8] = 8
    dropout: float = 0.1  # share of training steps that see the null token instead of the image

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "height", "width", "dim", "stem_dim", "widths", "groups")
        limits.within(self, 0.0, 1.0, "dropout")


@dataclass(frozen=True, kw_only=True)
class OmpConfig:
    """Overlapping mask predictor (docs/methods.md 5)."""

    dim: int = 128
    heads: int = 4
    threshold: float = 0.5  # lambda
    formula: Literal["figure", "text"] = "figure"
    position: Literal["none", "sine"] = "none"
    pool: int = 4
    cross_cloud: bool = False
    evidence: bool = (
        False  # also give superpoints the similarity and uniqueness of their points' matches; ours
    )
    min_kept: int = 32
    min_kept_share: float = 0.15
    doubted: float = 0.0  # share of point matches left out, those least likely to overlap; ours, at inference

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "dim", "heads", "pool")
        limits.within(self, 0.0, 1.0, "threshold", "min_kept_share", "doubted")


@dataclass(frozen=True, kw_only=True)
class VgamConfig:
    """Visual-geometric attention before the GeoTransformer block (docs/methods.md 6.1 to 6.5)."""

    repeats: int = 3
    heads: int = 4
    point_position: Literal["none", "mlp", "radial"] = "radial"
    pool: int = 2
    gated: bool = False  # residual gates that start at 0: step 0 equals the network without an image
    # Each attention followed by LayerNorm and a two-layer network, as GeoTransformer's layers are; or the paper's bare
    # equations, which divide by the root of the fine features' width.
    formula: Literal["layers", "text"] = "layers"

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "heads", "pool")
        limits.within(self, 0, _MOST_BLOCKS, "repeats")
        if self.gated and self.formula == "text":
            raise ValueError("vgam: the paper's text has no gate; leave out gated=True or formula='text'")


@dataclass(frozen=True, kw_only=True)
class TransformerConfig:
    """GeoTransformer block (docs/methods.md 6.6)."""

    hidden_dim: int = 128
    output_dim: int = 256
    heads: int = 4
    blocks: tuple[str, ...] = ("self", "cross") * 3
    self_attention: Literal["geometric", "vanilla"] = "geometric"
    sigma_d: float = 4.0  # metres
    sigma_a: float = 15.0  # degrees
    angle_k: int = 3

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "hidden_dim", "output_dim", "heads", "angle_k")
        limits.within(self, 1e-6, 1e6, "sigma_d", "sigma_a")
        if len(self.blocks) > _MOST_BLOCKS:
            raise ValueError(f"{len(self.blocks)} transformer blocks are more than {_MOST_BLOCKS}")
        unknown = sorted(set(self.blocks) - {"self", "cross"})
        if unknown:
            raise ValueError(f"unknown transformer blocks {unknown}: use 'self' and 'cross'")
        if self.hidden_dim % self.heads or self.hidden_dim % 2:
            raise ValueError(f"hidden_dim {self.hidden_dim} must be even and divisible by heads {self.heads}")


@dataclass(frozen=True, kw_only=True)
class MatchingConfig:
    """Superpoint and point matching (docs/methods.md 7, 8).

    The last three are ours, at inference only, and off by default, as published: fine points vote for superpoint
    pairs, a match's weight is the geometric mean of its assignment and its uniqueness, and matches below
    ``uniqueness`` and those inconsistent with the others are left out.
    """

    superpoint_matches: int = 256
    dual_normalization: bool = True
    similarity: Literal["unit", "raw"] = (
        "unit"  # of features of length one, or as printed; training knows unit alone
    )
    temperature: float = 1.0
    max_superpoints: int = 800  # a cloud; more are masked out, so that memory stays bounded
    matching_radius: float = 0.5  # metres
    patch_points: int = 128
    sinkhorn_iterations: int = 100
    sinkhorn_form: Literal["log", "kernel"] = "kernel"  # at inference; training uses "kernel"
    score_scale: Literal["sqrt", "dim"] = "sqrt"
    topk: int = 2
    mutual: bool = True
    confidence: float = 0.05
    vote_temperature: float | None = None  # of the cosine of two fine features
    uniqueness: float = 0.0  # least product of both softmaxes over all points; needs vote_temperature
    consistency: float | None = None  # metres by which distances between matches may differ

    def __post_init__(self) -> None:
        limits.at_least(
            self, 1, "superpoint_matches", "max_superpoints", "patch_points", "sinkhorn_iterations", "topk"
        )
        limits.positive(self, "temperature", "matching_radius", "vote_temperature", "consistency")
        limits.within(self, 0.0, 1.0, "uniqueness")
        if self.uniqueness and self.vote_temperature is None:
            raise ValueError(f"uniqueness={self.uniqueness} needs a vote_temperature, such as 0.05")


@dataclass(frozen=True, kw_only=True)
class LgrConfig:
    """Local-to-global registration (docs/methods.md 9.2)."""

    acceptance_radius: float = 0.5  # metres
    min_group: int = 3
    steps: int = 5
    max_votes: int | None = None  # vote with at most this many best correspondences


@dataclass(frozen=True, kw_only=True)
class LossConfig:
    """Targets and losses (docs/methods.md 5.3, 7.4, 10)."""

    targets: int = 128
    positive_overlap: float = 0.1
    positive_margin: float = 0.1
    negative_margin: float = 1.4
    positive_optimal: float = 0.1
    negative_optimal: float = 1.4
    log_scale: float = 40.0
    positive_radius: float = 0.5  # metres
    mask_overlap: float = 0.0
    focal_alpha: float = 0.25
    focal_gamma: float = 2.0
    focal_alpha_mode: Literal["constant", "balanced"] = "constant"
    training_sinkhorn_iterations: int | None = None


@dataclass(frozen=True, kw_only=True)
class NetworkConfig:
    """A whole network. ``omp=None`` and ``vgam=None`` is GeoTransformer; with both it is Cross3DReg."""

    backbone: BackboneConfig = field(default_factory=BackboneConfig)
    transformer: TransformerConfig = field(default_factory=TransformerConfig)
    matching: MatchingConfig = field(default_factory=MatchingConfig)
    lgr: LgrConfig = field(default_factory=LgrConfig)
    loss: LossConfig = field(default_factory=LossConfig)
    image: ImageConfig | None = None
    omp: OmpConfig | None = None
    vgam: VgamConfig | None = None

    def __post_init__(self) -> None:
        if (self.omp or self.vgam) and self.image is None:
            raise ValueError("omp and vgam use image tokens: give an ImageConfig")

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> NetworkConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(NetworkConfig, values, "config")
