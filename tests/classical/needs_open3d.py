# SPDX-License-Identifier: MIT
"""Marks tests that need an open3d that loads."""

from __future__ import annotations

import pytest

from hybridreg.runtime.open3d import load_open3d


def open3d_loads() -> bool:
    try:
        load_open3d()
    except ImportError:
        return False
    return True


needs_open3d = pytest.mark.skipif(not open3d_loads(), reason="open3d does not load here")
