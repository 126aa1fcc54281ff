# SPDX-License-Identifier: MIT
"""What a training loop asks of losses, and the plainest form of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import torch
from torch import Tensor


class Losses(Protocol):
    """What `Pretrained.losses` gives."""

    @property
    def total(self) -> Tensor:
        """Ready for ``backward``, with the configuration's weights."""

    @property
    def parts(self) -> Mapping[str, Tensor]:
        """By the network's ``loss_names``, for the log."""

    @property
    def hits(self) -> Tensor | None:
        """Share of the step's answers that were right; None where the losses do not tell."""


class LossParts(dict[str, Tensor]):
    """Losses by name that are weighed already."""

    @property
    def total(self) -> Tensor:
        """Their sum."""
        return torch.stack(list(self.values())).sum()

    @property
    def parts(self) -> Mapping[str, Tensor]:
        """Themselves."""
        return self

    @property
    def hits(self) -> Tensor | None:
        """They do not tell."""
        return None
