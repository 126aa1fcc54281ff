# SPDX-License-Identifier: MIT
"""Grids of xarray whose heights are packed as whole numbers: what the refusal says gives their metres."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

xr = pytest.importorskip("xarray")

HEIGHTS = np.random.default_rng(3).integers(0, 300, (15, 20)).astype("i2")
PACKED = {"scale_factor": 0.1, "add_offset": 500.0}
CELLS = {
    "packed": (PACKED, HEIGHTS * 0.1 + 500.0),
    "packed with a fill": ({**PACKED, "_FillValue": np.int16(-1)}, HEIGHTS * 0.1 + 500.0),
    "scale alone": ({"scale_factor": 0.01}, HEIGHTS * 0.01),
    "fill alone": ({"_FillValue": np.int16(-1)}, HEIGHTS * 1.0),
    "plain": ({"scale_factor": 1.0, "add_offset": 0.0, "_FillValue": np.nan, "units": "m"}, HEIGHTS * 1.0),
}


@pytest.mark.parametrize("table", [False, True])
@pytest.mark.parametrize("kind", CELLS)
def test_the_cure_unpacks(kind: str, table: bool) -> None:
    # Without it heights of 500 m in steps of 0.1 m were those of 0 to 300 m, in silence.
    attributes, metres = CELLS[kind]
    held, expected = HEIGHTS.copy(), metres.copy()
    if "fill" in kind:
        held[0, :5], expected[0, :5] = -1, np.nan
    axes = {"x": np.arange(20.0), "y": np.arange(15.0)}
    x: Any = xr.DataArray(held, dims=("y", "x"), coords=axes, attrs=attributes)
    x = x.to_dataset(name="z") if table else x
    with pytest.raises(ValueError, match="it is a grid over x and y") as refused:
        PointCloud.of(x)
    cure = str(refused.value).split("heights: ")[1]
    assert ("decode_cf" in cure) == (kind != "plain")
    cloud = PointCloud.of(eval(cure, {"x": x, "xarray": xr}), nonfinite="drop")
    z = (cloud.points + cloud.offset)[:, 2]
    np.testing.assert_allclose(np.sort(z), np.sort(expected[np.isfinite(expected)]), atol=1e-4)
