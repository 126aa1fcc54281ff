# SPDX-License-Identifier: MIT
"""Fixtures that several areas share."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import hypothesis
import numpy as np
import pytest
from numpy.typing import NDArray

from hybridreg import testing
from hybridreg.pair import Pair
from hybridreg.scene import Scene

# Wall-clock deadlines fail on a busy machine; a fixed seed lets a failure be seen again.
hypothesis.settings.register_profile("repeatable", deadline=None, derandomize=True)
hypothesis.settings.load_profile("repeatable")

# A shell that runs the suite in the background leaves SIGINT ignored, and every process that a test starts would too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real sensor pairs; the test skips where it is not."""
    folder = Path(os.environ.get("HYBRIDREG_DATA", ROOT.parent / "shared" / "data")) / "real"
    if not folder.is_dir():
        pytest.skip(f"no real pairs at {folder}")
    return folder


@pytest.fixture
def courtyard() -> tuple[Pair, NDArray[np.float64]]:
    """A made pair that is easy to register, and its true pose."""
    return testing.sample_pair()


@pytest.fixture
def courtyard_scene() -> tuple[Scene, NDArray[np.float64]]:
    return testing.sample_scene()
