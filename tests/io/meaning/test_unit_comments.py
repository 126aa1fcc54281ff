# SPDX-License-Identifier: MIT
"""Units and scales in words: what is clear is applied, what may be meant is told, and prose changes nothing."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from hybridreg.io.formats.ply import parse_ply
from hybridreg.io.formats.text import parse_text
from hybridreg.io.meaning.unit_words import known_metres

TWO = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


def text(comment: str) -> np.ndarray:
    return parse_text(f"# {comment}\n1 2 3\n4 5 6\n".encode(), "a.txt")


@pytest.mark.parametrize(
    "comment, metres",
    [
        *(
            (each, 1e-3)
            for each in (
                "all values in mm", "mm", "in mm", "x y z in millimeter", "Point cloud (mm)", "values: mm",
                "exported in mm", "X Y Z mm", "x, y and z in mm", "vertices [mm]", "Coordinates [mm].", "XYZ: mm",
                "Scan of a gear, in mm, by laser", "exported from CloudCompare in mm", "values in mm; noise 3 mm",
                "1 unit = 1 mm", "unit is 1e-3 m", "coordinates in 10^-3 m", "number of points: 12, lengths in mm",
            )
        ),
        *(
            (each, 1e-4)
            for each in (
                "unit: 0.1 mm", "units = 1/10 mm", "coordinates in units of 0.1 mm", "values (0.1 mm)",
                "measured in tenths of a millimetre", "coordinates in 1/10 mm",
            )
        ),
        ("points are in cm", 1e-2),
        ("Point cloud, all in inches", 0.0254),
        ("data saved in feet", 0.3048),
    ],
)  # fmt: skip
def test_a_unit_in_other_words_is_believed_and_told(comment: str, metres: float) -> None:
    with pytest.warns(
        UserWarning, match=rf"a\.txt: its own header says that its unit is {metres:g} m"
    ) as told:
        np.testing.assert_allclose(text(comment), TWO * metres)
    assert len(told) == 1


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "comment",
    [
        "60 mm lens", "lens: 60 mm", "point spacing in mm: 5", "mean point distance: 5 mm", "accuracy (mm)",
        "scanned with 2 mm resolution", "scanned at mm accuracy", "points in 10 mm radius", "points in 0.1 mm voxels",
        "exported in 2020 in Rome", "data in ASCII", "Author: MM", "Model: MM", "file bunny_mm.ply", "mm-wave radar",
        "in", "foot", "yard", "scan: foot", "m", "units: m", "1 unit = 1 m", "wall thickness (mm)", "UNIT 7 MM",
        "rms (mm): 0.2",
        "intensity values: mm", "beam divergence in mrad, beam diameter (mm)", "positions in frame lidar",
        "angles in deg",
        "intensity units: counts", "values: counts", "unit count 12", "scale 1", "scale: 1 1 1", "display scale 0.5",
        "colour scale 0 255", "scale 1:500", "full scale 5g",
        "scaled 50%", "gaussian scale 0.3", "time offset: 0.3", "timestamp offset 1 2 3", "offset 0 0 0", "offset: 5",
        "recorded in Ft. Worth", "All scans in Mi Casa", "data in MI State Park",
        "scale factor x y z:         0.001 0.001 0.001", "offset x y z:     500000 4000000 0",  # las2txt, scaled
    ],
)  # fmt: skip
def test_prose_changes_nothing_and_alarms_nobody(comment: str) -> None:
    np.testing.assert_array_equal(text(comment), TWO)


@pytest.mark.parametrize(
    "comment, words",
    [
        ("Bunny (mm)", "Bunny (mm)"),
        ("made by hand, in cm", "if they are in cm, write so in a comment of its own, unit: cm"),
        ("scale 0.001", "'scale 0.001', which was not applied"),
        ("scale factor 0.001", "'scale factor 0.001'"),
        ("scale (0.001, 0.001, 0.001)", "'scale (0.001, 0.001, 0.001'"),
        ("x_scale = 1e-3", "'x_scale = 1e-3'"),
        ("multiply by 0.001 to get metres", "'multiply by 0.001'"),
        ("divide x, y and z by 1000", "'divide x, y and z by 1000'"),
        ("quantization: 0.001", "'quantization: 0.001'"),
        ("global shift 400000 5000000 0", "are to be shifted by that"),
        ("offset: -1,2,3", "'offset: -1,2,3'"),
        ("GlobalShift: -500000 -5400000 0", "Shift: -500000 -5400000 0"),
        ("local origin (500000, 5400000, 0)", "local origin (500000, 5400000, 0"),
        ("global shift = [500000.0, 5400000.0, 0.0]", "shift = [500000.0, 5400000.0, 0.0"),
    ],
)
def test_what_may_be_meant_of_the_coordinates_is_told(comment: str, words: str) -> None:
    with pytest.warns(UserWarning, match=r"a\.txt: its header says ") as told:
        np.testing.assert_array_equal(text(comment), TWO)
    assert len(told) == 1
    assert words in str(told[0].message)


@pytest.mark.parametrize(
    "comment, metres", [("vertices in mm", 1e-3), ("mm", 1e-3), ("Scanned in inches", 0.0254)]
)
def test_comments_of_ply(comment: str, metres: float) -> None:
    axes = "property int x\nproperty int y\nproperty int z\n"
    head = f"ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 2\n{axes}end_header\n1 2 3\n4 5 6\n"
    with pytest.warns(UserWarning, match=r"its own header says"):
        np.testing.assert_allclose(parse_ply(head.encode(), "a.ply"), TWO * metres)


@pytest.mark.parametrize(
    "unit, metres",
    [
        ("1/10 mm", 1e-4), ("0.1mm", 1e-4), ("1e-3 m", 1e-3), ("mm/10", 1e-4), ("m*1e-3", 1e-3), ("10^-3 m", 1e-3),
        ("yd", 0.9144), ("mil", 2.54e-5), ("thou", 2.54e-5), ("microns", 1e-6), ("1/16 in", 0.0254 / 16),
        ("100 ft", 30.48),
        ("0 mm", None), ("1/0 mm", None), ("1e999 m", None), ("local", None), ("32N", None), ("2", None),
        ("10^999 m", None),
    ],
)  # fmt: skip
@pytest.mark.parametrize("mark", [",", " "])
def test_multiples_behind_the_name_of_a_column(unit: str, metres: float | None, mark: str) -> None:
    assert known_metres(unit) == (None if metres is None else pytest.approx(metres))
    head = mark.join(f"{axis} [{unit}]" for axis in "xyz")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        points = parse_text(f"{head}\n1{mark}2{mark}3\n4{mark}5{mark}6\n".encode(), "a.csv")
    np.testing.assert_allclose(points, TWO * (metres or 1.0))


@pytest.mark.parametrize(
    "comment", ["unit: voxels", "units = pixels", "coordinate units are cells", "all units: LSB"]
)
def test_cells_in_a_comment_are_no_length(comment: str) -> None:
    with pytest.warns(UserWarning, match=r"a\.txt: its x, y and z are in '\w+', which is no length"):
        np.testing.assert_array_equal(text(comment), TWO)


def test_cells_are_no_length() -> None:
    with pytest.warns(UserWarning, match=r"a\.csv: its x, y and z are in 'voxels', which is no length"):
        np.testing.assert_array_equal(
            parse_text(b"x [voxels],y [voxels],z [voxels]\n1,2,3\n4,5,6\n", "a.csv"), TWO
        )


@pytest.mark.filterwarnings("error")
def test_metres_in_the_names_are_believed_against_a_comment() -> None:
    np.testing.assert_array_equal(parse_text(b"# a bolt (mm)\nx_m,y_m,z_m\n1,2,3\n4,5,6\n", "a.csv"), TWO)


def test_endless_comments_take_no_time() -> None:
    for part in (":", "values ", "scale ", "( ", "in ", "x y "):
        text(part * 20_000)


@pytest.mark.parametrize(
    "head, mark, end",
    [
        ("x,y,z\nmm,mm,mm", ",", ""), ("X;Y;Z\n[mm];[mm];[mm]", ";", ""), ("x y z i\n(mm) (mm) (mm) -", " ", " 7"),
        ("x,y,z,unit", ",", ",mm"), ('x,y,z,Units', ",", ', "mm"'), ("Easting,Northing,Height\nmm,mm,mm", ",", ""),
    ],
)  # fmt: skip
def test_a_row_or_a_column_of_units(head: str, mark: str, end: str) -> None:
    # The row was said to be damaged: without it, the numbers were metres.
    rows = np.random.default_rng(0).integers(-9000, 9000, (40, 3))
    lines = "\n".join(mark.join(f"{each}.5" for each in row) + end for row in rows)
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m; it was read in metres"):
        found = parse_text(f"{head}\n{lines}\n".encode(), "a.csv")
    expected = np.sign(rows) * (np.abs(rows) + 0.5) / 1000 + 0.001 * (rows == 0) * 0.5
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    "units, message", [("deg,deg,m", "'deg'"), ("m,m,ft", "differ: m, m, ft"), ("rad,rad,rad", "'rad'")]
)
def test_rows_of_units_that_cannot_be(units: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_text(f"x,y,z\n{units}\n".encode() + b"1,2,3\n" * 30, "a.csv")
