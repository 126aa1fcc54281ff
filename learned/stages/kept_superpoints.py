# SPDX-License-Identifier: MIT
"""From the overlap of a level's points to the superpoints that a network keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from hybridreg.learned.cross3dreg.config import NetworkConfig, OmpConfig
from hybridreg.learned.cross3dreg.encodings import CloudEncoding, Encoding
from hybridreg.learned.cross3dreg.superpoint_mask import Kept, choose
from hybridreg.learned.stages.spreading import gather
from hybridreg.learned.stages.tensor_values import array
from hybridreg.matches import Overlap
from hybridreg.scene import Level, Scene, Side


def keep(
    scene: Scene, overlap: Overlap, encoding: Encoding, config: NetworkConfig, min_overlap: float | None
) -> tuple[Kept, Kept]:
    """Superpoints of target and source that the overlap mask keeps; fallbacks are noted in the result."""
    omp = config.omp or OmpConfig()
    if min_overlap is not None:
        omp = replace(omp, threshold=min_overlap)
    limit = config.matching.max_superpoints

    def of(side: Side, level: Level, cloud: CloudEncoding, probability: NDArray[np.float64]) -> Kept:
        kept = choose(cloud.patches, _of_nodes(probability, level, cloud), omp, limit)
        _note(scene, side, kept, len(cloud.nodes))
        return kept

    return (
        of("target", scene.target, encoding.target, overlap.target),
        of("source", scene.source, encoding.source, overlap.source),
    )


def _of_nodes(probability: NDArray[np.float64], level: Level, cloud: CloudEncoding) -> torch.Tensor | None:
    # A mask that is one everywhere has no information; GeoTransformer then keeps empty superpoints too.
    if bool((probability == 1.0).all()):
        return None
    found = gather(probability, level.points, array(cloud.nodes))
    return torch.from_numpy(found.astype(np.float32)).to(cloud.nodes.device)


def _note(scene: Scene, side: Side, kept: Kept, n_nodes: int) -> None:
    n = len(kept.index) + kept.capped
    if kept.fallback == "topk":
        scene.note(
            f"{side}: the overlap mask left too few superpoints, the most probable {n} of {n_nodes} were kept "
            "(mask_fallback=topk)"
        )
    elif kept.fallback == "all":
        scene.note(
            f"{side}: the overlap mask left hardly any superpoints, all {n} that own points were kept "
            "(mask_fallback=all)"
        )
    if kept.capped:
        scene.note(f"{side}: {len(kept.index)} of {n} superpoints were matched (max_superpoints)")
