# SPDX-License-Identifier: MIT
"""OMNet: a pose regressed in four iterations, the last ones on the predicted overlap (Xu et al. 2021)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.memory_estimate import SLACK
from hybridreg.learned.omnet.batch import OmnetBatch
from hybridreg.learned.omnet.config import SIZES, OmnetConfig, named_config
from hybridreg.learned.omnet.examples import collate, example
from hybridreg.learned.omnet.iteration_parts import Decoder, Encoder, Fusion, Regression
from hybridreg.learned.omnet.losses import OmnetLosses, omnet_losses
from hybridreg.learned.omnet.official_names import config_of, official_name
from hybridreg.learned.omnet.quaternions import compose, matrix_of, rotate
from hybridreg.learned.omnet.targets import OmnetTargets
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.weights import load_official_tensors


@dataclass(frozen=True, kw_only=True)
class Step:
    """One iteration: its input and its output."""

    source_points: Tensor  # (B, N, 3) as moved by the iterations before
    source_mask: Tensor  # (B, N) bool: its input mask
    target_mask: Tensor  # (B, M) bool
    source_logits: Tensor  # (B, 2, N) of not overlapping and overlapping, for the next iteration
    target_logits: Tensor  # (B, 2, M)
    pooled: Tensor  # (B, p) the input of the regression
    pose_step: Tensor  # (B, 7) unit quaternion (w first) and translation of this iteration alone
    pose: Tensor  # (B, 7) of all so far: source to target


@dataclass(frozen=True, kw_only=True)
class OmnetOutput:
    """All iterations, and their input clouds."""

    steps: tuple[Step, ...]
    source: Tensor  # (B, N, 3)
    target: Tensor  # (B, M, 3)

    @property
    def transform(self) -> Tensor:
        """(B, 3, 4) of the last iteration, source to target."""
        return matrix_of(self.steps[-1].pose)


class OmnetNetwork(Pretrained):
    """Poses of a batch of pairs. No part of it takes the ground truth.

    A pose never sees the mask of its own iteration: the first ``mask_delay`` iterations see every point, each later
    one those in the overlap predicted by the iteration before. No gradient passes through masks or between iterations.
    """

    name: ClassVar[str] = "omnet"
    config_type: ClassVar[type] = OmnetConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("mask", "quaternion", "translation")
    named_config = staticmethod(named_config)
    example = staticmethod(example)
    together: ClassVar[bool] = True
    collate = staticmethod(collate)

    def __init__(self, config: OmnetConfig) -> None:
        super().__init__()
        self.config = config
        each = range(config.iterations)
        self.encoder = nn.ModuleList(Encoder(config) for _ in each)
        self.fusion = nn.ModuleList(Fusion(config) for _ in each)
        self.decoder = nn.ModuleList(Decoder(config) for _ in each)
        self.regression = nn.ModuleList(Regression(config) for _ in each)

    def forward(self, batch: OmnetBatch) -> OmnetOutput:
        """Register a batch of pairs.

        Raises
        ------
        ValueError
            In training mode, a batch of a single pair: its regression has no batch statistics.
        """
        if self.training and len(batch.source) < 2:
            raise ValueError(
                "OMNet normalises over the batch: train it with 2 pairs or more a step, not with 1"
            )
        steps: list[Step] = []
        for i in range(self.config.iterations):
            before = steps[-1] if steps else None
            if before is not None and i >= self.config.mask_delay:
                masks = [logits.argmax(1) == 1 for logits in (before.source_logits, before.target_logits)]
            else:
                masks = [
                    cloud.new_ones(cloud.shape[:2], dtype=torch.bool)
                    for cloud in (batch.source, batch.target)
                ]
            steps.append(self.step(i, batch, masks, before))
        return OmnetOutput(steps=tuple(steps), source=batch.source, target=batch.target)

    def step(self, i: int, batch: OmnetBatch, masks: list[Tensor], before: Step | None) -> Step:
        """Iteration ``i`` on the points that the masks (B, N), (B, M) of source and target leave."""
        # As published, the moved points are moved again by the last step, not the original ones by the composed pose.
        source = batch.source
        if before is not None:
            step = before.pose_step.detach()
            source = rotate(step[:, :4], before.source_points) + step[:, None, 4:]
        inputs = [mask[:, None].to(source.dtype) for mask in masks]
        clouds = [
            self.encoder[i](points.transpose(1, 2), mask)
            for points, mask in zip((source, batch.target), inputs, strict=True)
        ]
        pooled = [cloud[2] for cloud in clouds]
        fused = [self.fusion[i](clouds[k][0], pooled[k], pooled[1 - k], inputs[k]) for k in (0, 1)]
        decoded = [self.decoder[i](fused[k], inputs[k]) for k in (0, 1)]
        joined = torch.cat([part.amax(2) for k in (0, 1) for part in (fused[k], decoded[k][1])], 1)
        pose_step = self.regression[i](joined)
        pose = pose_step if before is None else compose(before.pose.detach(), pose_step)
        return Step(
            source_points=source,
            source_mask=masks[0],
            target_mask=masks[1],
            source_logits=decoded[0][0],
            target_logits=decoded[1][0],
            pooled=joined,
            pose_step=pose_step,
            pose=pose,
        )

    def losses(self, output: OmnetOutput, targets: OmnetTargets) -> OmnetLosses:
        """Weighted losses of every iteration by name (``mask_0``, ``quaternion_0``, ``translation_0``, ...).

        Their sum is trained.
        """
        return omnet_losses(output, targets, self.config.loss)

    def memory(self, batch: OmnetBatch) -> int:
        """Estimated peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        config, points = self.config, batch.source.shape[1] + batch.target.shape[1]
        # A layer's input, output and the steps between; both clouds' fused, decoded and local features beside them.
        inner = max(
            config.local_dim + 2 * config.encoder[-1] + config.fusion[0],
            3 * max(*config.fusion, *config.encoder),
        )
        kept = config.regression_input // 2 + config.local_dim + config.encoder[-1]
        return SLACK + len(batch.source) * points * (inner + kept) * 4

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: OmnetConfig | str | None = None
    ) -> OmnetNetwork:
        """A published checkpoint (PyTorch form), or a bare state dict, in evaluation mode. Read with ``weights_only``.

        Parameters
        ----------
        path
            A ``.pth`` as published.
        size
            A configuration or its name. By default layers, widths and iterations are read from the tensors' shapes; the
            mask delay (2), which layer gives a point's own features (the second) and the losses are those of all
            published weights.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        tensors = read_checkpoint(path).tensors
        config = named_config(size) if isinstance(size, str) else size
        network = cls(config or config_of(tensors, str(path)))
        layers = len(network.config.decoder)
        load_official_tensors(network, tensors, str(path), lambda name: official_name(name, layers))
        return network.eval()
