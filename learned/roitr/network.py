# SPDX-License-Identifier: MIT
"""RoITr: local attention on point-pair features, a global transformer of two branches, coarse-to-fine matching."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.cross3dreg.encodings import CloudEncoding
from hybridreg.learned.layers.kpconv_blocks import pad_row
from hybridreg.learned.matching.patch_pairs import PatchPairs, pair_patches, size_chunks
from hybridreg.learned.matching.point_matching import PointMatches, gather_matches
from hybridreg.learned.matching.sinkhorn import OptimalTransport
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches, match_superpoints
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.pyramid.patches import build_patches
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import SIZES, RoitrConfig, named_config
from hybridreg.learned.roitr.encoder_decoder import RoitrBackbone
from hybridreg.learned.roitr.examples import example
from hybridreg.learned.roitr.global_transformer import GlobalTransformer
from hybridreg.learned.roitr.losses import RoitrLosses, losses
from hybridreg.learned.roitr.memory import forward_bytes
from hybridreg.learned.roitr.official_names import official_name, unused_names
from hybridreg.learned.roitr.point_levels import Levels
from hybridreg.learned.roitr.superpoint_pairs import match_adaptively
from hybridreg.learned.roitr.targets import RoitrTargets
from hybridreg.learned.weights import load_official_tensors


class RoitrEncoding(NamedTuple):
    """A pair after both transformers: all that a training step needs."""

    target: CloudEncoding
    source: CloudEncoding


@dataclass(frozen=True, kw_only=True)
class RoitrOutput:
    """What a forward pass gives. ``node_features`` of both clouds are unit vectors."""

    target: CloudEncoding
    source: CloudEncoding
    superpoints: SuperpointMatches
    matches: PointMatches


class RoitrNetwork(Pretrained):
    """The whole network (model/RIGA_v2.py). No part of it takes the ground truth.

    Parameters
    ----------
    config
        The network; `hybridreg.learned.roitr.config.named_config` has those by name.
    """

    name: ClassVar[str] = "roitr"
    config_type: ClassVar[type] = RoitrConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("coarse", "fine")
    named_config = staticmethod(named_config)
    example = staticmethod(example)

    def __init__(self, config: RoitrConfig) -> None:
        super().__init__()
        self.config = config
        out = config.transformer.output_dim
        self.backbone = RoitrBackbone(config)
        self.transformer = GlobalTransformer(config.widths[-1], config.transformer)
        self.coarse_proj = nn.Linear(out, out)
        self.fine_proj = nn.Linear(config.widths[0], config.fine_dim)
        self.transport = OptimalTransport(config.matching.sinkhorn_iterations)

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: RoitrConfig | str | None = None
    ) -> RoitrNetwork:
        """A published checkpoint, in evaluation mode, read with ``weights_only``.

        Parameters
        ----------
        path
            A file of ``torch.save``: a dict with ``state_dict``, as published, or a bare state dict.
        size
            A configuration or its name; by default ``roitr-3dmatch`` or ``roitr-4dmatch``, whichever has
            the first layer's width.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        tensors = read_checkpoint(path).tensors
        if size is None:
            first = tensors.get("fine_proj.weight")
            wide = first is not None and first.dim() == 2 and first.shape[1] == 128
            size = "roitr-4dmatch" if wide else "roitr-3dmatch"
        network = cls(named_config(size) if isinstance(size, str) else size)
        unused = unused_names(network.state_dict())
        load_official_tensors(network, tensors, str(path), official_name, unused)
        return network.eval()

    def forward(self, batch: RoitrBatch) -> RoitrOutput:
        """Encode both clouds, match superpoints, match points."""
        target, source = self.encode(batch)
        superpoints = self.match_superpoints(target, source)
        matches = self.match_points(target, source, superpoints)
        return RoitrOutput(target=target, source=source, superpoints=superpoints, matches=matches)

    def losses(self, output: RoitrOutput | RoitrEncoding, targets: RoitrTargets) -> RoitrLosses:
        """The training losses of an output, or of `encode`'s: the matches are not needed for them."""
        return losses(self, output, targets)

    def memory(self, batch: RoitrBatch) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        return forward_bytes(batch, self.config)

    def training_output(self, batch: RoitrBatch) -> RoitrEncoding:
        """`encode` alone: matches are not needed for the losses."""
        return self.encode(batch)

    def encode(self, batch: RoitrBatch) -> RoitrEncoding:
        """Target and source with unit superpoint features, fine features and patches."""
        levels = (batch.source, batch.target)
        coarse, fine = zip(*(self.backbone(cloud) for cloud in levels), strict=True)
        mixed = self.transformer(*coarse, *(cloud.points[-1] for cloud in levels))
        source, target = (
            self._cloud(*parts) for parts in zip(levels, mixed, (fine[0], fine[1]), strict=True)
        )
        return RoitrEncoding(target, source)

    def _cloud(self, levels: Levels, mixed: Tensor, fine: Tensor) -> CloudEncoding:
        points, nodes = levels.points[0], levels.points[-1]
        return CloudEncoding(
            nodes=nodes,
            node_features=F.normalize(self.coarse_proj(mixed), dim=1),
            points=points,
            point_features=self.fine_proj(fine),
            patches=build_patches(points, nodes, self.config.matching.patch_points),
        )

    def match_superpoints(
        self,
        target: CloudEncoding,
        source: CloudEncoding,
        kept: tuple[Tensor, Tensor] | None = None,
    ) -> SuperpointMatches:
        """Pairs of superpoints that own fine points; ``kept`` (masks (m,), (n,)) leaves others out."""
        use = [cloud.patches.occupied for cloud in (target, source)]
        if kept is not None:
            use = [owning & keep for owning, keep in zip(use, kept, strict=True)]
        rows = [mask.nonzero()[:, 0] for mask in use]
        features = [
            cloud.node_features[index].detach() for cloud, index in zip((target, source), rows, strict=True)
        ]
        config = self.config.matching
        if self.config.coarse == "adaptive":
            found = match_adaptively(
                features[0], features[1], config.superpoint_matches, self.config.max_feature_distance
            )
        else:
            found = match_superpoints(
                features[0], features[1], config.superpoint_matches, dual=config.dual_normalization
            )
        return SuperpointMatches(rows[0][found.target], rows[1][found.source], found.score)

    def pair_up(
        self, target: CloudEncoding, source: CloudEncoding, target_nodes: Tensor, source_nodes: Tensor
    ) -> PatchPairs:
        """The patches of superpoints (B,), (B,) side by side."""
        return pair_patches(target.patches, source.patches, target_nodes, source_nodes)

    def scores(self, target: CloudEncoding, source: CloudEncoding, pairs: PatchPairs) -> Tensor:
        """Products (B, n, m) of the features of patch pairs over the root of their width; not normalised before."""
        rows = F.embedding(pairs.target_index, pad_row(target.point_features))
        columns = F.embedding(pairs.source_index, pad_row(source.point_features))
        return torch.bmm(rows, columns.transpose(1, 2)) / rows.shape[2] ** 0.5

    def assign(
        self,
        target: CloudEncoding,
        source: CloudEncoding,
        pairs: PatchPairs,
        form: Literal["log", "kernel"] = "log",
        iterations: int | None = None,
    ) -> Tensor:
        """Log-assignments (B, n + 1, m + 1) of patch pairs, the last row and column the slack."""
        scores = self.scores(target, source, pairs)
        return self.transport(scores, pairs.target_mask, pairs.source_mask, form, iterations)

    @torch.no_grad()
    def match_points(
        self, target: CloudEncoding, source: CloudEncoding, superpoints: SuperpointMatches
    ) -> PointMatches:
        """Point correspondences of the matched superpoints' patches; equal pairs of several patches all count."""
        config = self.config.matching
        chunks = size_chunks(self.pair_up(target, source, superpoints.target, superpoints.source))
        blocks = [(chunk, self.assign(target, source, chunk, config.sinkhorn_form)) for chunk in chunks]
        return gather_matches(blocks, target.points, source.points, config)
