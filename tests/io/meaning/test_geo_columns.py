# SPDX-License-Identifier: MIT
"""Points in tables of GeoParquet and GeoArrow: the coordinate system beside them gives the unit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg import PointCloud
from hybridreg.io.coordinate_systems.geo_columns import coordinates_of
from hybridreg.io.coordinate_systems.geo_keys import unit_of_keys
from hybridreg.io.coordinate_systems.las_units import metres_of_system
from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.coordinate_systems.proj_json import unit_of_system

pa = pytest.importorskip("pyarrow")
feather = pytest.importorskip("pyarrow.feather")
parquet = pytest.importorskip("pyarrow.parquet")

FOOT = 0.304800609601219  # the US survey foot
P = np.random.default_rng(0).normal(size=(60, 3)) * [5, 4, 2]
RECORDS = pa.array([dict(zip("xyz", row, strict=True)) for row in P.tolist()])
LISTS = pa.FixedSizeListArray.from_arrays(pa.array(P.ravel()), 3)
AT = np.array([11.5, 48.1, 500.0])  # longitude, latitude, height


def projected(unit: Any, method: str = "Transverse Mercator", axes: int = 2, **more: Any) -> dict[str, Any]:
    return {
        "type": "ProjectedCRS",
        "name": "a system",
        "base_crs": {"coordinate_system": {"subtype": "ellipsoidal", "axis": [{"unit": "degree"}] * 2}},
        "conversion": {"method": {"name": method}, "parameters": []},
        "coordinate_system": {"subtype": "Cartesian", "axis": [{"unit": unit}] * axes},
        **more,
    }


UNIT = {"type": "LinearUnit", "name": "US survey foot", "conversion_factor": FOOT}
DEGREES = {
    "type": "GeographicCRS",
    "coordinate_system": {"subtype": "ellipsoidal", "axis": [{"unit": "degree"}] * 2},
}
UPRIGHT = {"type": "VerticalCRS", "coordinate_system": {"subtype": "vertical", "axis": [{"unit": "metre"}]}}


def geoparquet(points: Any, column: dict[str, Any]) -> Any:
    geo = {"primary_column": "geometry", "columns": {"geometry": {"encoding": "point", **column}}}
    return pa.table({"geometry": points}).replace_schema_metadata({"geo": json.dumps(geo)})


def geoarrow(points: Any, beside: dict[str, Any]) -> Any:
    told = {"ARROW:extension:name": "geoarrow.point", "ARROW:extension:metadata": json.dumps(beside)}
    return pa.table([points], schema=pa.schema([pa.field("geometry", points.type, metadata=told)]))


@pytest.mark.parametrize("points", [RECORDS, LISTS])
@pytest.mark.parametrize("make", [geoparquet, geoarrow])
def test_feet_become_metres(points: Any, make: Any, tmp_path: Path) -> None:
    # Before, they were read as metres without a word.
    table = make(points, {"crs": projected(UNIT)})
    parquet.write_table(table, tmp_path / "a.parquet")
    feather.write_feather(table, str(tmp_path / "a.feather"))
    for x in (table, tmp_path / "a.parquet", tmp_path / "a.feather"):
        with pytest.warns(UserWarning, match=r"its unit is 0\.304801 m"):
            np.testing.assert_allclose(PointCloud.of(x).points, P * FOOT, rtol=0, atol=1e-12)


@pytest.mark.parametrize("column", [{}, {"crs": DEGREES}, {"crs": "EPSG:4979"}, {"crs": "OGC:CRS84"}])
def test_degrees_are_refused(column: dict[str, Any]) -> None:
    # A column of GeoParquet that names no system is in degrees.
    rows = (AT + P * [1e-4, 1e-4, 1.0]).tolist()
    table = geoparquet(pa.array([dict(zip("xyz", row, strict=True)) for row in rows]), column)
    with pytest.raises(ValueError, match=r"longitude and latitude in degrees; .*geopandas: x\.to_crs"):
        PointCloud.of(table)


@pytest.mark.parametrize(
    "table",
    [
        geoparquet(RECORDS, {"crs": projected("metre")}),
        geoparquet(RECORDS, {"crs": None}),
        geoarrow(RECORDS, {"crs": projected("metre", axes=3)}),
        geoarrow(RECORDS, {}),
        pa.table({"geometry": RECORDS}).replace_schema_metadata({"geo": "{"}),
        geoparquet(RECORDS, {"crs": projected("metre")}).append_column("i", pa.array(np.ones(60))),
    ],
)
@pytest.mark.filterwarnings("error")
def test_metres_and_nothing_known_are_left(table: Any) -> None:
    np.testing.assert_array_equal(PointCloud.of(table).points, P)


def test_what_systems_say() -> None:
    compound = {"type": "CompoundCRS", "name": "two", "components": [projected(UNIT), UPRIGHT]}
    assert unit_of_system(compound) == LengthUnit(FOOT, 1.0)
    assert unit_of_system({"type": "BoundCRS", "source_crs": projected(UNIT)}) == LengthUnit(FOOT, FOOT)
    assert unit_of_system("EPSG:25832") == LengthUnit()
    assert unit_of_system("EPSG:2263").across == pytest.approx(FOOT)
    assert unit_of_system('PROJCS["a",UNIT["foot",0.3048]]').across == 0.3048
    assert unit_of_system(projected("metre", "Popular Visualisation Pseudo Mercator")).stretched
    assert not unit_of_system(projected("metre", "Transverse Mercator")).stretched
    assert unit_of_system(projected("unity")).unknown == "'a system'"


def test_the_python_that_a_message_gives() -> None:
    assert coordinates_of("x", LengthUnit()) == "x.get_coordinates(include_z=True)"
    assert coordinates_of("x", LengthUnit(0.3048, 1.0)).endswith("(include_z=True) * [0.3048, 0.3048, 1.0]")
    assert coordinates_of("x", LengthUnit(degrees=True)).startswith("x.to_crs(x.estimate_utm_crs()).get_")
    # Projected heights stay as they are, so that feet came out as metres.
    for unit in (LengthUnit(degrees=True, up=0.3048), LengthUnit(up=0.3048, stretched=True)):
        call = coordinates_of("x", unit)
        assert call.endswith(".estimate_utm_crs()).get_coordinates(include_z=True) * [1.0, 1.0, 0.3048]")


def test_heights_in_feet_beside_degrees_are_told() -> None:
    degrees = AT + P * [1e-4, 1e-4, 1.0]
    with pytest.raises(ValueError, match=r"in degrees; project .*; its heights are in units of 0\.3048 m"):
        metres_of_system(degrees, LengthUnit(degrees=True, up=0.3048), "target")
    with pytest.raises(ValueError, match=r"in degrees; project [^;]*$"):
        metres_of_system(degrees, LengthUnit(degrees=True), "target")


def test_systems_in_degrees_say_the_unit_of_their_heights() -> None:
    feet = LengthUnit(up=FOOT, degrees=True)
    foot = {"type": "LinearUnit", "name": "US survey foot", "conversion_factor": FOOT}
    axis = {"name": "Gravity-related height", "abbreviation": "H", "direction": "up", "unit": foot}
    heights = {
        "type": "VerticalCRS",
        "name": "up",
        "coordinate_system": {"subtype": "vertical", "axis": [axis]},
    }
    assert unit_of_system({"type": "CompoundCRS", "name": "two", "components": [DEGREES, heights]}) == feet
    text = 'COMPD_CS["two",GEOGCS["a",UNIT["degree",0.0174532925199433]],VERT_CS["b",UNIT["foot",0.3048]]]'
    assert unit_of_system(text) == LengthUnit(up=0.3048, degrees=True)
    assert unit_of_keys({1024: 2, 2048: 4269, 4099: 9003}).up == pytest.approx(FOOT)
    assert unit_of_keys({1024: 2, 2048: 4269, 4096: 6360}).up == pytest.approx(FOOT)
    assert unit_of_keys({1024: 2, 2048: 4269, 4096: 5703}) == LengthUnit(degrees=True)
    with pytest.warns(UserWarning, match="they were taken for metres"):
        np.testing.assert_array_equal(metres_of_system(P * 1e4, feet, "target"), P * 1e4)
