# SPDX-License-Identifier: MIT
"""FCGF: features of all voxels from a residual U-Net of sparse convolutions (Choy et al. 2019, model/resunet.py)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.fcgf.batch import FcgfBatch, VoxelClouds
from hybridreg.learned.fcgf.config import SIZES, FcgfConfig, named_config
from hybridreg.learned.fcgf.examples import collate, example
from hybridreg.learned.fcgf.losses import hardest_contrastive
from hybridreg.learned.fcgf.memory import forward_bytes
from hybridreg.learned.fcgf.official_names import config_of, official_name
from hybridreg.learned.fcgf.targets import FcgfTargets
from hybridreg.learned.layers.kernel_maps import KernelMap
from hybridreg.learned.layers.sparse_conv import SparseConv
from hybridreg.learned.layers.voxels import VoxelPyramid
from hybridreg.learned.losses.loss_parts import LossParts
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.weights import load_official_tensors


@dataclass(frozen=True, kw_only=True)
class FcgfOutput:
    """Features of both sides, in the order of the batch's points."""

    source: Tensor  # (N, C)
    target: Tensor  # (M, C)


class FcgfNetwork(Pretrained):
    """Features of a pair, each cloud alone. No part of it takes the ground truth.

    In training mode the statistics of batch normalisation are one side's, source first, as in the published training.
    """

    name: ClassVar[str] = "fcgf"
    config_type: ClassVar[type] = FcgfConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("positive", "negative")
    named_config = staticmethod(named_config)
    example = staticmethod(example)
    together: ClassVar[bool] = True
    collate = staticmethod(collate)

    def __init__(self, config: FcgfConfig) -> None:
        super().__init__()
        self.config = config
        widths, back, depth = config.channels, config.tr_channels, len(config.channels)
        ins = (config.in_channels, *widths[:-1])
        kernels = (config.first_kernel, *[config.kernel] * (depth - 1))
        self.encoder = nn.ModuleList(
            _Level(SparseConv(i, o, kernel), o, config)
            for i, o, kernel in zip(ins, widths, kernels, strict=True)
        )
        # decoder[i] goes from level i + 1 to level i; except at the coarsest, its input is joined with that level's
        # skip
        ins = (*[back[i + 2] + widths[i + 1] for i in range(depth - 2)], widths[-1])
        self.decoder = nn.ModuleList(
            _Level(SparseConv(ins[i], back[i + 1], config.tr_kernel, transposed=True), back[i + 1], config)
            for i in range(depth - 1)
        )
        self.mix = SparseConv(back[1] + widths[0], back[0], 1)
        self.final = SparseConv(back[0], config.out_channels, config.final_kernel, bias=True)

    def forward(self, batch: FcgfBatch) -> FcgfOutput:
        """Features of the source's voxels, then of the target's."""
        source = self.encode(batch.source)
        return FcgfOutput(source=source, target=self.encode(batch.target))

    def encode(self, clouds: VoxelClouds) -> Tensor:
        """(N, C) features of one side.

        Raises
        ------
        ValueError
            In training mode, a level with a single voxel: it has no batch statistics.
        """
        pyramid, config = clouds.pyramid, self.config
        if self.training and any(len(level) < 2 for level in pyramid.levels):
            voxels = [len(level) for level in pyramid.levels]
            raise ValueError(
                f"training needs 2 voxels on every level, and the clouds have {voxels}: leave the pair out"
            )
        features, skips = clouds.features[pyramid.order], []
        for level, layer in enumerate(self.encoder):
            kernel, fine = (config.kernel, level - 1) if level else (config.first_kernel, 0)
            features = layer(features, _map(pyramid, kernel, fine, level), self._same(pyramid, level))
            skips.append(features)
        for level in reversed(range(len(self.decoder))):
            down = pyramid.map(config.tr_kernel, level, level + 1)
            features = self.decoder[level](features, down, self._same(pyramid, level))
            features = torch.cat([features, skips[level]], 1)
        features = self.final(self.mix(features, None).relu_(), _map(pyramid, config.final_kernel, 0, 0))
        features = features[pyramid.inverse]
        if not config.normalize:
            return features
        return features / (features.norm(dim=1, keepdim=True) + config.normalize_eps)

    def _same(self, pyramid: VoxelPyramid, level: int) -> KernelMap | None:
        return _map(pyramid, self.config.kernel, level, level)

    def losses(self, output: FcgfOutput, targets: FcgfTargets) -> LossParts:
        """Hardest-contrastive loss by part, weighted: their sum is trained."""
        found = hardest_contrastive(output.source, output.target, targets, self.config.loss)
        negative = self.config.loss.negative_weight * found.negative
        return LossParts(positive=found.positive, negative=negative)

    def memory(self, batch: FcgfBatch) -> int:
        """Estimated peak of a forward pass in bytes, on top of what the process and the batch's points already hold."""
        return forward_bytes((batch.source.pyramid, batch.target.pyramid), self.config)

    @classmethod
    def load_official(
        cls,
        path: str | os.PathLike[str],
        size: FcgfConfig | str | None = None,
        *,
        normalize: bool | None = None,
        voxel: float | None = None,
    ) -> FcgfNetwork:
        """A published checkpoint, or a bare state dict, in evaluation mode. Read with ``weights_only``.

        Parameters
        ----------
        path
            A ``.pth`` as published (``state_dict`` and ``config``).
        size
            A configuration or its name, which determines everything. By default widths and kernels are read from the
            tensors' shapes, the first kernel from ``conv1.kernel``.
        normalize
            Whether it was trained with features of length one. The tensors do not show it, so it must be given where
            ``size`` does not: the table of the repository's README has a column for it.
        voxel
            Edge (m) of the grid it was trained with. None takes the file's value; where it has none, 0.025 for a
            first kernel of 7 (3DMatch at 2.5 cm) and 0.3 (KITTI) for others. Give it for 3DMatch weights of 5 cm.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named. Or ``normalize`` was not given, or given twice.
        """
        checkpoint = read_checkpoint(path)
        if size is not None:
            if normalize is not None or voxel is not None:
                raise ValueError("size=... settles normalize and voxel too: give it alone, or leave it out")
            config = named_config(size) if isinstance(size, str) else size
        elif normalize is None:
            raise ValueError(
                f"the checkpoint {os.fspath(path)!r} does not say whether its features were normalised in training; "
                "say normalize=True or normalize=False (the table of FCGF's README has it)"
            )
        else:
            voxel = voxel or checkpoint.number("voxel_size")
            config = config_of(checkpoint.tensors, str(path), normalize=normalize, voxel=voxel)
        network = cls(config)
        load_official_tensors(network, checkpoint.tensors, str(path), official_name)
        return network.eval()


