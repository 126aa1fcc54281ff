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


def wkt2(name: str, unit: str) -> str:
    axis = f'AXIS["{{}}",{{}},LENGTHUNIT[{unit}]]'
    system = f"CS[Cartesian,2],{axis.format('E', 'east')},{axis.format('N', 'north')}"
    base = 'BASEGEOGCRS["b",DATUM["d",ELLIPSOID["e",6378137,298.25,LENGTHUNIT["metre",1]]]]'
    return f'PROJCRS["{name}",{base},CONVERSION["c",METHOD["LCC"]],{system}]'


def local(unit: str) -> str:
    return f'LOCAL_CS["Local",LOCAL_DATUM["d",0],UNIT[{unit}]]'


FEET_2 = wkt2("NY", '"foot",0.3048')


def las(
    points: np.ndarray, *, keys: dict[int, int] | None = None, wkt: str = "", behind: bool = False
) -> bytes:
    header = laspy.LasHeader(
        point_format=3 if keys is not None else 6, version="1.2" if keys is not None else "1.4"
    )
    header.scales, header.offsets = [1e-7] * 3, np.floor(points.min(axis=0))
    if keys is not None:
        rows = [1, 1, 0, len(keys)] + [value for key, said in keys.items() for value in (key, 0, 1, said)]
        record = laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{len(rows)}H", *rows))
    else:
        record = laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0")
    if not behind:
        header.vlrs.append(record)
    data = laspy.LasData(header)
    if behind:
        data.evlrs = laspy.vlrs.vlrlist.VLRList([record])
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
        ({"wkt": FEET, "behind": True}, US, US),
        ({"wkt": f'{FEET},VERTCS["n",VDATUM["n"],UNIT["Meter",1.0]]'}, US, 1.0),
        ({"wkt": wkt2("NY", '"US survey foot",0.3048006096012192')}, US, US),
        ({"wkt": FEET_2}, 0.3048, 0.3048),
        ({"wkt": f"BOUNDCRS[SOURCECRS[{FEET_2}]]"}, 0.3048, 0.3048),
        ({"wkt": 'PROJCRS["NY",CS[Cartesian,2],ID["EPSG",2222]]'}, 0.3048, 0.3048),
        ({"wkt": local('"foot",0.3048')}, 0.3048, 0.3048),
        ({"keys": {1024: 1, 3072: 2229}}, US, US),
        ({"keys": {3072: 2222, 2048: 4269}}, 0.3048, 0.3048),
        ({"keys": {1024: 1, 3072: 25832, 4096: 8228}}, 1.0, 0.3048),
    ],
)
def test_feet_become_metres_and_say_so(made: dict, across: float, up: float) -> None:
    with pytest.warns(UserWarning, match=r"a\.las: its own header says that its unit is .*0\.3048"):
        points = parse_las(las(P, **made), "a.las")
    np.testing.assert_allclose(points, P * [across, across, up], atol=1e-6)


@pytest.mark.parametrize(
    "made",
    [
        {"keys": {}},
        {"keys": {1024: 1, 3076: 9001}},
        {"keys": {1024: 1, 3072: 25832}},
        {"keys": {1024: 1, 3072: 32633, 4096: 5703}},
        {"wkt": METRES},
        {"wkt": wkt2("UTM", '"metre",1')},
        {"wkt": local('"metre",1')},
    ],
)
@pytest.mark.filterwarnings("error")
def test_metres_stay(made: dict) -> None:
    np.testing.assert_allclose(parse_las(las(P, **made), "a.las"), P, atol=1e-6)


def test_millimetres_of_a_local_system_become_metres() -> None:
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m"):
        points = parse_las(las(P, wkt=local('"millimetre",0.001')), "a.las")
    np.testing.assert_allclose(points, P / 1000, atol=1e-9)


@pytest.mark.parametrize(
    "made, named",
    [
        ({"keys": {1024: 1, 3072: 1999}}, "EPSG:1999"),
        ({"keys": {1024: 1, 3072: 2229, 3076: 9014}}, "unit EPSG:9014"),
        ({"keys": {1024: 1, 3072: 25832, 4096: 5103}}, "EPSG:5103"),
        ({"keys": {1024: 1, 3072: 32767}}, "defined by its writer"),
        ({"wkt": "x"}, "'x'"),
        ({"wkt": 'LOCAL_CS["Site A"]'}, "'Site A'"),
    ],
)
def test_a_unit_that_is_not_known_is_told(made: dict, named: str) -> None:
    with pytest.warns(
        UserWarning, match=rf"a\.las: its coordinate system, {named}, gives no unit that is known"
    ):
        np.testing.assert_allclose(parse_las(las(P, **made), "a.las"), P, atol=1e-6)


def test_records_behind_the_points_that_are_cut_off_are_missed() -> None:
    data = las(P, wkt=FEET, behind=True)
    for kept in (-10, -len(FEET) - 20):
        with pytest.raises(ValueError, match=r"a\.las: its header promises 1 records up to byte"):
            parse_las(data[:kept], "a.las")


