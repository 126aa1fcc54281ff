# SPDX-License-Identifier: MIT
"""KPFCNN, the encoder and decoder that Predator and CoFiNet share, configured by a list of blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from hybridreg.config import limits
from hybridreg.learned.layers.kpconv_blocks import BlockPlan

# A configuration may come with untrusted weights: absurd sizes are refused before memory is allocated. By hand.
_WIDEST = 8192  # channels
_MOST_KERNEL_POINTS = 256
_MOST_BLOCKS = 64
_MOST_NEIGHBORS = 10_000  # of a point
_ENCODING = ("simple", "simple_strided", "resnetb", "resnetb_strided")
_DECODING = ("nearest_upsample", "unary", "last_unary")


def architecture(residual: tuple[int, ...]) -> tuple[str, ...]:
    """The list of blocks with these numbers of residual blocks a stage, without strided ones, and the matching
    decoder."""
    blocks = ["simple", *["resnetb"] * residual[0]]
    for count in residual[1:]:
        blocks += ["resnetb_strided", *["resnetb"] * count]
    up = ["nearest_upsample", "unary"] * (len(residual) - 1)
    return (*blocks, *up[:-1], "last_unary")


class EncoderBlock(NamedTuple):
    """One block of the encoder: simple (a convolution) or residual, with its plan, and the stage it computes at."""

    simple: bool
    plan: BlockPlan
    stage: int  # from 0


@dataclass(frozen=True, kw_only=True)
class KpfcnnConfig:
    """Encoder and decoder. Lengths in metres; stage s has voxel ``voxel * 2**s``.

    ``blocks`` is the "architecture" of the originals' configuration files: ``simple`` and ``resnetb`` and their
    ``_strided`` forms, then alternating ``nearest_upsample`` and ``unary``, finally ``last_unary``.
    """

    blocks: tuple[str, ...] = architecture((1, 2, 2, 2))
    voxel: float = 0.3
    max_range: float | None = None  # metres from the cloud's median; farther points are left out
    base_radius: float = 4.25  # search radius in voxels of the stage
    base_sigma: float = 2.0  # influence radius of a kernel point in voxels of the stage
    neighbor_limits: tuple[int, ...] = (59, 59, 66, 63)
    init_dim: int = 256  # of the first residual block; doubles with each stage
    kernel_points: int = 15
    input_features: Literal["ones"] = "ones"

    def __post_init__(self) -> None:
        limits.within(self, 1e-4, 1e4, "voxel", "base_radius", "base_sigma")
        limits.positive(self, "max_range")
        limits.within(self, 4, _WIDEST, "init_dim")
        limits.within(self, 2, _MOST_KERNEL_POINTS, "kernel_points")
        limits.within(self, 1, _MOST_NEIGHBORS, "neighbor_limits")
        if len(self.blocks) > _MOST_BLOCKS:
            raise ValueError(f"{len(self.blocks)} blocks are more than {_MOST_BLOCKS}")
        _check(self.encoding, _ENCODING, "encoder")
        _check(self.decoding, _DECODING, "decoder")
        self._check_decoder()
        if len(self.neighbor_limits) != self.stages:
            raise ValueError(
                f"{len(self.neighbor_limits)} neighbor_limits for {self.stages} stages: give one a stage"
            )

    def _check_decoder(self) -> None:
        decoding, ups = self.decoding, self.decoding.count("nearest_upsample")
        if ups != self.stages - 1:
            raise ValueError(
                f"{ups} nearest_upsample for {self.stages - 1} strided blocks: give one for each"
            )
        alone = any(pair == ("nearest_upsample",) * 2 for pair in pairwise(decoding))
        if alone or decoding[-1] != "last_unary" or decoding.count("last_unary") != 1:
            raise ValueError(
                f"blocks end in {list(decoding)}: each nearest_upsample needs a unary after it, and the last block "
                "must be the only last_unary"
            )

    @property
    def encoding(self) -> tuple[str, ...]:
        """Blocks of the encoder."""
        return self.blocks[: self._middle]

    @property
    def decoding(self) -> tuple[str, ...]:
        """Blocks of the decoder."""
        return self.blocks[self._middle :]

    @property
    def _middle(self) -> int:
        found = [i for i, block in enumerate(self.blocks) if block in _DECODING]
        return found[0] if found else len(self.blocks)

    @property
    def stages(self) -> int:
        """Number of stages."""
        return 1 + sum(block.endswith("_strided") for block in self.encoding)

    @property
    def skip_dims(self) -> tuple[int, ...]:
        """Widths at the end of each stage, the coarsest included."""
        ends: dict[int, int] = {}
        for block in self.encoder():
            ends[block.stage] = block.plan.dim_out
        # A strided block computes at its coarser stage; before a first block that is strided there is only the input.
        return tuple(ends.get(stage, 1) for stage in range(self.stages))

    @property
    def coarse_dim(self) -> int:
        """Width of the encoder's last block."""
        return self.skip_dims[-1]

    def radius(self, stage: int) -> float:
        """Search radius (m) of a stage counted from 0."""
        return self.voxel * self.base_radius * 2**stage

    def encoder(self) -> Iterator[EncoderBlock]:
        """The encoder's blocks, first to last."""
        dim, width, stage = 1, self.init_dim, 0
        for block in self.encoding:
            simple, strided = block.startswith("simple"), block.endswith("_strided")
            out = width // 2 if simple else width
            # A strided block queries the finer stage from the coarse points, with the finer stage's radius.
            yield EncoderBlock(simple, self._plan(dim, out, stage, strided), stage + strided)
            dim = out
            if strided:
                stage, width = stage + 1, 2 * width

    def _plan(self, dim_in: int, dim_out: int, stage: int, strided: bool) -> BlockPlan:
        return BlockPlan(
            dim_in=dim_in,
            dim_out=dim_out,
            radius=self.radius(stage),
            sigma=self.voxel * self.base_sigma * 2**stage,
            groups=None,
            per_cloud=False,
            n_kernel=self.kernel_points,
            strided=strided,
        )


def _check(blocks: tuple[str, ...], known: tuple[str, ...], part: str) -> None:
    unknown = sorted(set(blocks) - set(known))
    if unknown or not blocks:
        raise ValueError(f"blocks of the {part} must be some of {', '.join(known)}; got {unknown or 'none'}")
