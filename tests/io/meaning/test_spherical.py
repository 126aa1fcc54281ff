# SPDX-License-Identifier: MIT
"""Angles and ranges in the place of x, y and z."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hybridreg import PointCloud
from hybridreg.io.formats.ply import parse_ply
from hybridreg.io.formats.text import parse_text

G = np.random.default_rng(0)
AZIMUTH = G.random(2000) * 360.0
ELEVATION = np.tile(np.linspace(-15.0, 15.0, 16), 125)
RANGE = G.random(2000) * 50.0
SPHERE = np.column_stack([AZIMUTH, ELEVATION, RANGE])
CENTRED = SPHERE - [180.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "names",
    [
        ("azimuth", "elevation", "range"), ("range", "azimuth", "elevation"), ("theta", "phi", "r"),
        ("Azimuth (deg)", "Elevation (deg)", "Distance (m)"), ("az_rad", "el_rad", "range_m"),
        ("sphericalRange", "sphericalAzimuth", "sphericalElevation"), ("dist", "horizontal_angle", "vertical_angle"),
    ],
)  # fmt: skip
def test_columns_of_angles_are_not_told_to_be_called_x(names: tuple[str, ...]) -> None:
    pd = pytest.importorskip("pandas")
    records = np.zeros(60, [(each, "f4") for each in names])
    rows = "\n".join(",".join(f"{each:.4f}" for each in row) for row in SPHERE[:60])
    axes = "".join(f"property float {each}\n" for each in names)
    head = f"ply\nformat ascii 1.0\nelement vertex 60\n{axes}end_header\n"
    for read in (
        lambda: PointCloud.of(records),
        lambda: PointCloud.of(pd.DataFrame(SPHERE, columns=names)),
        lambda: parse_text((",".join(names) + "\n" + rows).encode(), "cloud"),
        lambda: parse_ply((head + rows.replace(",", " ") + "\n").encode(), "cloud"),
    ):
        with pytest.raises(
            ValueError, match=r"^cloud: .*angles and ranges.*convert them to x, y and z"
        ) as caught:
            read()
        assert "name the coordinates" not in str(caught.value)


def converted(names: tuple[str, ...], **values: np.ndarray) -> np.ndarray:
    """x, y and z by the formulas of the message, of angles in radians."""
    with pytest.raises(ValueError, match="convert them to x, y and z: ") as caught:
        PointCloud.of({each: np.zeros(60) for each in names})
    formulas = re.search("x, y and z: (.*?); where", str(caught.value)).group(1).split(", ")
    known = {**values, "cos": np.cos, "sin": np.sin}
    return np.column_stack([eval(each.replace(" ", " * "), known) for each in formulas])


def test_the_cure_gives_the_points_of_either_azimuth() -> None:
    # As pymap3d 3.2.0's enu2aer has them, clockwise from north: the cure was a mirror image of the place.
    place = G.normal(0.0, 10.0, (60, 3))
    flat = np.hypot(place[:, 0], place[:, 1])
    told = {"range": np.linalg.norm(place, axis=1), "elevation": np.arctan2(place[:, 2], flat)}
    from_x = np.arctan2(place[:, 1], place[:, 0])
    from_north = np.arctan2(place[:, 0], place[:, 1])
    names = ("azimuth", "elevation", "range")
    counter = converted(names, azimuth=from_x, **told)
    clockwise = converted(names, azimuth=from_north, **told)[:, [1, 0, 2]]
    np.testing.assert_allclose(counter, place, rtol=0, atol=1e-12)
    np.testing.assert_allclose(clockwise, place, rtol=0, atol=1e-12)
    with pytest.raises(
        ValueError, match="where the azimuth counts clockwise, .* the first two change places"
    ):
        PointCloud.of({each: np.zeros(60) for each in names})


@pytest.mark.parametrize("names", [("rho", "phi", "z"), ("z", "range", "azimuth_deg")])
def test_the_cure_beside_a_height_keeps_it(names: tuple[str, ...]) -> None:
    # As vector 1.9.0's arrays have them; the cure wanted an elevation that is not there.
    place = G.normal(0.0, 10.0, (60, 3))
    flat, angle = np.hypot(place[:, 0], place[:, 1]), np.arctan2(place[:, 1], place[:, 0])
    found = converted(names, azimuth=angle, range=flat, z=place[:, 2])
    np.testing.assert_allclose(found, place, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "rows",
    [
        SPHERE,
        CENTRED,
        np.roll(SPHERE, 1, axis=1),
        SPHERE[:, [1, 0, 2]],
        np.column_stack([np.radians(CENTRED[:, :2]), RANGE]),
        np.column_stack([SPHERE, G.random(2000)]),
        np.column_stack([np.radians(CENTRED[:, 0]), G.uniform(-0.4, 0.3, 2000), RANGE]),  # of no beams
        np.column_stack([RANGE, np.radians(CENTRED[:, 0]), G.uniform(-0.4, 0.3, 2000)]),
    ],
)
def test_angles_without_names_are_told(rows: np.ndarray, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.csv", rows, "%.4f", delimiter=",")
    for x in (rows, tmp_path / "a.csv"):
        with pytest.warns(UserWarning, match=r"look like azimuth, elevation and range; if they are, convert"):
            PointCloud.of(x)


X, Y = np.meshgrid(np.linspace(0.0, 360.0, 361), np.linspace(0.0, 80.0, 41))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "rows",
    [
        np.column_stack([X.ravel(), Y.ravel(), G.random(X.size)]),  # heights on a grid
        SPHERE + [0.0, 0.0, -1.0],
        SPHERE * [0.9, 1.0, 1.0],
        SPHERE + [30.0, 0.0, 0.0],
        SPHERE * [1.0, 10.0, 1.0],
        np.column_stack([AZIMUTH, G.random(2000) * 30, RANGE]),
        np.column_stack([np.radians(CENTRED[:, 0]) * 1.01, G.uniform(-0.4, 0.3, 2000), RANGE]),
        np.column_stack([np.radians(CENTRED[:, 0]), G.uniform(-2.0, 2.0, 2000), RANGE]),
    ],
)
def test_clouds_that_only_resemble_angles_are_read(rows: np.ndarray) -> None:
    np.testing.assert_array_equal(PointCloud.of(rows).points, rows)
