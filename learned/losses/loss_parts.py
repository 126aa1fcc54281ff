# SPDX-License-Identifier: MIT
"""The interface of losses to the training loop, and its simplest form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import torch
from torch import Tensor


class Losses(Protocol):
    """What `Pretrained.losses` returns."""

    @property
    def total(self) -> Tensor:
        """Ready for ``backward``, with the configuration's weights."""

    @property
    def parts(self) -> Mapping[str, Tensor]:
        """By the network's ``loss_names``, for the log."""

    @property
    def hits(self) -> Tensor | None:
        """Share of correct matches of the step; None where the losses do not give it."""


class LossParts(dict[str, Tensor]):
    """Losses by name, already weighted."""

    @property
    def total(self) -> Tensor:
        """Their sum."""
        return torch.stack(list(self.values())).sum()

    @property
    def parts(self) -> Mapping[str, Tensor]:
        """The losses themselves."""
        return self

    @property
    def hits(self) -> Tensor | None:
        """Not available."""
        return None
