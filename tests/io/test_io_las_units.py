# SPDX-License-Identifier: MIT
"""The unit that a LAS file's coordinate reference system tells."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest

laspy = pytest.importorskip("laspy")

from hybridreg.io.formats.las import parse_las  # noqa: E402

P = np.round(np.random.default_rng(0).uniform(-50, 50, (40, 3)), 2)
GEOGCS = 'GEOGCS["NAD83",DATUM["D",SPHEROID["GRS",6378137,298.25]],PRIMEM["G",0],UNIT["degree",0.0174532925199433]]'
FEET = f'PROJCS["NY",{GEOGCS},PROJECTION["LCC"],PARAMETER["x",1],UNIT["US survey foot",0.3048006096012192]]'
METRES = f'PROJCS["UTM",{GEOGCS},PROJECTION["TM"],UNIT["metre",1]]'
US = 1200 / 3937


def las(points: np.ndarray, *, keys: dict[int, int] | None = None, wkt: str = "") -> bytes:
    header = laspy.LasHeader(
        point_format=3 if keys is not None else 6, version="1.2" if keys is not None else "1.4"
    )
    header.scales = [1e-7] * 3
    if keys is not None:
        rows = [1, 1, 0, len(keys)] + [value for key, said in keys.items() for value in (key, 0, 1, said)]
        record = laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{len(rows)}H", *rows))
    else:
        record = laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0")
    header.vlrs.append(record)
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    stream = io.BytesIO()
    data.write(stream)
    return stream.getvalue()


@pytest.mark.parametrize(
    "made, across, up",
    [
        ({"keys": {1024: 1, 3076: 9002}}, 0.3048, 0.3048),
        ({"keys": {1024: 1, 3076: 9003}}, US, US),
        ({"keys": {1024: 1, 3076: 9003, 4099: 9001}}, US, 1.0),
        ({"keys": {1024: 1, 3076: 9001, 4099: 9002}}, 1.0, 0.3048),
        ({"wkt": FEET}, US, US),
        ({"wkt": f'COMPD_CS["c",{FEET},VERT_CS["n",VERT_DATUM["n",2005],UNIT["metre",1]]]'}, US, 1.0),
        (
            {"wkt": f'COMPD_CS["c",{METRES},VERT_CS["n",VERT_DATUM["n",2005],UNIT["foot",0.3048]]]'},
            1.0,
            0.3048,
        ),
    ],
)
def test_feet_become_metres_and_say_so(made: dict, across: float, up: float) -> None:
    with pytest.warns(UserWarning, match=r"a\.las: its header says that its unit is .*0\.3048"):
        points = parse_las(las(P, **made), "a.las")
    np.testing.assert_allclose(points, P * [across, across, up], atol=1e-6)


@pytest.mark.parametrize(
    "made",
    [
        {"keys": {}},
        {"keys": {1024: 1, 3076: 9001}},
        {"keys": {1024: 1, 3072: 25832}},
        {"wkt": METRES},
        {"wkt": "x"},
    ],
)
@pytest.mark.filterwarnings("error")
def test_metres_stay(made: dict) -> None:
    np.testing.assert_allclose(parse_las(las(P, **made), "a.las"), P, atol=1e-6)


@pytest.mark.parametrize("made", [{"keys": {1024: 2}}, {"wkt": GEOGCS}])
def test_degrees_are_refused_where_they_are_degrees(made: dict) -> None:
    with pytest.raises(ValueError, match=r"a\.las: .*longitude and latitude.*project"):
        parse_las(las(P / [1e5, 1e5, 1] + [7, 50, 100], **made), "a.las")
    # A wrong system on projected coordinates is common.
    np.testing.assert_allclose(parse_las(las(P + 100, **made), "a.las"), P + 100, atol=1e-6)


def test_objects_of_laspy_tell_their_unit_too() -> None:
    from hybridreg import PointCloud

    record = laspy.read(io.BytesIO(las(P, keys={1024: 1, 3076: 9002})))
    with pytest.warns(UserWarning, match=r"cloud: its header says that its unit is 0\.3048 m"):
        np.testing.assert_allclose(PointCloud.of(record).points, P * 0.3048, atol=1e-6)
