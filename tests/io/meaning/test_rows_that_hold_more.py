# SPDX-License-Identifier: MIT
"""Tables of which a cell holds a record, a geometry or a whole cloud."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg import PointCloud

pd = pytest.importorskip("pandas")
pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

P = np.random.default_rng(0).normal(size=(60, 3)) * [5, 4, 2]
RECORDS = pa.array([dict(zip("xyz", row, strict=True)) for row in P.tolist()])


@pytest.mark.parametrize("name", ["p", "point", "position", "geometry", "xyz"])
def test_records_of_x_y_and_z(name: str, tmp_path: Path) -> None:
    # As GeoParquet keeps points in its native encoding.
    table = pa.table({name: RECORDS, "intensity": np.ones(60), "id": np.arange(60)})
    parquet.write_table(table, tmp_path / "a.parquet")
    for x in (table, tmp_path / "a.parquet"):
        np.testing.assert_array_equal(PointCloud.of(x).points, P)


def test_geometries_in_binary_are_refused_with_what_reads_them(tmp_path: Path) -> None:
    table = pa.table({"geometry": pa.array([b"\1" * 29] * 60), "id": np.arange(60)})
    columns = b'{"geometry": {"encoding": "WKB", "crs": null}}'
    geo = b'{"version": "1.0.0", "primary_column": "geometry", "columns": ' + columns + b"}"
    parquet.write_table(table.replace_schema_metadata({b"geo": geo}), tmp_path / "a.parquet")
    with pytest.raises(
        ValueError, match=r"WKB\); give x\.get_coordinates.* of x = geopandas.read_parquet\(path\)"
    ):
        PointCloud.of(tmp_path / "a.parquet")


@pytest.mark.parametrize(
    "columns",
    [
        {"points": [P.tolist()]},
        {"frame": [0, 1], "xyz": [P.tolist(), P[:30].tolist()]},
        {axis: [values.tolist(), [0.0]] for axis, values in zip("xyz", P.T, strict=True)},
    ],
)
def test_a_row_that_is_a_whole_cloud_is_refused_with_how_to_take_it(
    columns: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "a.parquet"
    parquet.write_table(pa.table(columns), path)
    x = pd.read_parquet(path)
    for each in (path, pa.table(columns), x):
        with pytest.raises(ValueError, match=r"in its first row; give the cloud of one row") as caught:
            PointCloud.of(each)
        cure = re.search(r"in pandas: (.*)", str(caught.value))
        assert cure is not None
        np.testing.assert_array_equal(PointCloud.of(eval(cure.group(1), {"x": x, "numpy": np})).points, P)


def test_a_column_of_units() -> None:
    table = pd.DataFrame(P * 1000.0, columns=list("xyz")).assign(unit="mm")
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m; it was read in metres"):
        np.testing.assert_allclose(PointCloud.of(table).points, P, rtol=0, atol=1e-12)


@pytest.mark.parametrize("text", [False, True])
def test_rows_in_different_units_are_refused(tmp_path: Path, text: bool) -> None:
    given = pd.DataFrame(P, columns=list("xyz")).assign(unit=["mm", "m"] * 30)
    if text:
        given.to_csv(tmp_path / "p.csv", index=False)
        given = tmp_path / "p.csv"
    with pytest.raises(ValueError, match="unit"):
        PointCloud.of(given)