class _Level(nn.Module):
    def __init__(self, conv: SparseConv, width: int, config: FcgfConfig) -> None:
        super().__init__()
        self.conv = conv
        self.norm = _norm(width, config)
        self.block = _Block(width, config)

    def forward(self, features: Tensor, across: KernelMap | None, same: KernelMap | None) -> Tensor:
        # A block ends in a ReLU: the one that the published code applies after it changes nothing.
        out: Tensor = self.block(self.norm(self.conv(features, across)), same)
        return out


class _Block(nn.Module):
    def __init__(self, width: int, config: FcgfConfig) -> None:
        super().__init__()
        self.conv1 = SparseConv(width, width, config.kernel)
        self.norm1 = _norm(width, config)
        self.conv2 = SparseConv(width, width, config.kernel)
        self.norm2 = _norm(width, config)

    def forward(self, features: Tensor, same: KernelMap | None) -> Tensor:
        # In place: a voxel's row is not read again.
        out = self.norm1(self.conv1(features, same)).relu_()
        return self.norm2(self.conv2(out, same)).add_(features).relu_()


def _norm(width: int, config: FcgfConfig) -> nn.BatchNorm1d:
    return nn.BatchNorm1d(width, eps=config.bn_eps, momentum=config.bn_momentum)


def _map(pyramid: VoxelPyramid, kernel: int, fine: int, coarse: int) -> KernelMap | None:
    return None if kernel == 1 and fine == coarse else pyramid.map(kernel, fine, coarse)
