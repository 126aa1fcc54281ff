# SPDX-License-Identifier: MIT
"""Training examples of the networks that look at both clouds stacked: Predator and CoFiNet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import torch

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.pyramid.point_pyramid import Pyramid
from hybridreg.learned.true_pair import TruePair, torch_generator

Targets = TypeVar("Targets")
# Of a pyramid, the true pose (4, 4), a configuration and the generator of all draws.
ComputeTargets = Callable[[Pyramid, torch.Tensor, Any, torch.Generator], Targets]


def stacked_example(
    pair: TruePair, config: Any, rng: np.random.Generator, compute_targets: ComputeTargets[Targets]
) -> tuple[Batch, Targets]:
    """The pyramid of a pair, and one draw of true pairs.

    Raises
    ------
    ValueError
        As `make_batch`.
    """
    batch = make_batch(pair.target.points, pair.source.points, config)
    return batch, compute_targets(batch.pyramid, pair.transform, config, torch_generator(rng))
