# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hybridreg.io.formats.text import parse_text

THREE = np.array([[1.5, 2.0, 3.0], [-4.0, 5.25, 6e3], [7.0, 8.0, -9.0]])

ACCEPTED = {
    "spaces": "1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "aligned spaces": "  1.5   2  3\n -4.0 5.25 6e3 \n  7   8 -9",
    "tabs": "1.5\t2\t3\n-4\t5.25\t6e3\n7\t8\t-9\n",
    "commas": "1.5,2,3\n-4,5.25,6e3\n7,8,-9\n",
    "commas and spaces": "1.5, 2, 3\n-4, 5.25, 6e3\n7, 8, -9\n",
    "semicolons": "1.5;2;3\n-4;5.25;6e3\n7;8;-9\n",
    "decimal commas": "1,5;2;3\n-4;5,25;6e3\n7;8;-9\n",
    "Windows lines": "1.5 2 3\r\n-4 5.25 6e3\r\n7 8 -9\r\n",
    "blank lines": "\n1.5 2 3\n\n-4 5.25 6e3\n   \n7 8 -9\n\n",
    "comments": "# made by hand\n% and\n// more\n1.5 2 3\n# amid\n-4 5.25 6e3\n7 8 -9\n",
    "more columns": "1.5 2 3 255 0.5\n-4 5.25 6e3 254 0.5\n7 8 -9 0 0.5\n",
    "labels": "1.5 2 3 car\n-4 5.25 6e3 road\n7 8 -9 a b c\n",
    "names": "x,y,z,intensity\n1.5,2,3,9\n-4,5.25,6e3,9\n7,8,-9,9\n",
    "names elsewhere": "time,Z,X,Y\n0,3,1.5,2\n0,6e3,-4,5.25\n0,-9,7,8\n",
    "quoted names": '"x","y","z"\n1.5,2,3\n-4,5.25,6e3\n7,8,-9\n',
    "quoted values": '"1.5","2","3"\n"-4","5.25","6e3"\n"7","8","-9"\n',
    "names with units": "id;x [m];y [m];z [m]\n0;1,5;2;3\n0;-4;5,25;6e3\n0;7;8;-9\n",
    "spaced names with units": "x [m] y [m] z [m]\n1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "commented names": "//X Y Z R G B\n1.5 2 3 1 1 1\n-4 5.25 6e3 1 1 1\n7 8 -9 1 1 1\n",
    "commented names elsewhere": "# scan 4\n# z,x,y\n3,1.5,2\n6e3,-4,5.25\n-9,7,8\n",
    "a comment after the names": "# z,x,y\n# units: m\n# exported by hand\n#\n3,1.5,2\n6e3,-4,5.25\n-9,7,8\n",
    "a title before the names": "# columns: id z x y\n0 3 1.5 2\n0 6e3 -4 5.25\n0 -9 7 8\n",
    "a title without a space": "#Format: i x y z\n# points: 3\n5 1.5 2 3\n5 -4 5.25 6e3\n5 7 8 -9\n",
    "names of tools in a comment": "# t,point_x,point_y,point_z\n0,1.5,2,3\n0,-4,5.25,6e3\n0,7,8,-9\n",
    "names with commas, numbers with spaces": "# t, z, y, x\n0 3 2 1.5\n0 6e3 5.25 -4\n0 -9 8 7\n",
    "prose with the names of axes": "# z is up and x east, y north\n1.5 2 3 9\n-4 5.25 6e3 9\n7 8 -9 9\n",
    "count first": "3\n1.5 2 3 9\n-4 5.25 6e3 9\n7 8 -9 9\n",
    "blocks with counts": "1\n1.5 2 3\n2\n-4 5.25 6e3\n7 8 -9\n",
    "blocks with counts and commas": "1\n1.5,2,3\n1\n-4,5.25,6e3\n1\n7,8,-9\n",
    "Excel's separator": "sep=;\nx;y;z\n1,5;2;3\n-4;5,25;6e3\n7;8;-9\n",
    "byte order mark": "\ufeff1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
    "foreign letters": "# Straße 9, données\n1.5 2 3\n-4 5.25 6e3\n7 8 -9\n",
}


