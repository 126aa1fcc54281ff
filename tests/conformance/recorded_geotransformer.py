# SPDX-License-Identifier: MIT
"""GeoTransformer: every recorded output within 1e-4."""

from __future__ import annotations

from pathlib import Path

from compare import differences
from plan import read_recording

TOLERANCE = 1e-4


def compare(stem: Path) -> dict[str, tuple[float, float]]:
    """Largest difference and tolerance by output."""
    return {name: (value, TOLERANCE) for name, value in differences(read_recording(stem)).items()}
