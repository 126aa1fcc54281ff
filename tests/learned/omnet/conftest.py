# SPDX-License-Identifier: MIT
"""A small batch, its network, and where the recording of the original is."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from omnet_pairs import shapes

from hybridreg.learned.omnet.batch import OmnetBatch
from hybridreg.learned.omnet.config import named_config
from hybridreg.learned.omnet.network import OmnetNetwork


@pytest.fixture(scope="session")
def omnet_stem(recording_stem: Path) -> Path:
    """The recording of OMNet, beside that of today's network."""
    return recording_stem.with_name("omnet_mini")


@pytest.fixture(scope="session")
def four_shapes() -> tuple[OmnetBatch, torch.Tensor]:
    """Four partly overlapping pairs and their true poses (4, 3, 4)."""
    return shapes(4)


@pytest.fixture
def nano_omnet() -> OmnetNetwork:
    """An untrained network in evaluation mode."""
    torch.manual_seed(0)
    return OmnetNetwork(named_config("nano")).eval()
