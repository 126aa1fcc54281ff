# SPDX-License-Identifier: MIT
"""What the tests of the learned part share: a small scene, a small network, and the recording's place."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config

ROOT = Path(__file__).resolve().parents[2]
CONFORMANCE = ROOT / "tests" / "conformance"
sys.path += [str(CONFORMANCE), *(str(each) for each in sorted(CONFORMANCE.iterdir()) if each.is_dir())]
# The tensors are small: threads would only wait for each other.
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def truth() -> np.ndarray:
    """The true pose of the small pair."""
    return yaw(35.0, (3.0, -1.0, 0.2))


@pytest.fixture(scope="session")
def pair(truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Target and source: two samplings of one street, the source in its own frame."""
    scene = street(0, 7000)
    inverse = np.linalg.inv(truth)
    return scene[:4000], moved(scene[3000:], inverse)


@pytest.fixture(scope="session")
def nano() -> NetworkConfig:
    """Cross3DReg at its smallest."""
    return named_config("nano", omp=True, vgam=True)


@pytest.fixture(scope="session")
def batch(pair: tuple[np.ndarray, np.ndarray], nano: NetworkConfig) -> Batch:
    """The small pair with a camera image of noise."""
    image = np.random.default_rng(1).integers(0, 255, (90, 160, 3), dtype=np.uint8)
    return make_batch(*pair, nano, image=image)


@pytest.fixture(scope="session")
def network(nano: NetworkConfig) -> RegistrationNetwork:
    """An untrained network in evaluation mode."""
    torch.manual_seed(0)
    return RegistrationNetwork(nano).eval()


@pytest.fixture(scope="session")
def recording_stem() -> Path:
    """The recording of the original network; the test is skipped where it is absent."""
    data = Path(os.environ.get("HYBRIDREG_CONFORMANCE", ROOT / ".." / "shared" / "data" / "conformance"))
    # A worktree lies one level deeper than a checkout.
    for folder in (data, ROOT / ".." / ".." / "shared" / "data" / "conformance"):
        if (folder / "geotransformer_kitti_mini.json").is_file():
            return folder / "geotransformer_kitti_mini"
    pytest.skip("no recording of the original network beside this checkout")
