# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.io import read_points
from hybridreg.io.formats.bin import parse_bin


def rows(n, width, seed=0):
    rng = np.random.default_rng(seed)
    table = rng.uniform(-60, 60, size=(n, width))
    table[:, 3] = rng.uniform(0, 1, size=n)
    if width == 5:
        table[:, 4] = rng.integers(0, 32, size=n)
    return table.astype("<f4")


@pytest.mark.parametrize("name", ["000000.bin", "sweep.pcd.bin", "SWEEP.PCD.BIN"])
@pytest.mark.parametrize("width", [4, 5])
@pytest.mark.parametrize("n", [41, 43, 60, 100, 400])
def test_values_decide_where_size_and_name_mislead(n, width, name):
    table = rows(n, width)
    np.testing.assert_array_equal(parse_bin(table.tobytes(), name), table[:, :3])


def test_reflectivities_beyond_a_byte_and_a_constant_minus_one():
    for value in (40000.0, -1.0):
        table = rows(41, 4)
        table[:, 3] = value
        np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])


@pytest.mark.parametrize("name, columns", [("a.bin", 4), ("a.pcd.bin", 5)])
def test_name_decides_where_the_values_fit_neither(name, columns):
    table = np.full((20, 4), -1.0, "<f4")
    assert parse_bin(table.tobytes(), name).shape == (320 // (4 * columns), 3)


def test_values_that_fit_both_are_refused_with_the_reason():
    with pytest.raises(ValueError, match=r"320 bytes are 20 rows of 4 or 16 rows of 5 numbers.*npy"):
        parse_bin(bytes(320), "a.bin")


def test_cut_file_names_its_size():
    with pytest.raises(ValueError, match=r"a\.bin: its 641 bytes are no multiple of 12, 16, 20"):
        parse_bin(rows(41, 4).tobytes()[:641], "a.bin")


@pytest.mark.parametrize("width, cut", [(4, 60 * 16 - 20), (5, 60 * 20 - 16), (4, 860)])
def test_file_cut_to_a_size_of_the_other_layout_is_refused(width, cut):
    with pytest.raises(ValueError, match=r"another layout|no multiple"):
        parse_bin(rows(60, width).tobytes()[:cut], "a.bin")


def columns(kind, points):
    rng = np.random.default_rng(5)
    n = len(points)
    ring = (np.arange(n) % 32)[:, None]
    more = {
        "nothing": np.empty((n, 0)),
        "intensity": rng.uniform(0, 1, (n, 1)),
        "no intensity": np.zeros((n, 1)),
        "intensity and ring": np.c_[rng.uniform(0, 255, n), ring],
        "intensity, ring and time": np.c_[rng.uniform(0, 255, n), ring, np.linspace(0, 0.1, n)],
        "colour": rng.integers(0, 256, (n, 3)),
        "normal": points / np.linalg.norm(points, axis=1, keepdims=True),
    }
    return np.c_[points, more[kind]].astype("<f4")


KINDS = [
    "nothing",
    "intensity",
    "no intensity",
    "intensity and ring",
    "intensity, ring and time",
    "colour",
    "normal",
]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n", [60, 180, 1020, 30_000, 30_011])
@pytest.mark.parametrize("where", ["around the sensor", "all positive", "on a map"])
def test_columns_tell_the_width(kind, n, where):
    points = np.random.default_rng(n).normal(size=(n, 3)) * [5, 9, 1.5]
    points += {"around the sensor": [0, 0, -1], "all positive": [25, 45, 9], "on a map": [4321, 987, 120]}[
        where
    ]
    table = columns(kind, points)
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])


@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_file_is_refused_at_every_width(kind):
    table = columns(kind, np.random.default_rng(2).normal(size=(1000, 3)) * [5, 9, 1.5])
    with pytest.raises(ValueError, match="no multiple"):
        parse_bin(table.tobytes()[:-4], "a.bin")


def test_float64_rows_are_refused():
    with pytest.raises(ValueError, match="another layout"):
        parse_bin(rows(41, 4).astype("<f8").tobytes(), "a.bin")


