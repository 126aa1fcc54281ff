# SPDX-License-Identifier: MIT
"""CoFiNet (Yu et al. 2021): superpoints matched by optimal transport, then the points of their patches."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.cofinet.config import SIZES, CofinetConfig, named_config
from hybridreg.learned.cofinet.losses import CofinetLosses, cofinet_losses
from hybridreg.learned.cofinet.official_names import UNUSED, official_name
from hybridreg.learned.cofinet.patching import PatchIndex, patch_index
from hybridreg.learned.cofinet.point_transport import MASKED, alternating_sinkhorn, either_best
from hybridreg.learned.cofinet.selection import NodePairs, Tried, select
from hybridreg.learned.cofinet.targets import CofinetTargets, compute_targets
from hybridreg.learned.cofinet.transformer import PairTransformer, scores
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.kpfcnn.kpfcnn import KpfcnnDecoder, KpfcnnEncoder
from hybridreg.learned.kpfcnn.stacked_examples import stacked_example
from hybridreg.learned.kpfcnn.stacked_memory import encoder_bytes
from hybridreg.learned.layers.message_attention import Clouds, Masks
from hybridreg.learned.matching.point_matching import PointMatches
from hybridreg.learned.matching.sinkhorn import kernel_sinkhorn, log_sinkhorn
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.weights import load_official_tensors

_FLOAT = 4
# Patch pairs processed at a time: their attention stays small.
_CHUNK = 256


@dataclass(frozen=True, kw_only=True)
class CofinetCloud:
    """One cloud after encoder, attention and decoder."""

    nodes: Tensor  # (n, 3) superpoints, metres
    node_features: Tensor  # (n, dim)
    points: Tensor  # (N, 3) of the first stage, metres
    point_features: Tensor  # (N, fine_dim)


@dataclass(frozen=True, kw_only=True)
class CofinetEncoding:
    """A pair after the encoders: all that training and matching need."""

    target: CofinetCloud
    source: CofinetCloud
    log_assignment: (
        Tensor  # (n + 1, m + 1) of source and target superpoints, the last row and column the slack
    )


@dataclass(frozen=True, kw_only=True)
class CofinetOutput:
    """What a forward pass gives. Weights of matches are probabilities of both transports together."""

    encoding: CofinetEncoding
    nodes: NodePairs
    tried: list[Tried]
    matches: PointMatches


class CofinetNetwork(Pretrained):
    """Features and matches of a pair. No part of it takes the ground truth.

    Exchanging source and target changes the numbers: the source attends first, and each transport normalises its rows
    first. `encode` is all that a training step needs: `losses` takes its result as well as an output.

    Parameters
    ----------
    config
        The network; ``named_config`` has the published one.
    seed
        Fixes the rotation of the kernel points. The weights follow torch's generator.
    """

    name: ClassVar[str] = "cofinet"
    config_type: ClassVar[type] = CofinetConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("coarse", "fine")
    named_config = staticmethod(named_config)
    example = staticmethod(partial(stacked_example, compute_targets=compute_targets))

    def __init__(self, config: CofinetConfig, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        self.bin_score = nn.Parameter(torch.tensor(1.0))
        self.encoder = KpfcnnEncoder(config.backbone, seed)
        self.bottleneck = nn.Linear(config.backbone.coarse_dim, config.dim)
        self.coarse = PairTransformer(config.dim, config.heads)
        self.decoder = KpfcnnDecoder(config.backbone, config.dim)
        self.fine = PairTransformer(config.fine_dim, config.fine_heads)

    @classmethod
    def seeded(cls, config: CofinetConfig, seed: int) -> CofinetNetwork:
        """A network with random weights; the seed rotates the kernel points."""
        return cls(config, seed)

    def forward(self, batch: Batch) -> CofinetOutput:
        """Match a pair: encode, match superpoints, match the points of their patches."""
        encoding = self.encode(batch)
        nodes, tried = select(encoding.log_assignment[:-1, :-1].exp(), self.config.selection)
        return CofinetOutput(
            encoding=encoding, nodes=nodes, tried=tried, matches=self.match_points(encoding, nodes)
        )

    def training_output(self, batch: Batch) -> CofinetEncoding:
        """`encode` alone: matches are not needed for the losses."""
        return self.encode(batch)

    def encode(self, batch: Batch) -> CofinetEncoding:
        """Features of superpoints and points, and the transport between the superpoints."""
        pyramid = batch.pyramid
        features, skips = self.encoder(batch.features, pyramid)
        target, source = self.bottleneck(features).split(list(pyramid.lengths[-1]))
        source, target = self.coarse((source, target))
        fine = self.decoder(torch.cat([target, source]), skips, pyramid).split(list(pyramid.lengths[0]))
        nodes, points = pyramid.clouds(pyramid.stages - 1), pyramid.clouds(0)
        clouds = [
            CofinetCloud(nodes=nodes[i], node_features=rows, points=points[i], point_features=fine[i])
            for i, rows in enumerate((target, source))
        ]
        assignment = self.assign_nodes(scores((source, target)))
        return CofinetEncoding(target=clouds[0], source=clouds[1], log_assignment=assignment)

    def assign_nodes(self, similarity: Tensor) -> Tensor:
        """Scores (n, m) of superpoints to their log-assignment (n + 1, m + 1), whose rows sum to one.

        Without a gradient, in the configuration's form of the iteration; with one, in the log form.
        """
        rows, columns = (
            torch.ones(1, count, dtype=torch.bool, device=similarity.device) for count in similarity.shape
        )
        kernel = self.config.sinkhorn_form == "kernel" and not torch.is_grad_enabled()
        solve = kernel_sinkhorn if kernel else log_sinkhorn
        return solve(similarity[None], rows, columns, self.bin_score, self.config.sinkhorn_iterations)[0]

    def patches(self, encoding: CofinetEncoding) -> tuple[PatchIndex, PatchIndex]:
        """Patches of source and target at inference."""
        source, target = (
            patch_index(cloud.points, cloud.nodes, self.config.patch_points, self.config.patch_rule)
            for cloud in (encoding.source, encoding.target)
        )
        return source, target

    def match_points(
        self,
        encoding: CofinetEncoding,
        nodes: NodePairs,
        patches: tuple[PatchIndex, PatchIndex] | None = None,
    ) -> PointMatches:
        """Points of paired patches that are the best of their row or their column.

        ``patches`` of source and target are those of `patches` unless given.
        """
        source, target = patches or self.patches(encoding)
        found = []
        for chunk in torch.arange(len(nodes.source), device=nodes.source.device).split(_CHUNK):
            sides = (source.take(nodes.source[chunk]), target.take(nodes.target[chunk]))
            assignment = self.assign_points(encoding, sides).exp()
            pair, row, column = either_best(assignment).nonzero(as_tuple=True)
            weight = assignment[pair, row, column] * nodes.confidence[chunk][pair]
            found.append((sides[0].index[pair, row], sides[1].index[pair, column], weight, chunk[pair]))
        none = (nodes.source[:0], nodes.source[:0], nodes.confidence[:0], nodes.source[:0])
        at, to, weight, group = (torch.cat(parts) for parts in zip(none, *found, strict=True))
        return PointMatches(encoding.target.points[to], encoding.source.points[at], weight, group, to, at)

    def assign_points(self, encoding: CofinetEncoding, patches: tuple[PatchIndex, PatchIndex]) -> Tensor:
        """Log-assignments (B, P + 1, P + 1) between the points of B patches of the source and as many of the target."""
        similarity = scores(self.fine(*self.fine_input(encoding, patches)))
        valid = patches[0].mask[:, :, None] & patches[1].mask[:, None]
        return alternating_sinkhorn(similarity.masked_fill(~valid, MASKED), self.config.sinkhorn_iterations)

    def fine_input(
        self, encoding: CofinetEncoding, patches: tuple[PatchIndex, PatchIndex]
    ) -> tuple[Clouds, Masks]:
        """Features (B, P, fine_dim) of the patches' points, and which of them the attention may attend to.

        Empty slots hold point 0 (`CofinetConfig.padding`).
        """
        source = F.embedding(patches[0].filled, encoding.source.point_features)
        target = F.embedding(patches[1].filled, encoding.target.point_features)
        if self.config.padding == "point0":
            return (source, target), (None, None)
        return (source, target), (patches[0].visible, patches[1].visible)

    def losses(self, output: CofinetOutput | CofinetEncoding, targets: CofinetTargets) -> CofinetLosses:
        """Both losses of a pair, and the quality of its matches."""
        encoding = output.encoding if isinstance(output, CofinetOutput) else output
        fine = self.assign_points(encoding, targets.patches)
        return cofinet_losses(encoding.log_assignment, fine, targets, self.config.loss)

    def memory(self, batch: Batch) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        n, m = batch.pyramid.lengths[-1]
        config, largest = self.config, max(n, m)
        coarse = max(n * m * 8, largest**2 * (config.heads + 2)) * _FLOAT + largest * config.dim * 8 * _FLOAT
        patch = config.patch_points * (config.fine_dim * 12 + config.patch_points * (config.fine_heads + 6))
        owners = len(batch.pyramid.points[0]) * 6 * 8 + 2**22 * 3 * _FLOAT
        fine = len(batch.pyramid.points[0]) * config.fine_dim * _FLOAT + _CHUNK * 2 * patch * _FLOAT + owners
        return encoder_bytes(batch.pyramid, config.backbone, max(coarse, fine))

    def untrained(self) -> frozenset[str]:
        """All parts where no training step has touched the network: it has no normalisation weights to show it."""
        bias = next(bias for name, bias in self.coarse.named_parameters() if name.endswith("squeeze.bias"))
        made = bool((bias == 0).all())
        return frozenset(name for name, _ in self.named_children()) if made else frozenset()

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: CofinetConfig | str | None = None
    ) -> CofinetNetwork:
        """The network of a published checkpoint, in evaluation mode.

        Parameters
        ----------
        path
            A ``.pth`` as published, or a bare state dict saved by ``torch.save``. Read with ``weights_only``.
        size
            A configuration or its name, by default ``cofinet-kitti``. Published weights need ``padding="point0"``,
            which that one has.

        Raises
        ------
        FileNotFoundError, ValueError
            No such file; not a checkpoint of this network, with the wrong tensor named.
        """
        tensors = read_checkpoint(path).tensors
        size = size or "cofinet-kitti"
        network = cls(named_config(size) if isinstance(size, str) else size)
        load_official_tensors(network, tensors, str(path), official_name, UNUSED)
        return network.eval()
