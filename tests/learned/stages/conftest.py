# SPDX-License-Identifier: MIT
"""Pairs that random weights can match, and weights that look trained."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.weights import save_pretrained
from hybridreg.pair import Pair

# A whole number of the nano network's superpoint cells (4 m): both clouds fall alike into every grid.
SHIFT = np.array([8.0, -4.0, 4.0])


@pytest.fixture(scope="session")
def shifted() -> tuple[Pair, np.ndarray]:
    """A cloud and its shifted copy: places look alike to any network, trained or not."""
    pair, _ = testing.sample_pair(n_points=1500)
    points = pair.source.points
    return Pair.of(points, points + SHIFT, pair.image, id="shifted"), se3.from_rt(np.eye(3), SHIFT)


@pytest.fixture
def make_weights(tmp_path: Path) -> Callable[..., str]:
    """Write a folder of weights whose named parts have been moved as a training step would."""

    def make(config: NetworkConfig, *, but: tuple[str, ...] = (), name: str = "weights") -> str:
        torch.manual_seed(5)
        network = RegistrationNetwork(config)
        with torch.no_grad():
            for key, parameter in network.named_parameters():
                if key.partition(".")[0] not in but:
                    parameter += 0.01 * torch.randn_like(parameter)
        save_pretrained(network, tmp_path / name)
        return str(tmp_path / name)

    return make