def test_noise_is_refused():
    noise = np.random.default_rng(0).bytes(16 * 101)
    with pytest.raises(ValueError, match=r"% of the points lie beyond 1e\+07 m"):
        parse_bin(noise, "a.bin")


def test_missing_returns_are_kept():
    table = rows(41, 4)
    table[::2, :3] = np.nan
    table[1, 0] = np.inf
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])


@pytest.mark.filterwarnings("error")
def test_signalling_nans_give_no_warning():
    table = rows(60, 4)
    table.view("<u4")[3] = 0x7FA00001
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])


def scan(n):
    rng = np.random.default_rng(4)
    return (rng.normal(size=(n, 3)) * [25, 30, 2] + [40, 60, 9]).astype("<f4")


WIDE = {
    "PCL's PointXYZI": lambda p, u: np.c_[p, 0 * u + 1, u, 0 * u, 0 * u, 0 * u],
    "PCL's PointNormal": lambda p, u: np.c_[
        p, 0 * u + 1, p / np.linalg.norm(p, axis=1)[:, None], 0 * u, u, 0 * p
    ],
    "eight": lambda p, u: np.c_[p, u * 255, np.arange(len(p)) % 64, u, np.linalg.norm(p, axis=1), 0 * u],
    "colours and more": lambda p, u: np.c_[p, u, u**2, u**3, 1 - u, u],
    "seven": lambda p, u: np.c_[p, u, u, u, u],
    "nine": lambda p, u: np.c_[p, np.tile(u, (6, 1)).T],
    "ten": lambda p, u: np.c_[p, u * 255, np.arange(len(p)) % 64, u, u / 2, u / 3, u / 4, u / 5],
}


@pytest.mark.parametrize("kind", WIDE)
def test_wider_rows(kind):
    points = scan(6120)
    table = WIDE[kind](points, np.random.default_rng(5).uniform(0, 1, 6120)).astype("<f4")
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), points)


def test_lasers_that_fire_in_turn_are_no_wider_rows():
    points = scan(6000)
    points[::2, 2] += 30
    table = np.c_[points, np.random.default_rng(5).uniform(0, 1, 6000)].astype("<f4")
    table[1:4000:2, :3] = 0  # second returns that are missing
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])


@pytest.mark.parametrize("more", [0, 1, 2])
def test_channel_after_channel_is_refused_with_a_cure_that_works(more, tmp_path):
    table = np.c_[scan(6000), np.random.default_rng(5).uniform(0, 1, (6000, more))].astype("<f4")
    path = tmp_path / "a.bin"
    path.write_bytes(np.ascontiguousarray(table.T).tobytes())
    with pytest.raises(ValueError, match=r"a\.bin: .* channel after channel.*reshape\(4, -1\)\.T"):
        read_points(path)
    np.save(tmp_path / "a.npy", np.fromfile(path, "float32").reshape(3 + more, -1).T)
    np.testing.assert_array_equal(read_points(tmp_path / "a.npy"), table[:, :3])


def test_real_sweep(real_data, tmp_path):
    with np.load(real_data / "kitti-odo-5-to-0" / "source.npz") as archive:
        xyz, intensity = archive["xyz"], archive["intensity"]
    four = np.hstack([xyz, intensity[:, None]]).astype("<f4")
    five = np.hstack([four, np.arange(len(xyz))[:, None] % 64]).astype("<f4")
    # A multiple of 20 points, so that both sizes fit and the values must decide.
    keep = len(xyz) // 20 * 20
    for name, table in (("a.bin", four), ("b.pcd.bin", five), ("c.bin", five), ("d.pcd.bin", four)):
        for count in (len(xyz), keep):
            (tmp_path / name).write_bytes(table[:count].tobytes())
            np.testing.assert_array_equal(read_points(tmp_path / name), xyz[:count])


@pytest.mark.parametrize("shape", [(1500, 2000, 1), (1333, 1999, 1), (1500, 2000, 3), (480, 640, 1)])
def test_maps_of_colmap_are_no_clouds(shape):
    # By hand, as its documentation has them (Output Format). The size of many pictures is a whole number of points, and
    # their depths were read as x, y and z.
    high, wide, channels = shape
    across, down = np.meshgrid(np.linspace(0, 9, wide), np.linspace(0, 7, high))
    depths = np.broadcast_to(6.0 + 3.0 * np.sin(across) + np.cos(down), (channels, high, wide)).astype("<f4")
    data = f"{wide}&{high}&{channels}&".encode() + depths.tobytes()
    with pytest.raises(ValueError, match=rf"COLMAP \({wide} x {high}\), not a cloud; .*fused\.ply"):
        parse_bin(data, "a.jpg.geometric.bin")


