# SPDX-License-Identifier: MIT
"""Damaged files of every format give points or a ValueError, never anything else."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.io.point_files import PARSERS, parse_points

NAMES = [
    "binary_little_endian.ply", "binary_big_endian.ply", "faces_first.ply", "ascii.ply",
    "ascii.pcd", "binary.pcd", "compressed.pcd",
    "plain.npy", "fortran.npy", "fields.npy", "plain.npz", "deflated.npz", "unnamed.npz",
    "plain.xyz", "commented.txt", "named.csv", "kitti.bin", "nuscenes.pcd.bin", "plain.las", "packed.laz",
]  # fmt: skip


def test_list_is_complete(samples):
    assert set(samples) <= set(NAMES)


def check(data: bytes, name: str) -> None:
    points, message = np.empty((0, 3)), f"{name}: fine; nothing to do"
    try:
        points = parse_points(data, name)
    except ValueError as error:
        message = str(error)
    assert points.dtype == np.float64
    assert points.ndim == 2
    assert points.shape[1] == 3
    assert message.startswith(name)
    assert "; " in message
    assert len(message) < 700


@st.composite
def damages(draw):
    """A cut, and some bytes replaced, most of them near the beginning, where the headers are."""
    place = st.one_of(st.integers(0, 300), st.integers(0, 4000), st.integers(-200, -1))
    flips = draw(st.lists(st.tuples(place, st.integers(0, 255)), max_size=4))
    return draw(st.one_of(st.none(), st.integers(0, 4000), st.integers(-100, -1))), flips


def damaged(data: bytes, damage) -> bytes:
    cut, flips = damage
    content = bytearray(data[:cut])
    for place, value in flips:
        if content:
            content[place % len(content)] = value
    return bytes(content)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30, deadline=None)
@given(damage=damages())
def test_damaged_file(samples, name, damage):
    if name not in samples:
        pytest.skip("needs laspy")
    check(damaged(samples[name], damage), name)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", NAMES)
def test_every_truncation_of_the_header(samples, name):
    if name not in samples:
        pytest.skip("needs laspy")
    for length in range(0, 400, 3):
        check(samples[name][:length], name)


numbers = st.one_of(st.integers(-(10**20), 10**20), st.sampled_from([0, 1, 2**31, 2**32, 2**63, 10**12]))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "name", [name for name in NAMES if not name.endswith((".bin", ".xyz", ".txt", ".las"))]
)
@settings(max_examples=15, deadline=None)
@given(number=numbers)
def test_any_number_in_place_of_the_count(samples, cloud, name, number):
    if name in samples:
        check(samples[name].replace(str(len(cloud)).encode(), str(number).encode()), name)


ENDINGS = sorted(set(PARSERS) - (set() if find_spec("laspy") else {".las", ".laz"}))


@settings(max_examples=120, deadline=None)
@given(st.binary(max_size=300), st.sampled_from(ENDINGS))
def test_noise(data, ending):
    check(data, f"noise{ending}")


HEADS = [
    b"ply\n",
    b"ply\nformat ascii 1.0\nelement vertex 3\n",
    b"# .PCD v0.7\nFIELDS x y z\n",
    b"\x93NUMPY\x01\0",
    b"LASF",
    b"PK\x03\x04",
]


@settings(max_examples=120, deadline=None)
@given(
    st.sampled_from(HEADS),
    st.binary(max_size=200),
    st.sampled_from([each for each in ENDINGS if each in (".ply", ".pcd", ".npy", ".npz", ".las")]),
)
def test_noise_behind_a_good_beginning(head, data, ending):
    check(head + data, f"noise{ending}")