@pytest.mark.parametrize("style", ACCEPTED)
def test_styles_of_text(style):
    points = parse_text(ACCEPTED[style].encode(), "a.txt")
    np.testing.assert_array_equal(points, THREE)


def test_latin_1_comment():
    np.testing.assert_array_equal(parse_text("# Straße\n1 2 3\n".encode("latin-1"), "a.txt"), [[1, 2, 3]])


clouds = hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(width=64))


@settings(max_examples=50, deadline=None)
@given(clouds, st.sampled_from([" ", "\t", ",", ";"]))
def test_every_double_survives(cloud, delimiter):
    text = "\n".join(delimiter.join(repr(value) for value in row) for row in cloud.tolist())
    np.testing.assert_array_equal(parse_text(text.encode(), "a.txt"), cloud)


REFUSED = {
    "row 2 has 'two' where": "1 2 3\n1 two 3\n1 2 3\n",
    "row 2 has '2:' where": "1,2,3\n1,2:,3\n1,2,3\n",
    "row 3 has 2 values, 3 are needed: '7 8'": "1 2 3\n4 5 6\n7 8\n",
    "0 fields called 'x' among 'east, north, up'": "east,north,up\n1,2,3\n",
    "2 fields called 'x'": "x,x,y,z\n1,2,3,4\n",
    "promises '4' points, 3 rows follow": "4\n1 2 3\n1 2 3\n1 2 3\n",
    "row 3 promises '2' points, 1 rows follow": "1\n1 2 3\n2\n1 2 3\n",
    "is a PTX scan": "9\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    + "1 2 3 0.5\n" * 9,
    "2 lines and none of numbers": "# nothing\n# here\n",
    "0 lines": "\n \n",
    "zero bytes": "\ufeff1 2 3\n".encode("utf-16-le"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused_text(message):
    content = REFUSED[message]
    with pytest.raises(ValueError, match=r"a\.txt: ") as caught:
        parse_text(content if isinstance(content, bytes) else content.encode(), "a.txt")
    assert message in str(caught.value)


def test_names_without_rows_are_an_empty_cloud():
    assert parse_text(b"x,y,z\n", "a.csv").shape == (0, 3)


UNITS = {
    "X (mm)": "TIMESTAMP (ns), X (mm), Y (mm), Z (mm)\n1,1500,2000,3000\n2,-4000,5250,6e6\n3,7000,8000,-9000\n",
    "x[cm]": "x[cm] y[cm] z[cm]\n150 200 300\n-400 525 6e5\n700 800 -900\n",
    "x [cm], spaced": "x [cm] y [cm] z [cm]\n150 200 300\n-400 525 6e5\n700 800 -900\n",
    "x_mm": "id;x_mm;y_mm;z_mm\n9;1500;2000;3000\n8;-4000;5250;6e6\n7;7000;8000;-9000\n",
    "first returns": "RANGE1 (mm),X1 (mm),Y1 (mm),Z1 (mm)\n1,1500,2000,3000\n1,-4000,5250,6e6\n1,7000,8000,-9000\n",
    "x/mm": "x/mm,y/mm,z/mm\n1500,2000,3000\n-4000,5250,6e6\n7000,8000,-9000\n",
    "commented": "# scan 4\n# x(mm) y(mm) z(mm)\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "one unit for all": "# x y z (mm)\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "commented x_mm": "# x_mm y_mm z_mm\n# 3 points\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "first returns too": "# T,X1 (mm), Y1 (mm), Z1 (mm)\n1,1500,2000,3000\n1,-4000,5250,6e6\n1,7000,8000,-9000\n",
    "unit: mm": "# unit: mm\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "length_unit": "# length_unit: mm\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "coordinates in mm": "# all coordinates in mm\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "given in millimetres": "# Coordinates given in millimetres.\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "[mm]": "# [mm]\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n",
    "LOCAL_CS": '# LOCAL_CS["L (mm)",UNIT["millimetre",0.001]]\n1500 2000 3000\n-4000 5250 6e6\n7000 8000 -9000\n',
    "units are centimetres": "// Units are centimetres\n150 200 300\n-400 525 6e5\n700 800 -900\n",
}


@pytest.mark.parametrize("style", UNITS)
def test_a_unit_in_the_header_is_believed_and_told(style):
    with pytest.warns(UserWarning, match=r"a\.csv: its own header says that its unit is 0\.0"):
        points = parse_text(UNITS[style].encode(), "a.csv")
    np.testing.assert_allclose(points, THREE)


US = 1200 / 3937


@pytest.mark.parametrize(
    "feet, metres",
    [
        *(("ft", 0.3048), ("feet", 0.3048), ("Intl. ft", 0.3048), ("international feet", 0.3048)),
        *(
            (each, US)
            for each in ("US survey feet", "U.S. Survey Feet", "US ft", "us-ft", "usft", "ftUS", "US_ft")
        ),
    ],
)
def test_feet(feet, metres):
    with pytest.warns(UserWarning, match=r"0\.3048"):
        points = parse_text(f"x ({feet}),y ({feet}),z ({feet})\n1,2,3\n4,5,6\n".encode(), "a.csv")
    np.testing.assert_allclose(points, np.array([[1, 2, 3], [4, 5, 6]]) * metres)


def test_feet_and_inches_in_a_comment():
    for comment, metres in (
        ("Units: US survey feet", US),
        ("coordinates in U.S. survey feet", US),
        ("unit: us-ft", US),
        ("unit = US ft", US),
        ("unit: inch", 0.0254),
        ("unit: in", 0.0254),
    ):
        with pytest.warns(UserWarning, match="its unit is 0"):
            points = parse_text(f"# {comment}\n1 2 3\n4 5 6\n".encode(), "a.txt")
        np.testing.assert_allclose(points, np.array([[1, 2, 3], [4, 5, 6]]) * metres)


def test_feet_behind_the_name_of_a_column():
    with pytest.warns(UserWarning, match=r"its unit is 0\.304801 m"):
        points = parse_text(b"x_usft,y_usft,z_usft\n1,2,3\n4,5,6\n", "a.csv")
    np.testing.assert_allclose(points, np.array([[1, 2, 3], [4, 5, 6]]) * US)


def test_heights_have_the_unit_that_their_own_system_gives():
    across, up = 'LOCAL_CS["L",UNIT["foot",0.3048]]', 'VERT_CS["h",VERT_DATUM["h",2005],UNIT["metre",1]]'
    with pytest.warns(UserWarning, match=r"its unit is 0\.3048 m across and 1 m up"):
        points = parse_text(f'# COMPD_CS["c",{across},{up}]\n1 2 3\n4 5 6\n'.encode(), "a.txt")
    np.testing.assert_allclose(points, np.array([[1, 2, 3], [4, 5, 6]]) * [0.3048, 0.3048, 1.0])


def test_a_scale_is_told():
    with pytest.warns(UserWarning, match=r"a\.txt: its header says 'scale: 0\.001', which was not applied"):
        np.testing.assert_array_equal(parse_text(b"# scale: 0.001\n1 2 3\n", "a.txt"), [[1, 2, 3]])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "comment",
    [
        "angle_unit: deg",
        "range unit: mm",
        "unit 7",
        "scale: 1.0",
        'PROJCS["U",GEOGCS["W",UNIT["degree",0.0]],UNIT["metre",1]]',
    ],
)
def test_comments_that_give_no_other_unit(comment):
    np.testing.assert_array_equal(parse_text(f"# {comment}\n1 2 3\n".encode(), "a.txt"), [[1, 2, 3]])


HEADS = {
    "ParaView": "intensity,Points:0,Points:1,Points:2\n9,1.5,2,3\n9,-4,5.25,6e3\n9,7,8,-9\n",
    "VeloView": "Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2,id\n1.5,2,3,1\n-4,5.25,6e3,1\n7,8,-9,1\n",
    "Livox": "Version,X,Y,Z,Ori_x,Ori_y,Ori_z\n5,1.5,2,3,0,0,0\n5,-4,5.25,6e3,0,0,0\n5,7,8,-9,0,0,0\n",
    "an index without a name": ",x,y,z\n0,1.5,2,3\n1,-4,5.25,6e3\n2,7,8,-9\n",
    "normals too": "nx,ny,nz,x,y,z\n0,0,1,1.5,2,3\n0,0,1,-4,5.25,6e3\n0,0,1,7,8,-9\n",
    "x_coord": "x_coord\ty_coord\tz_coord\n1.5\t2\t3\n-4\t5.25\t6e3\n7\t8\t-9\n",
    "an unknown unit": "x (local),y (local),z (local)\n1.5,2,3\n-4,5.25,6e3\n7,8,-9\n",
    "decimal commas, tabs": "X\tY\tZ\n1,5\t2\t3\n-4\t5,25\t6e3\n7\t8,0\t-9\n",
    "decimal commas, spaces": "1,5 2,0 3\n-4,0 5,25 6e3\n7 8,0 -9,0\n",
}


@pytest.mark.parametrize("style", HEADS)
def test_heads_of_tools(style):
    np.testing.assert_array_equal(parse_text(HEADS[style].encode(), "a.csv"), THREE)


REFUSED_HEADS = {
    "in 'deg'": "x (deg),y (deg),z (m)\n1,2,3\n",
    "is 'degrees'": "# units: degrees\n7.1 50.7 100\n",
    "is 'degree'": '# GEOGCS["WGS 84",UNIT["degree",0.0174]]\n7.1 50.7 100\n',
    "differ: mm, mm, m": "x (mm),y (mm),z (m)\n1,2,3\n",
    "longitudes and latitudes": "lon,lat,h\n7.1,50.7,100\n",
    "several columns that could be": "pos_x,pos_y,pos_z,lidar_x,lidar_y,lidar_z\n1,2,3,4,5,6\n",
    "grid of heights": "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 5 6\n",
    "25 x 64 numbers are an image": ("1.5 " * 64 + "\n") * 25,
    "is a row number": "".join(f"{k} 1.5 2.5 {k * k}\n" for k in range(30)),
}


@pytest.mark.parametrize("message", REFUSED_HEADS)
def test_refused_heads(message):
    with pytest.raises(ValueError, match=r"a\.txt: ") as caught:
        parse_text(REFUSED_HEADS[message].encode(), "a.txt")
    assert message in str(caught.value)


ROWS = "1.5,2,3\n4,5,6\n7,8,9\n"
FIRST_ROWS = {
    "its first row holds no numbers, so that it was read as the names of the columns: it has 0 fields called 'x' among "
    "'Rechtswert, Hochwert, Höhe'; name the coordinates": f"Rechtswert,Hochwert,Höhe\n{ROWS}",
    "read as the names of the columns: it has 0 fields called 'x' among 'A, N, D'": f"A,N,D\n{ROWS}",
    "its first 3000 rows hold no points, from 'key0: value' on; begin those that are comments with #": "".join(
        f"key{k}: value\n" for k in range(3000)
    )
    + ROWS,
    "its first row, '! Leica', is no comment; begin comments with #": f"! Leica\n{ROWS}",
    'its first row, "\' Trimble", is no comment': f"' Trimble\n{ROWS}",
    "its numbers are separated by ':': '1:2:3'": "1:2:3\n" * 30,
    "its numbers are separated by '|': '1.5|2|3'; separate them by": ROWS.replace(",", "|"),
    "its numbers are separated by '|': '1.5|2|3'; separate them": "x|y|z\n" + ROWS.replace(",", "|"),
    "its numbers have separators of thousands: \"450'002.74;5'399'995.40;299.39\"; export them without": (
        "450'002.74;5'399'995.40;299.39\n" * 30
    ),
    "its numbers have separators of thousands: '450.002.74;5.399.995.40;299.39'": "450.002,74;5.399.995,40;299,39\n"
    * 30,
    'have separators of thousands: \'"450,002.74","5,399,995.40","299.39"\'': (
        '"450,002.74","5,399,995.40","299.39"\n' * 30
    ),
    "have a D before their exponents: '2.8D+01 1.0D+00 0.5D+00'; write an E": "2.8D+01 1.0D+00 0.5D+00\n"
    * 30,
}


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("message", FIRST_ROWS)
def test_a_first_row_without_numbers_is_named_as_the_cause(message, encoding):
    with pytest.raises(ValueError, match=r"a\.txt: ") as caught:
        parse_text(FIRST_ROWS[message].encode(encoding), "a.txt")
    assert message in str(caught.value)


SURVEYED = {
    "Easting,Northing,Height": "Easting,Northing,Height\n1,2,3\n4,5,6\n",
    "northing first, other columns": "ID;Northing;Easting;Elevation;Code\n9;2;1;3;7\n8;5;4;6;7\n",
    "E N H in a comment": "# E N H\n1 2 3\n4 5 6\n",
    "E, N and z": "point,E,N,Z\nA,1,2,3\nB,4,5,6\n",
    "X_UTM": "X_UTM,Y_UTM,Elevation,lat,lon\n1,2,3,50,7\n4,5,6,50,7\n",
}


@pytest.mark.parametrize("style", SURVEYED)
def test_names_of_surveyors_are_x_y_and_z(style):
    points = parse_text(SURVEYED[style].encode(), "a.csv")
    np.testing.assert_array_equal(points, [[1, 2, 3], [4, 5, 6]])


def test_feet_of_surveyors_become_metres():
    with pytest.warns(UserWarning, match=r"its unit is 0\.3048 m"):
        points = parse_text(b"Easting (ft),Northing (ft),Elevation (ft)\n1,2,3\n4,5,6\n", "a.csv")
    np.testing.assert_allclose(points, np.array([[1, 2, 3], [4, 5, 6]]) * 0.3048)


AMBIGUOUS = {
    "two heights": ("Easting,Northing,Height,Elevation", "0 fields called 'x'"),
    "two eastings": ("E,Easting,N,H", "0 fields called 'x'"),
    "no height": ("Easting,Northing,Code,Id", "0 fields called 'x'"),
    "a depth, whose sign is open": ("Easting,Northing,Depth,Id", "'Depth' may count downwards"),
    "a box, not a height": ("x,y,width,height", "0 fields called 'z'"),
    "heights in feet on metres": ("Easting (m),Northing (m),Height (ft),Id", "differ: m, m, ft"),
    "a sensor's own frame beside": ("E,N,H,lidar_x,lidar_y,lidar_z", "several columns that could be"),
}


@pytest.mark.parametrize("style", AMBIGUOUS)
def test_names_of_surveyors_that_have_two_meanings_are_told(style):
    names, message = AMBIGUOUS[style]
    rows = (",".join(str(k) for k in range(names.count(",") + 1)) + "\n") * 30
    with pytest.raises(ValueError, match=r"a\.csv: ") as caught:
        parse_text(f"{names}\n{rows}".encode(), "a.csv")
    assert message in str(caught.value)


def test_x_y_and_z_go_before_names_of_surveyors():
    text = b"x,y,z,Easting,Northing,Height\n1,2,3,7,8,9\n4,5,6,7,8,9\n"
    np.testing.assert_array_equal(parse_text(text, "a.csv"), [[1, 2, 3], [4, 5, 6]])


def test_a_range_first_is_refused_and_a_ring_first_is_told():
    points = np.random.default_rng(0).normal(size=(60, 3)) * [9, 9, 1]
    ranges = np.linalg.norm(points, axis=1)
    with pytest.raises(ValueError, match=r"a\.csv: .*length of the next three.*id x y z"):
        parse_text(
            "".join(f"{r},{x},{y},{z}\n" for r, (x, y, z) in zip(ranges, points, strict=True)).encode(),
            "a.csv",
        )
    rows = "".join(f"{k % 16};{x};{y};{z};car\n" for k, (x, y, z) in enumerate(points))
    with pytest.warns(UserWarning, match=r"a\.csv: .*16 whole numbers, like a ring.*id x y z"):
        parse_text(rows.encode(), "a.csv")
    named = parse_text(f"id;x;y;z;kind\n{rows}".encode(), "a.csv")
    np.testing.assert_array_equal(named, points)


def test_a_raw_las_record_saved_as_text_is_refused() -> None:
    # As pandas writes a table of laspy's `points.array`: whole numbers, not scaled yet.
    rows = "X,Y,Z,intensity,point_source_id\n" + "".join(f"{k},{2 * k},{k % 7},0,1\n" for k in range(30))
    with pytest.raises(ValueError, match=r"raw LAS record .*laspy\.read"):
        parse_text(rows.encode(), "a.csv")
    assert len(parse_text(rows.replace("\n3,", "\n3.25,").encode(), "a.csv")) == 30