@pytest.mark.parametrize("n", [61, 100, 201, 211])
def test_few_rows_of_seven_numbers_of_a_radar(n):
    # As View-of-Delft has them: x, y, z, cross section, two speeds, the scan. Nothing narrower divides 211 rows.
    rng = np.random.default_rng(n)
    points = rng.normal([25.0, 0.0, 0.0], [10.0, 8.0, 1.5], (n, 3))
    others = np.c_[rng.normal(-10, 12, n), rng.normal(-3, 4, n), rng.normal(0, 0.3, n), np.zeros(n)]
    table = np.c_[points, others].astype("<f4")
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "00123.bin"), table[:, :3])


@pytest.mark.parametrize("unit, kind", [(1e3, "i4"), (1e2, "i4"), (1e4, "u4"), (1e3, "i8"), (1e2, "i2")])
@pytest.mark.parametrize("width", [3, 4])
def test_whole_numbers_are_refused_with_a_cure_that_works(unit, kind, width):
    table = rows(2000, 4)[:, :width].astype(float)
    table[:, :3] *= 0.02 if kind == "i2" else 1.0  # below 128 hundredths
    table[:, :3] -= table[:, :3].min(axis=0) if kind[0] == "u" else 0.0
    whole = (table * unit).round().astype(kind)
    with pytest.raises(ValueError, match="whole ones, not float32; save numpy") as refused:
        parse_bin(whole.tobytes(), "a.bin")
    if kind in ("i4", "i8"):
        assert f"'int{8 * int(kind[1])}'" in str(refused.value)


def test_whole_numbers_of_a_map_are_refused():
    whole = ((rows(2000, 4)[:, :3] + [5e5, 5.4e6, 200.0]) * 100).round().astype("<i4")
    with pytest.raises(ValueError, match="smaller than 1e-06; save numpy"):
        parse_bin(whole.tobytes(), "a.bin")


def test_missing_returns_of_either_sign_and_tiny_coordinates_are_no_whole_numbers():
    table = rows(2000, 4)
    table[:600, :3] = np.nan
    table[:600:2, :3] *= -1.0
    assert parse_bin(table.tobytes(), "a.bin").shape == (2000, 3)
    table = rows(2000, 4)
    table[:, 1] = table[:, 0] * np.float32(6e-17)  # a half turn in single precision
    assert parse_bin(table.tobytes(), "a.bin").shape == (2000, 3)


@pytest.mark.parametrize(
    "kind, start, step", [("f8", 1.7e9, 1e-5), ("u8", 1.7e18, 10**4), ("u8", 1.7e15, 10), ("f8", 1.1e9, 0)]
)
@pytest.mark.parametrize("more", [0, 1, 2])
def test_times_of_eight_bytes_in_front_are_refused_with_a_cure_that_works(kind, start, step, more, tmp_path):
    points = rows(3000, 4 + more)
    table = np.zeros(3000, [("t", f"<{kind}"), ("xyz", "<f4", 3), ("more", "<f4", more)])
    table["t"], table["xyz"] = start + np.arange(3000) * step, points[:, :3]
    table["more"] = points[:, 3 : 3 + more]
    path = tmp_path / "a.bin"
    table.tofile(path)
    with pytest.raises(ValueError, match="begin with a time") as refused:
        read_points(path)
    call = str(refused.value).split("save ")[1].removesuffix(" as .npy")
    np.testing.assert_array_equal(eval(call, {"numpy": np, "path": path}), points[:, :3])


def test_a_wall_is_no_time():
    table = rows(3000, 5)
    table[:, 1] = 27.17  # the upper half of 1.7e9
    np.testing.assert_array_equal(parse_bin(table.tobytes(), "a.bin"), table[:, :3])
