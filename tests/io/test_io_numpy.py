# SPDX-License-Identifier: MIT
from __future__ import annotations

import io
import pickle
import tracemalloc
import zipfile

import numpy as np
import pytest

from hybridreg.io.formats.npy import parse_npy
from hybridreg.io.formats.npz import parse_npz


def npy(array, **options):
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def npz(save=np.savez, **arrays):
    stream = io.BytesIO()
    save(stream, **arrays)
    return stream.getvalue()


def npy_with_header(text, body=b""):
    text = text.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + body


@pytest.mark.parametrize("dtype", ["f2", "f4", "<f8", ">f8", ">f4", "i4", "u2", "i8", "g"])
@pytest.mark.parametrize("width", [3, 4, 7])
def test_types_and_widths(dtype, width):
    array = np.arange(width * 20).reshape(20, width).astype(dtype)
    for version in ("C", "F"):
        points = parse_npy(npy(np.asarray(array, order=version)), "a.npy")
        assert points.dtype == np.float64
        np.testing.assert_array_equal(points, array[:, :3])


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_versions_of_the_format(version, cloud):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, cloud, version=version)
    np.testing.assert_array_equal(parse_npy(stream.getvalue(), "a.npy"), cloud)


def test_structured_rows_in_any_order(utm_cloud):
    rows = np.zeros(len(utm_cloud), [("t", "u4"), ("z", "f8"), ("x", "f8"), ("y", "f8")])
    rows["x"], rows["y"], rows["z"] = utm_cloud.T
    np.testing.assert_array_equal(parse_npy(npy(rows), "a.npy"), utm_cloud)


def test_not_finite_and_empty_are_kept():
    assert np.isnan(parse_npy(npy(np.full((5, 3), np.nan)), "a.npy")).all()
    assert parse_npy(npy(np.empty((0, 4))), "a.npy").shape == (0, 3)


class Bomb:
    """Unpickling it would create the file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_pickles_are_refused_unopened(tmp_path):
    trace = tmp_path / "trace"
    for data in (npy(np.array([Bomb(trace)], dtype=object), allow_pickle=True), pickle.dumps(Bomb(trace))):
        with pytest.raises(ValueError, match=r"a\.npy.*run code.*numpy\.save"):
            parse_npy(data, "a.npy")
    with pytest.raises(ValueError, match=r"'xyz'.*run code"):
        parse_npz(npz(xyz=np.array([Bomb(trace)], dtype=object)), "a.npz")
    assert not trace.exists()


@pytest.mark.parametrize(
    "array, message",
    [
        (np.zeros(30), r"got \(30,\)"),
        (np.zeros((30, 2)), r"got \(30, 2\)"),
        (np.zeros((2, 30, 3)), r"got \(2, 30, 3\)"),
        (np.zeros((9, 30)), "transpose"),
        (np.zeros((30, 3), dtype=complex), "real part"),
        (np.zeros((30, 3), dtype=bool), "must be numbers"),
        (np.full((30, 3), "1.0"), "must be numbers.*astype"),
        (np.zeros((30, 3), dtype="M8[s]"), "must be numbers"),
        (np.zeros(30, dtype=[("x", "f4"), ("y", "f4")]), "0 fields called 'z'"),
        (np.zeros(30, dtype=[("x", "f4", 2), ("y", "f4"), ("z", "f4")]), "not one number each"),
        (np.float64(3.0), r"got \(\)"),
    ],
)
def test_arrays_that_are_no_cloud(array, message):
    with pytest.raises(ValueError, match=message):
        parse_npy(npy(array), "a.npy")


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 3), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-5, 3), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-5, -3), }",
        "{'descr': '|V0', 'fortran_order': False, 'shape': (1000000000000, 3), }",
        "{'descr': '<q9', 'fortran_order': False, 'shape': (5, 3), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (5, 3)",
        "__import__('os')",
        "",
    ],
)
def test_bad_header_allocates_nothing(header):
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"a\.npy: "):
        parse_npy(npy_with_header(header, bytes(100)), "a.npy")
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def test_truncated_array_names_the_numbers(cloud):
    with pytest.raises(ValueError, match=r"a\.npy.*shape \(40, 3\).*960 bytes; it holds 860"):
        parse_npy(npy(cloud)[:-100], "a.npy")


@pytest.mark.parametrize(
    "arrays, key",
    [
        (["xyz", "points", "arr_0"], "xyz"),
        (["points", "arr_0"], "points"),
        (["arr_0", "other"], "arr_0"),
        (["anything"], "anything"),
    ],
)
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_which_array_of_an_archive_is_the_cloud(arrays, key, save, cloud):
    held = {label: cloud if label == key else np.zeros((5, 3)) for label in arrays}
    np.testing.assert_array_equal(parse_npz(npz(save, **held, T=np.zeros(9)), "a.npz"), cloud)


def test_two_candidates_are_refused_with_their_shapes(cloud):
    with pytest.raises(ValueError, match=r"2 of shape.*first \(40, 3\), second \(40, 3\).*'xyz'"):
        parse_npz(npz(first=cloud, second=cloud), "a.npz")


def test_an_image_beside_the_cloud_is_no_second_candidate(cloud):
    depth = np.ones((48, 64))
    np.testing.assert_array_equal(parse_npz(npz(depth=depth, scan=cloud, T=np.eye(4)), "a.npz"), cloud)
    with pytest.raises(ValueError, match=r"2 of shape.*depth \(48, 64\), K \(3, 3\)"):
        parse_npz(npz(depth=depth, K=np.eye(3)), "a.npz")
    with pytest.raises(ValueError, match=r"'depth'.*48 x 64 numbers are an image"):
        parse_npz(npz(depth=depth), "a.npz")


@pytest.mark.parametrize("key", ["unit", "units", "length_unit"])
def test_a_unit_in_an_archive_is_believed_and_told(key, cloud):
    for word in ("mm", b"mm", ["mm"]):
        with pytest.warns(UserWarning, match=r"a\.npz: its own header says that its unit is 0\.001 m"):
            points = parse_npz(npz(xyz=cloud, **{key: word}), "a.npz")
        np.testing.assert_allclose(points, cloud / 1000)
    np.testing.assert_array_equal(parse_npz(npz(xyz=cloud, **{key: np.arange(3)}), "a.npz"), cloud)


def test_archives_without_a_cloud():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("readme.txt", "nothing")
    for data in (stream.getvalue(), npz(T=np.zeros((3, 1)))):
        with pytest.raises(ValueError, match=r"a\.npz.*0 of shape \(N, 3\)"):
            parse_npz(data, "a.npz")


def test_promise_beyond_the_member_allocates_nothing():
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 3), }"
        archive.writestr("xyz.npy", npy_with_header(header, bytes(96)))
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"array 'xyz'.*1000000000000.*it holds 96"):
        parse_npz(stream.getvalue(), "a.npz")
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def test_damage_is_found_by_the_checksum(cloud):
    data = bytearray(npz(xyz=cloud))
    data[data.index(cloud.tobytes()) + 100] ^= 1
    with pytest.raises(ValueError, match=r"a\.npz.*CRC"):
        parse_npz(bytes(data), "a.npz")


def test_half_an_archive(cloud):
    data = npz(xyz=cloud)
    with pytest.raises(ValueError, match=r"a\.npz: cannot be read as a zip archive.*again"):
        parse_npz(data[: len(data) // 2], "a.npz")
