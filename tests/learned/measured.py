# SPDX-License-Identifier: MIT
"""Memory that a forward pass takes, beside the network's own estimate."""

from __future__ import annotations

import os
import subprocess
import sys

_AROUND = """
import numpy as np, torch
from hybridreg.runtime.resources import peak_memory_mb, reset_peak_memory
torch.set_num_threads(1)
rng = np.random.default_rng(0)
{made}
network.eval()
reset_peak_memory()
before = peak_memory_mb()
with torch.no_grad():
    network(batch)
print((peak_memory_mb() - before) * 2**20, network.memory(batch))
"""


def peak_and_estimate(made: str) -> tuple[float, float]:
    """Bytes that a pass took, and what was foretold, for the ``network`` and the ``batch`` that a code makes.

    In a process of its own, whose heap gives back at once what is freed.
    """
    at_once = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", _AROUND.format(made=made)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, **at_once})
    real, estimate = map(float, done.stdout.split())
    return real, estimate
