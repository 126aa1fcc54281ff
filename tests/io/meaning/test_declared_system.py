# SPDX-License-Identifier: MIT
"""Clouds of other libraries that declare a coordinate system, or say which of their points were deleted."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

P = np.random.default_rng(7).uniform(-50.0, 50.0, (80, 3)) + [985_000.0, 200_000.0, 300.0]
FOOT = 1200.0 / 3937.0
FEET = (
    'PROJCS["New York (ftUS)",GEOGCS["NAD83",UNIT["degree",0.0174]],UNIT["US survey foot",0.304800609601219]]'
)
AXES = [{"name": axis, "unit": {"type": "LinearUnit", "conversion_factor": FOOT}} for axis in "xy"]
JSON = {"type": "ProjectedCRS", "coordinate_system": {"subtype": "Cartesian", "axis": AXES}}
OF_PYPROJ = SimpleNamespace(to_json_dict=lambda: JSON, to_wkt=lambda: FEET)
OF_RASTERIO = SimpleNamespace(to_wkt=lambda: FEET)


class Reader:
    """As lazpy 0.9.2's: points from where it stands, and columns from where it is told."""

    point_format = 6

    def __init__(self, crs: Any, withheld: int = 0, taken: int = 0) -> None:
        self.crs, self.header, self.taken = crs, {"variable_length_records": []}, taken
        self.flags = np.arange(len(P)) < withheld

    def xyz(self) -> Any:
        return P[self.taken :]

    def arrays(self, *names: str, start: int = 0) -> dict[str, Any]:
        return {each: self.flags[start:].astype(np.uint8) for each in names}


def points(x: Any) -> Any:
    cloud = PointCloud.of(x, name="target")
    return cloud.points + cloud.offset


@pytest.mark.parametrize(
    "system",
    [OF_PYPROJ, OF_RASTERIO, FEET, "EPSG:2263", 2263],
    ids=["pyproj", "rasterio", "wkt", "code", "number"],
)
@pytest.mark.parametrize("kind", ["reader", "xyz", "axes", "metadata", "dictionary"])
def test_feet_of_a_declared_system_become_metres(system: Any, kind: str) -> None:
    # lazpy 0.9.2's readers, occulus 1.1.0's clouds and others were read as metres in silence.
    held: Any = {
        "reader": Reader(system),
        "xyz": SimpleNamespace(xyz=P, crs=system),
        "axes": SimpleNamespace(x=P[:, 0], y=P[:, 1], z=P[:, 2], crs=system),
        "metadata": SimpleNamespace(xyz=P, metadata=SimpleNamespace(coordinate_system=system)),
        "dictionary": {"points": P, "crs": system},
    }[kind]
    with pytest.warns(UserWarning, match=r"target: its own header says that its unit is 0\.304801 m") as told:
        found = points(held)
    np.testing.assert_allclose(found, P * FOOT, rtol=1e-8)
    assert len(told) == 1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "system", [None, "", "map", "local", True, lambda: FEET, "EPSG:32618", 25832, SimpleNamespace()]
)
def test_metres_and_what_is_no_system_change_nothing(system: Any) -> None:
    np.testing.assert_array_equal(points(SimpleNamespace(xyz=P, crs=system)), P)
    np.testing.assert_array_equal(points(Reader(system)), P)


def test_degrees_are_refused() -> None:
    degrees = P * [1e-4, 1e-4, 1.0]
    with pytest.raises(
        ValueError, match="target: its x and y are longitude and latitude in degrees; .*pyproj"
    ):
        points(SimpleNamespace(xyz=degrees, crs="EPSG:4326"))


def test_a_unit_that_is_given_comes_first_and_nothing_is_turned_twice() -> None:
    with pytest.warns(UserWarning, match=r"unit is 0\.001 m"):
        np.testing.assert_allclose(points(SimpleNamespace(xyz=P, units="mm", crs=FEET)), P / 1000.0)
    inner = SimpleNamespace(xyz=P, crs=FEET)
    with pytest.warns(UserWarning, match="0.304801"):
        np.testing.assert_allclose(points(SimpleNamespace(points=inner, crs=FEET)), P * FOOT, rtol=1e-8)
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.offsets, header.scales = [985_000.0, 200_000.0, 0.0], [0.001] * 3
    las = laspy.LasData(header)
    las.xyz = P
    np.testing.assert_allclose(
        points(SimpleNamespace(points=las, crs=FEET)), P, atol=1e-3
    )  # its header knows best


def test_points_that_were_deleted_are_left_out() -> None:
    with pytest.warns(UserWarning, match="target: 20 of 80 points are flagged as withheld"):
        np.testing.assert_array_equal(points(Reader(None, withheld=20)), P[20:])
    axes = dict(zip("xyz", P.T, strict=True))
    flags = np.arange(len(P)) < 20
    for called, held in (("Withheld", flags.astype(np.uint8)), ("withheld_flag", flags), ("withheld", flags)):
        record = np.zeros(len(P), [(axis, "f8") for axis in "xyz"] + [(called, held.dtype)])
        for key, value in {**axes, called: held}.items():
            record[key] = value
        for each in ({**axes, called: held}, record):  # PDAL's arrays are such records
            with pytest.warns(UserWarning, match=f"20 of 80 points are not valid by '{called}'"):
                np.testing.assert_array_equal(points(each), P[20:])


def test_points_of_copclib_that_were_deleted_are_left_out() -> None:
    # As copclib 2.6.3's: x, y and z of all in one, and `withheld` of each.
    each = [SimpleNamespace(x=x, y=y, z=z, withheld=k < 20) for k, (x, y, z) in enumerate(P.tolist())]

    class Points(list[Any]):
        x, y, z = P.T
        point_format_id = 7

    for held, words in ((Points(each), "20 of 80 points are flagged as withheld"), (each, "by 'withheld'")):
        with pytest.warns(UserWarning, match=words):
            np.testing.assert_array_equal(points(held), P[20:])


def test_a_reader_that_was_read_from_is_refused() -> None:
    # The rest of its points were taken for the cloud.
    with pytest.raises(
        ValueError, match="target: its reader stands before the last 30 of 80 points; open the file anew"
    ):
        points(Reader(None, taken=50))