GEOGCRS = 'GEOGCRS["WGS 84",DATUM["W",ELLIPSOID["W",6378137,298.25,LENGTHUNIT["metre",1]]],CS[ellipsoidal,2]]'


@pytest.mark.parametrize(
    "made",
    [
        {"keys": {1024: 2}},
        {"keys": {2048: 4326}},
        {"wkt": GEOGCS},
        {"wkt": GEOGCRS},
        {"wkt": GEOGCRS.replace("GEOG", "GEOD")},
    ],
)
def test_degrees_are_refused_where_they_are_degrees(made: dict) -> None:
    with pytest.raises(ValueError, match=r"a\.las: .*longitude and latitude.*project"):
        parse_las(las(P / [1e5, 1e5, 1] + [7, 50, 100], **made), "a.las")
    # A wrong system on projected coordinates is common.
    with pytest.warns(UserWarning, match="says longitude and latitude, its x and y cannot be"):
        np.testing.assert_allclose(parse_las(las(P + 100, **made), "a.las"), P + 100, atol=1e-6)


def test_objects_of_laspy_tell_their_unit_too() -> None:
    from hybridreg import PointCloud

    for made in ({"keys": {1024: 1, 3076: 9002}}, {"wkt": local('"foot",0.3048'), "behind": True}):
        record = laspy.read(io.BytesIO(las(P, **made)))
        with pytest.warns(UserWarning, match=r"cloud: its own header says that its unit is 0\.3048 m"):
            np.testing.assert_allclose(PointCloud.of(record).points, P * 0.3048, atol=1e-6)


def test_an_object_whose_records_behind_the_points_were_not_read_says_so() -> None:
    from hybridreg import PointCloud

    with laspy.open(io.BytesIO(las(P, wkt=FEET, behind=True)), read_evlrs=False) as reader:
        record = laspy.LasData(reader.header, reader.read_points(len(P)))
    with pytest.warns(UserWarning, match="1 records behind its points were not read.*laspy.read"):
        np.testing.assert_allclose(PointCloud.of(record).points, P, atol=1e-6)


def mercator(method: str, *parameters: str, esri: bool = False) -> str:
    given = "".join(f",PARAMETER[{each}]" for each in parameters)
    if esri:
        return f'PROJCS["m",{GEOGCS},PROJECTION["{method}"]{given},UNIT["Meter",1.0]]'
    base = 'BASEGEOGCRS["b",DATUM["d",ELLIPSOID["e",6378137,298.25,LENGTHUNIT["metre",1]]]]'
    return (
        f'PROJCRS["m",{base},CONVERSION["c",METHOD["{method}"]{given}],CS[Cartesian,2],LENGTHUNIT["metre",1]]'
    )


WEB = "Popular Visualisation Pseudo Mercator"
STUTTGART = np.array([1.02e6, 6.23e6, 300.0])  # in EPSG:3857, as public airborne clouds are served


@pytest.mark.parametrize(
    "made",
    [
        {"keys": {1024: 1, 3072: 3857}},
        {"keys": {1024: 1, 3072: 3395, 3076: 9001}},
        {"wkt": mercator("Mercator_Auxiliary_Sphere", '"Standard_Parallel_1",0.0', esri=True)},
        {"wkt": mercator("Mercator_1SP", '"central_meridian",0', '"scale_factor",1', esri=True)},
        {"wkt": mercator(WEB, '"Latitude of natural origin",0')},
        {"wkt": mercator("Mercator (variant A)", '"Scale factor at natural origin",1'), "behind": True},
    ],
)
def test_the_stretch_of_mercators_map_is_told(made: dict) -> None:
    # By half as much again at this latitude; x and y were taken for metres without a word.
    with pytest.warns(
        UserWarning, match=r"a\.las: .* Mercator's.* stretches x and y by 1\.516 there.*project"
    ):
        points = parse_las(las(P + STUTTGART, **made), "a.las")
    np.testing.assert_allclose(points, P + STUTTGART, atol=1e-6)


@pytest.mark.parametrize(
    "made",
    [
        {"keys": {1024: 1, 3072: 25832}},
        {"wkt": mercator("Transverse_Mercator", '"scale_factor",1', esri=True)},
        {"wkt": mercator("Hotine_Oblique_Mercator_Azimuth_Center", '"scale_factor",1', esri=True)},
        {"wkt": mercator("Mercator_2SP", '"standard_parallel_1",42', esri=True)},
        {"wkt": mercator("Mercator (variant A)", '"Scale factor at natural origin",0.997')},
    ],
)
@pytest.mark.filterwarnings("error")
def test_other_projections_called_after_mercator_are_metres(made: dict) -> None:
    parse_las(las(P + STUTTGART, **made), "a.las")
    near = {"keys": {1024: 1, 3072: 3857}}  # at the equator, or moved to an origin of its own
    np.testing.assert_allclose(parse_las(las(P, **near), "a.las"), P, atol=1e-6)
