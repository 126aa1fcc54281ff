# SPDX-License-Identifier: MIT
"""The configuration of an OMNet, and the published one by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.config.plain_values import build

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_MOST_LAYERS = 16
_MOST_ITERATIONS = 32
_MOST_POINTS = 100_000


@dataclass(frozen=True, kw_only=True)
class OmnetLossConfig:
    """Mask and pose losses (loss/loss.py). The defaults are those of the published PyTorch weights.

    Three choices differ between the published forms, or from what one would expect:

    ``mask_form``: "torch" divides the weighted cross-entropy by the sum of the weights of the whole batch; "megengine"
    (the first release) by each cloud's own, and takes the mean over the batch.
    ``labels``: "masked" as released: points that the iteration's input mask left out count as not overlapping, and so
    do points whose only correspondences it left out, so that labels depend on the network's earlier masks. "true" is
    the correct one: the overlap of the whole clouds in every iteration.
    ``signed``: true as released: q and -q, the same rotation, count as different, and a rotation predicted with a
    negative w costs up to 2. False takes the nearer of the two.
    """

    overlap_distance: float = 0.1  # in the units of the normalised clouds
    class_weights: tuple[float, ...] = (0.7, 0.3)  # of not overlapping and overlapping
    quaternion_weight: float = 1.0
    translation_weight: float = 4.0
    mask_form: Literal["torch", "megengine"] = "torch"
    labels: Literal["masked", "true"] = "masked"
    signed: bool = True

    def __post_init__(self) -> None:
        limits.positive(self, "overlap_distance", "class_weights")
        limits.within(self, 0.0, 1e6, "quaternion_weight", "translation_weight")
        if len(self.class_weights) != 2:
            raise ValueError(
                f"class_weights={self.class_weights}: give two, of not overlapping and overlapping"
            )


@dataclass(frozen=True, kw_only=True)
class OmnetConfig:
    """OMNet (model/net.py, model/module.py). Widths are those of layers; the last of the encoder is max-pooled.

    The class layer (2) and the pose layer (7) follow ``decoder`` and ``regression``.
    """

    encoder: tuple[int, ...] = (64, 64, 64, 128, 1024)
    local_layer: int = 2  # counted from 1: the layer whose features stand for single points
    fusion: tuple[int, ...] = (1024, 1024, 512)
    decoder: tuple[int, ...] = (512, 256, 256)
    regression: tuple[int, ...] = (2048, 1024, 512, 256)
    iterations: int = 4  # each with its own weights
    mask_delay: int = 2  # iterations that see every point; later ones see the mask of the iteration before
    points: int = 717  # of each cloud that the stage uses
    normalize_eps: float = 1e-12  # least length of a quaternion before it is divided by it
    bn_eps: float = 1e-5
    bn_momentum: float = 0.1
    loss: OmnetLossConfig = field(default_factory=OmnetLossConfig)

    def __post_init__(self) -> None:
        for name in ("encoder", "fusion", "decoder", "regression"):
            limits.within(self, 1, _WIDEST, name)
            if not 1 <= len(getattr(self, name)) <= _MOST_LAYERS:
                raise ValueError(f"{len(getattr(self, name))} layers of {name}: give 1 to {_MOST_LAYERS}")
        limits.within(self, 1, _MOST_ITERATIONS, "iterations")
        limits.within(self, 0, _MOST_ITERATIONS, "mask_delay")
        limits.within(self, 1, _MOST_POINTS, "points")
        limits.within(self, 0.0, 1.0, "normalize_eps", "bn_eps", "bn_momentum")
        if not 1 <= self.local_layer <= len(self.encoder):
            raise ValueError(f"local_layer={self.local_layer} must lie in 1 to {len(self.encoder)}")
        if self.mask_delay < 1:
            raise ValueError("mask_delay=0: the first iteration has no mask before it; give 1 or more")

    @property
    def local_dim(self) -> int:
        """Width of a point's own features."""
        return self.encoder[self.local_layer - 1]

    @property
    def regression_input(self) -> int:
        """Width of the pooled vector: fused and decoded features of both clouds."""
        return 2 * (self.fusion[-1] + sum(self.decoder))

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `from_dict` and JSON take back."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> OmnetConfig:
        """Build from plain values; an unknown key raises ``ValueError`` that names it."""
        return build(OmnetConfig, values, "config")


SIZES = {
    "omnet-modelnet": OmnetConfig(),
    "small": OmnetConfig(
        encoder=(32, 32, 32, 64, 256),
        fusion=(256, 256, 128),
        decoder=(128, 64, 64),
        regression=(256, 128, 64, 32),
        points=1024,
    ),
    "nano": OmnetConfig(
        encoder=(16, 16, 24, 64),
        fusion=(64, 48),
        decoder=(32, 32),
        regression=(64, 32),
        iterations=3,
        points=256,
    ),
}


def named_config(name: str) -> OmnetConfig:
    """``omnet-modelnet`` as published, 54 M parameters; ``small``, 2.1 M; ``nano``, for tests.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in SIZES:
        raise KeyError(f"unknown size {name!r} of OMNet; known are {', '.join(SIZES)}")
    return SIZES[name]
