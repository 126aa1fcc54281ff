# SPDX-License-Identifier: MIT
"""The project's own cases, where they lie beside a checkout: each exits 0 once what it shows is mended."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CASES = Path(__file__).resolve().parents[2] / "shared" / "cases"
MENDED = (
    "origin_on_ground.py",
    "small_object_views.py",
    "cropped_near.py",
    "impossible.py mirror",
    "impossible.py scaled",
    "impossible.py doubled",
    "arrays.py",
    "files.py",
)


@pytest.mark.parametrize("case", MENDED)
def test_a_case_is_mended(case: str) -> None:
    script, *words = case.split()
    if not (CASES / script).exists():
        pytest.skip("the cases are not beside this checkout")
    # One of them imports open3d by itself, which needs the system's libusb or this one.
    usb = pytest.importorskip("libusb_package").get_library_path()
    done = subprocess.run(
        [sys.executable, CASES / script, *words],
        capture_output=True,
        text=True,
        timeout=280,
        env={**os.environ, "LD_PRELOAD": str(usb or "")},
    )
    assert done.returncode == 0, done.stdout + done.stderr
