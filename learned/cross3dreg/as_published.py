# SPDX-License-Identifier: MIT
"""What Cross3DReg's paper prints of the matching, and where a network's weights come from something else."""

from __future__ import annotations

from dataclasses import replace

from hybridreg.learned.cross3dreg.config import NetworkConfig

# lambda of arXiv 2509.06456: a superpoint goes on above this probability of overlap.
THRESHOLD = 0.5


def as_published(config: NetworkConfig) -> NetworkConfig:
    """The configuration without what is ours at inference.

    No votes of the fine points, no weights or cut by uniqueness, no consistency filter, none of the matches that the
    mask doubts left out, and the mask cut at 0.5. What is left is dual normalisation of the superpoints' similarity,
    optimal transport between the points of each matched pair, and the entries among the top K' of row and column. No
    tensor changes its meaning.
    """
    matching = replace(config.matching, vote_temperature=None, uniqueness=0.0, consistency=None)
    omp = None if config.omp is None else replace(config.omp, threshold=THRESHOLD, doubted=0.0)
    return replace(config, matching=matching, omp=omp)


def mask_inputs_of_ours(config: NetworkConfig) -> list[str]:
    """What a mask predictor was trained to look at besides its own cloud's superpoints and the image, in words."""
    if config.omp is None:
        return []
    ours = {"the other cloud": config.omp.cross_cloud, "how alike its points are": config.omp.evidence}
    return [words for words, used in ours.items() if used]
