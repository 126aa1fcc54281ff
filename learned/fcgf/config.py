# SPDX-License-Identifier: MIT
"""The configuration of an FCGF network, and the published ones by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_WIDEST_KERNEL = 9  # voxels
_MOST_LEVELS = 8


@dataclass(frozen=True, kw_only=True)
class FcgfLossConfig:
    """Hardest-contrastive loss (Choy et al. 2019, equation 4; lib/trainer.py 404-498).

    ``form`` says where the hinges are squared. "released" is what the published weights were trained with: the hinge
    of the *squared* distance for positives, not squared again, and the squared hinge of sqrt(squared distance +
    ``distance_eps``) for negatives. "paper" squares the hinge of the plain distance in both.
    """

    positive_margin: float = 0.1
    negative_margin: float = 1.4
    negative_weight: float = 1.0
    positives: int = 1024  # a pair, drawn from the whole batch
    candidates: int = 256  # for the hardest negative: a pair and side, drawn from the whole batch
    search_voxels: float = 1.5  # voxels nearer than this after alignment are positives
    distance_eps: float = 1e-7
    form: Literal["released", "paper"] = "released"

    def __post_init__(self) -> None:
        limits.within(self, 0.0, 4.0, "positive_margin", "negative_margin")
        limits.at_least(self, 1, "positives", "candidates")
        limits.positive(self, "search_voxels", "distance_eps")


@dataclass(frozen=True, kw_only=True)
class FcgfConfig:
    """ResUNetBN2C and its variants (model/resunet.py): a residual U-Net of sparse convolutions. The defaults are
    KITTI's.

    ``channels`` are the encoder's from fine to coarse. ``tr_channels`` are the decoder's in the same order: the first
    of the 1x1x1 convolution before the last, the last of the transposed convolution from the coarsest level.
    """

    in_channels: int = 1
    out_channels: int = 32
    channels: tuple[int, ...] = (32, 64, 128, 256)
    tr_channels: tuple[int, ...] = (64, 64, 64, 128)
    first_kernel: int = 5
    kernel: int = 3
    tr_kernel: int = 3
    final_kernel: int = 1
    stride: int = 2
    normalize: bool = True  # features of length one
    normalize_eps: float = 0.0  # added to the length; 0 as published, where a feature of zeros becomes NaN
    bn_eps: float = 1e-5
    bn_momentum: float = 0.05  # weight of the new value
    voxel: float = 0.3  # metres
    loss: FcgfLossConfig = field(default_factory=FcgfLossConfig)

    def __post_init__(self) -> None:
        limits.within(self, 1, _WIDEST, "in_channels", "out_channels", "channels", "tr_channels")
        limits.within(self, 1, _WIDEST_KERNEL, "first_kernel", "kernel", "tr_kernel", "final_kernel")
        limits.within(self, 2, 8, "stride")
        limits.within(self, 1e-4, 1e4, "voxel")
        limits.within(self, 0.0, 1.0, "normalize_eps", "bn_eps", "bn_momentum")
        if not 2 <= len(self.channels) <= _MOST_LEVELS:
            raise ValueError(f"{len(self.channels)} channels: give 2 to {_MOST_LEVELS}, one a level")
        if len(self.channels) != len(self.tr_channels):
            raise ValueError(
                f"{len(self.tr_channels)} tr_channels for {len(self.channels)} channels: give the same number of both"
            )

    @property
    def strides(self) -> tuple[int, ...]:
        """Of the levels, in voxels."""
        return tuple(self.stride**level for level in range(len(self.channels)))

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> FcgfConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(FcgfConfig, values, "config")


SIZES = {
    "fcgf-kitti": FcgfConfig(),
    "fcgf-3dmatch": FcgfConfig(first_kernel=7, voxel=0.025),
    "small": FcgfConfig(channels=(16, 32, 64, 128), tr_channels=(32, 32, 32, 64), normalize_eps=1e-8),
    "nano": FcgfConfig(
        out_channels=16,
        channels=(8, 16, 24),
        tr_channels=(16, 16, 16),
        first_kernel=3,
        voxel=0.5,
        normalize_eps=1e-8,
    ),
}


def named_config(name: str) -> FcgfConfig:
    """``fcgf-kitti`` and ``fcgf-3dmatch`` (2.5 cm) as published, 8.8 M parameters; ``small``, 2.2 M; ``nano``.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of FCGF; known are {', '.join(SIZES)}")
    return SIZES[name]
