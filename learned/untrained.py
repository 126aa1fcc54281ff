# SPDX-License-Identifier: MIT
"""Whether a network was ever trained, from its weights alone."""

from __future__ import annotations

import torch
from torch import nn


def untrained_parts(network: nn.Module) -> frozenset[str]:
    """Names of the network's parts (``backbone``, ``omp``, ...) that no training step has touched.

    Normalisation layers are initialised with a scale of one and a shift of zero, and the first optimiser step changes
    them; a part in which all of them are unchanged is random. Parts without such layers are never named.
    """
    return frozenset(name for name, part in network.named_children() if _as_made(part))


def _as_made(part: nn.Module) -> bool:
    norms = [m for m in part.modules() if "Norm" in type(m).__name__ and _own(m)]
    return bool(norms) and all(
        torch.equal(p, torch.ones_like(p) if name == "weight" else torch.zeros_like(p))
        for norm in norms
        for name, p in _own(norm)
    )


def _own(module: nn.Module) -> list[tuple[str, nn.Parameter]]:
    return list(module.named_parameters(recurse=False))
