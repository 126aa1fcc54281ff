# SPDX-License-Identifier: MIT
"""One optimiser step over several pairs and processes: sum, average, clip, or skip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

if TYPE_CHECKING:
    from lightning_fabric import Fabric


@dataclass(frozen=True, kw_only=True)
class StepOutcome:
    """How a step went; the same on every process."""

    norm: float  # of the averaged gradient before clipping
    bad: tuple[int, ...]  # indices in the step's batch whose loss was not finite
    stepped: bool
    stop: bool  # a process was asked to stop
    due: bool  # a process says that a checkpoint is due


def finish_step(
    fabric: Fabric,
    optimizer: torch.optim.Optimizer,
    parameters: Sequence[nn.Parameter],
    bad: Tensor,
    clip: float,
    stop: bool,
    due: bool = False,
) -> StepOutcome:
    """Sum the processes' gradients, clip, and step; a step with anything not finite is skipped by all.

    Parameters
    ----------
    parameters
        Their gradients hold this process's share of the mean over the batch.
    bad
        (batch,) float: 1 where a loss of this process was not finite.
    clip
        Largest norm of the gradient.
    stop
        Whether this process was asked to stop.
    due
        Whether a checkpoint is due by this process's clock. Clocks differ, and all must reach the same barrier.
    """
    votes = torch.cat([bad, bad.new_tensor([float(stop), float(due)])])
    if fabric.world_size > 1:
        votes = _share(fabric, parameters, votes)
    places = tuple(votes[:-2].nonzero()[:, 0].tolist())
    norm = float(nn.utils.clip_grad_norm_([p for p in parameters if p.grad is not None], clip))
    stepped = not places and norm == norm and norm != float("inf")
    if stepped:
        optimizer.step()
    optimizer.zero_grad(set_to_none=True)
    return StepOutcome(norm=norm, bad=places, stepped=stepped, stop=bool(votes[-2]), due=bool(votes[-1]))


def _share(fabric: Fabric, parameters: Sequence[nn.Parameter], votes: Tensor) -> Tensor:
    # One message: all gradients, which of them exist, and the votes. A parameter that no process used gets no
    # gradient, so that the optimiser leaves it alone, as in a single process.
    present = torch.tensor([float(p.grad is not None) for p in parameters], device=votes.device)
    flat = [(torch.zeros_like(p) if p.grad is None else p.grad).flatten() for p in parameters]
    summed = fabric.all_reduce(torch.cat([*flat, present, votes]), reduce_op="sum")
    assert isinstance(summed, Tensor)
    sizes = [p.numel() for p in parameters]
    *gradients, present, votes = summed.split([*sizes, len(parameters), len(votes)])
    for parameter, gradient, used in zip(parameters, gradients, present.tolist(), strict=True):
        parameter.grad = gradient.view_as(parameter).clone() if used else None
    return votes
