# SPDX-License-Identifier: MIT
"""A small pair, its network, and where the recording of the original is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.fcgf.batch import FcgfBatch, make_batch
from hybridreg.learned.fcgf.config import named_config
from hybridreg.learned.fcgf.network import FcgfNetwork


@pytest.fixture(scope="session")
def fcgf_stem(recording_stem: Path) -> Path:
    """The recording of FCGF, beside that of today's network."""
    return recording_stem.with_name("fcgf_kitti_mini")


@pytest.fixture(scope="session")
def small_truth() -> np.ndarray:
    """The true pose of the small pair."""
    return yaw(20.0, (1.0, 0.5, 0.1))


@pytest.fixture(scope="session")
def small_pair(small_truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Target and source: two samplings of one street, the source in its own frame."""
    scene = street(3, 2600, 10.0)
    return scene[:1600], moved(scene[1000:], np.linalg.inv(small_truth))


@pytest.fixture(scope="session")
def small_batch(small_pair: tuple[np.ndarray, np.ndarray]) -> FcgfBatch:
    """The small pair on the nano network's grid."""
    return make_batch(*small_pair, named_config("nano"))


@pytest.fixture
def nano_fcgf() -> FcgfNetwork:
    """An untrained network in evaluation mode."""
    torch.manual_seed(0)
    return FcgfNetwork(named_config("nano")).eval()
