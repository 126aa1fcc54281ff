# SPDX-License-Identifier: MIT
"""Training targets: corresponding voxels of a batch under the true pose, and the sample of a step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from hybridreg.learned.fcgf.batch import FcgfBatch
from hybridreg.learned.fcgf.config import FcgfConfig, FcgfLossConfig
from hybridreg.learned.matching.procrustes import apply_transform


@dataclass(frozen=True, kw_only=True)
class FcgfTargets:
    """Rows count over all clouds of a side."""

    positives: Tensor  # (P, 2) int64: rows of source and target
    anchors: Tensor  # (A,) int64: the drawn rows of positives
    source_candidates: Tensor  # (c,) int64 rows of the source: among them the hardest negative is searched
    target_candidates: Tensor  # (c,) int64 rows of the target

    def to(self, device: torch.device | str) -> FcgfTargets:
        """The same targets on another device."""
        names = ("positives", "anchors", "source_candidates", "target_candidates")
        return FcgfTargets(**{name: getattr(self, name).to(device) for name in names})


def compute_targets(
    batch: FcgfBatch, transforms: Tensor, config: FcgfConfig, generator: torch.Generator
) -> FcgfTargets:
    """Positives of a batch, and one sample of anchors and candidates.

    Parameters
    ----------
    transforms
        (B, 4, 4) true ``T_target_source`` of the batch's pairs, or (4, 4) of a single one.
    generator
        On the CPU.

    Raises
    ------
    ValueError
        The number of poses is not that of pairs.
    """
    transforms = transforms.reshape(-1, 4, 4).to(batch.source.points)
    if len(transforms) != len(batch.source.lengths):
        raise ValueError(f"{len(transforms)} poses for {len(batch.source.lengths)} pairs")
    sources, targets = (side.points.split(list(side.lengths)) for side in (batch.source, batch.target))
    found, starts = [], [0, 0]
    for source, target, transform in zip(sources, targets, transforms, strict=True):
        pairs = positive_pairs(
            apply_transform(source, transform), target, config.voxel * config.loss.search_voxels
        )
        found.append(pairs + torch.tensor(starts))
        starts = [starts[0] + len(source), starts[1] + len(target)]
    empty = torch.zeros(0, dtype=torch.int64)
    targets_of = FcgfTargets(
        positives=torch.cat(found), anchors=empty, source_candidates=empty, target_candidates=empty
    )
    lengths = (len(batch.source.points), len(batch.target.points))
    return draw(targets_of, lengths, len(transforms), config.loss, generator).to(batch.source.points.device)


def positive_pairs(source: Tensor, target: Tensor, radius: float) -> Tensor:
    """(P, 2) rows of all points (N, 3), (M, 3) of one frame that are nearer to each other than the radius, in metres.

    All of them, not the nearest only, and no mutual test (util/pointcloud.py 53-66).
    """
    near = cKDTree(target.cpu().numpy()).query_ball_point(source.cpu().numpy(), radius, return_sorted=True)
    counts = [len(rows) for rows in near]
    columns = (
        np.concatenate([np.asarray(rows, dtype=np.int64) for rows in near]) if sum(counts) else np.zeros(0)
    )
    rows = np.repeat(np.arange(len(near)), counts)
    return torch.from_numpy(np.column_stack([rows, columns]).astype(np.int64))


def draw(
    targets: FcgfTargets,
    lengths: tuple[int, int],
    pairs: int,
    config: FcgfLossConfig,
    generator: torch.Generator,
) -> FcgfTargets:
    """Draw new anchors and candidates: a number per pair, all of them from the whole batch.

    Parameters
    ----------
    lengths
        Voxels of all sources and of all targets.
    pairs
        Pairs in the batch.
    """

    def some(n: int, most: int) -> Tensor:
        return torch.randperm(n, generator=generator)[:most].to(targets.positives.device)

    return replace(
        targets,
        anchors=some(len(targets.positives), config.positives * pairs),
        source_candidates=some(lengths[0], config.candidates * pairs),
        target_candidates=some(lengths[1], config.candidates * pairs),
    )
