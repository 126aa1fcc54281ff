# SPDX-License-Identifier: MIT
"""Predator (Huang et al. 2021): overlap, saliency and features of the points of two clouds."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.kpfcnn.kpfcnn import KpfcnnDecoder, KpfcnnEncoder
from hybridreg.learned.kpfcnn.stacked_examples import stacked_example
from hybridreg.learned.kpfcnn.stacked_memory import encoder_bytes
from hybridreg.learned.predator.config import SIZES, PredatorConfig, named_config
from hybridreg.learned.predator.graph import GraphNetwork
from hybridreg.learned.predator.losses import PredatorLosses, predator_losses
from hybridreg.learned.predator.official_names import config_name, official_name
from hybridreg.learned.predator.targets import PredatorTargets, compute_targets
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.pyramid.point_pyramid import Pyramid
from hybridreg.learned.weights import load_official_tensors

# Of the logarithm of the cross score's temperature, before training (models/architectures.py).
_EPSILON = -5.0


@dataclass(frozen=True, kw_only=True)
class PredatorCloud:
    """One cloud's points of the first stage, and the network's output for each."""

    points: Tensor  # (N, 3) metres
    features: Tensor  # (N, final_dim), length one
    overlap: Tensor  # (N,) in [0, 1]: probability of lying in the overlap
    saliency: Tensor  # (N,) in [0, 1]: probability that its best match in the overlap is correct

    @property
    def sampling(self) -> Tensor:
        """(N,) probabilities by which points are drawn for matching; all equal where no point has any score."""
        weight = self.overlap * self.saliency
        total = weight.sum()
        return weight / total if bool(total > 0) else torch.full_like(weight, 1.0 / max(1, len(weight)))


@dataclass(frozen=True, kw_only=True)
class PredatorOutput:
    """What a forward pass gives."""

    target: PredatorCloud
    source: PredatorCloud


class PredatorNetwork(Pretrained):
    """Features, overlap and saliency of both clouds' points. No part of it takes the ground truth.

    Exchanging source and target changes the numbers: the source attends first. Evaluation and training mode compute
    the same.

    Parameters
    ----------
    config
        The network; ``named_config`` has the published ones.
    seed
        Fixes the rotation of the kernel points. The weights follow torch's generator.
    """

    name: ClassVar[str] = "predator"
    config_type: ClassVar[type] = PredatorConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("circle", "overlap", "saliency")
    named_config = staticmethod(named_config)
    example = staticmethod(partial(stacked_example, compute_targets=compute_targets))

    def __init__(self, config: PredatorConfig, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        dim = config.graph.dim
        self.epsilon = nn.Parameter(torch.tensor(_EPSILON))
        self.encoder = KpfcnnEncoder(config.backbone, seed)
        self.bottleneck = nn.Linear(config.backbone.coarse_dim, dim)
        self.graph = GraphNetwork(dim, config.graph.neighbors, config.graph.heads, config.graph.blocks)
        self.project = nn.Linear(dim, dim)
        self.score = nn.Linear(dim, 1)
        self.decoder = KpfcnnDecoder(config.backbone, config.decoder_dim, config.final_dim + 2)
        nn.init.zeros_(self.score.bias)  # by which `untrained` recognises it

    @classmethod
    def seeded(cls, config: PredatorConfig, seed: int) -> PredatorNetwork:
        """A network with random weights; the seed rotates the kernel points."""
        return cls(config, seed)

    def forward(self, batch: Batch) -> PredatorOutput:
        """Features and scores of all points of a pair."""
        pyramid = batch.pyramid
        coarse, skips = self.encoder(batch.features, pyramid)
        before = self.bottleneck(coarse)
        features = self.project(self.mix(before, pyramid))
        score = self.score(features)
        decoded = self.decoder(self.decoder_input(before, features, score, pyramid), skips, pyramid)
        return self.output(decoded, pyramid)

    def mix(self, features: Tensor, pyramid: Pyramid) -> Tensor:
        """Superpoint features (n + m, dim) of both clouds after the graph blocks."""
        target, source = features.split(list(pyramid.lengths[-1]))
        points = pyramid.clouds(pyramid.stages - 1)
        source, target = self.graph((source, target), (points[1], points[0]))
        return torch.cat([target, source])

    def decoder_input(self, before: Tensor, features: Tensor, score: Tensor, pyramid: Pyramid) -> Tensor:
        """Overlap score, cross-overlap score, features (n + m, decoder_dim)."""
        parts = [score, features if self.config.condition_feature else before]
        if self.config.cross_score:
            parts.insert(1, self.cross_score(features, score, pyramid))
        return torch.cat(parts, 1)

    def cross_score(self, features: Tensor, score: Tensor, pyramid: Pyramid) -> Tensor:
        """Mean (n + m, 1) of the other cloud's raw scores, weighted by the similarity of its superpoints."""
        lengths = list(pyramid.lengths[-1])
        target, source = F.normalize(features, dim=1).split(lengths)
        of_target, of_source = score.split(lengths)
        likeness = target @ source.t() / (self.epsilon.exp() + self.config.temperature_floor)
        return torch.cat([likeness.softmax(1) @ of_source, likeness.t().softmax(1) @ of_target])

    def output(self, decoded: Tensor, pyramid: Pyramid) -> PredatorOutput:
        """From the decoder's last layer: features to length one, scores to probabilities."""
        dim = self.config.final_dim
        features = F.normalize(decoded[:, :dim], dim=1)
        scores = torch.sigmoid(decoded[:, dim:]).nan_to_num(0.0, 0.0, 0.0)
        rows = [each.split(list(pyramid.lengths[0])) for each in (features, scores)]
        target, source = (
            PredatorCloud(
                points=cloud,
                features=rows[0][side],
                overlap=rows[1][side][:, 0],
                saliency=rows[1][side][:, 1],
            )
            for side, cloud in enumerate(pyramid.clouds(0))
        )
        return PredatorOutput(target=target, source=source)

    def losses(self, output: PredatorOutput, targets: PredatorTargets) -> PredatorLosses:
        """The three losses of a pair, and the quality of its features."""
        return predator_losses((output.target, output.source), targets, self.config.loss)

    def memory(self, batch: Batch) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        counts, dim = batch.pyramid.lengths[-1], self.config.graph.dim
        edges = max(counts) * (self.config.graph.neighbors + 1) * 2 * dim * 3 * 4
        attention = counts[0] * counts[1] * (self.config.graph.heads + 3) * 2 * 4
        distances = max(counts) ** 2 * 3 * 4
        return encoder_bytes(batch.pyramid, self.config.backbone, max(edges, attention, distances))

    def untrained(self) -> frozenset[str]:
        """All parts where no training step has touched the network: it has no normalisation weights to show it."""
        # An instance norm hides the bias of the score from the losses: its gradient is rounding, and may be none.
        made = bool((self.score.bias == 0).all()) and self.epsilon.item() == _EPSILON
        return frozenset(name for name, _ in self.named_children()) if made else frozenset()

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: PredatorConfig | str | None = None
    ) -> PredatorNetwork:
        """The network of a published checkpoint, in evaluation mode.

        Parameters
        ----------
        path
            A ``.pth`` as published, or a bare state dict saved by ``torch.save``. Read with ``weights_only``.
        size
            A configuration or its name; by default ``predator-kitti`` or ``predator-3dmatch``, whichever has the
            search radius of the kernel points. Weights older than June 2021 fit in shape but were trained with a bug
            that was later fixed (its issue 15): they match less well here.

        Raises
        ------
        FileNotFoundError, ValueError
            No such file; not a checkpoint of this network, with the wrong tensor named.
        """
        tensors = read_checkpoint(path).tensors
        size = config_name(tensors, str(path)) if size is None else size
        network = cls(named_config(size) if isinstance(size, str) else size)
        load_official_tensors(network, tensors, str(path), official_name)
        return network.eval()
