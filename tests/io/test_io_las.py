# SPDX-License-Identifier: MIT
from __future__ import annotations

import io

import numpy as np
import pytest

from hybridreg.io.formats.las import parse_las
from hybridreg.io.point_objects import points_of

laspy = pytest.importorskip("laspy")


def las(points, scale=0.0001, compress=False, point_format=6):
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [scale] * 3, np.floor(points.min(axis=0)) if len(points) else [0] * 3
    record = laspy.LasData(header)
    record.x, record.y, record.z = points.T
    stream = io.BytesIO()
    record.write(stream, do_compress=compress)
    return stream.getvalue()


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("point_format", [0, 3, 6])
def test_scale_and_offset_are_applied(utm_cloud, compress, point_format):
    points = parse_las(las(utm_cloud, compress=compress, point_format=point_format), "a.las")
    np.testing.assert_allclose(points, utm_cloud, rtol=0, atol=1e-8)


@pytest.mark.parametrize("point_format", [0, 6])
def test_withheld_points_are_deleted_ones(utm_cloud, point_format):
    record = laspy.read(io.BytesIO(las(utm_cloud, point_format=point_format)))
    record.withheld[::4] = 1
    stream = io.BytesIO()
    record.write(stream)
    kept = np.delete(utm_cloud, slice(None, None, 4), axis=0)
    words = f"{len(utm_cloud) - len(kept)} of {len(utm_cloud)} points are flagged as withheld"
    with pytest.warns(UserWarning, match=rf"a\.las: {words}"):
        points = parse_las(stream.getvalue(), "a.las")
    np.testing.assert_allclose(points, kept, rtol=0, atol=1e-8)
    for given in (record, record.points):
        with pytest.warns(UserWarning, match=words):
            np.testing.assert_allclose(points_of(given, "cloud"), kept, rtol=0, atol=1e-8)


def test_no_points():
    assert parse_las(las(np.empty((0, 3))), "a.las").shape == (0, 3)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("kept", [0.2, 0.6, 0.9, 0.99])
def test_truncated(utm_cloud, compress, kept):
    points = np.random.default_rng(0).uniform(0, 1000, size=(3000, 3))
    data = las(points, compress=compress)
    with pytest.raises(ValueError, match=r"a\.las"):
        parse_las(data[: int(len(data) * kept)], "a.las")


@pytest.mark.parametrize("compress", [False, True])
def test_absurd_count(utm_cloud, compress):
    data = bytearray(las(utm_cloud, compress=compress))
    data[247:255] = (10**12).to_bytes(8, "little")  # the count of LAS 1.4
    with pytest.raises(ValueError, match=r"a\.las"):
        parse_las(bytes(data), "a.las")


@pytest.mark.timeout(20)
@pytest.mark.parametrize("compress", [False, True])
def test_absurd_count_of_records_does_not_loop(utm_cloud, compress):
    data = bytearray(las(utm_cloud, compress=compress))
    data[100:104] = b"\xff" * 4
    with pytest.raises(ValueError, match=r"a\.las.*4294967295 records in the \d+ bytes"):
        parse_las(bytes(data), "a.las")


def chunk_table(data):
    start = int.from_bytes(data[96:100], "little")
    return start, int.from_bytes(data[start : start + 8], "little", signed=True)


def test_absurd_table_of_chunks_does_not_end_the_process(utm_cloud):
    # lazrs allocates 24 bytes a chunk at once and aborts when it cannot.
    data = bytearray(las(utm_cloud, compress=True))
    _, place = chunk_table(data)
    data[place + 4 : place + 8] = b"\xff" * 4
    with pytest.raises(ValueError, match=r"a\.las.*4294967295 chunks of at least 30 bytes"):
        parse_las(bytes(data), "a.las")


@pytest.mark.parametrize("place", [-5, 3, 2**40])
def test_lost_table_of_chunks(utm_cloud, place):
    data = bytearray(las(utm_cloud, compress=True))
    start, _ = chunk_table(data)
    data[start : start + 8] = place.to_bytes(8, "little", signed=True)
    with pytest.raises(ValueError, match=rf"a\.las.*table of chunks should lie at byte {place}"):
        parse_las(bytes(data), "a.las")


def test_table_announced_at_the_end_as_by_streaming_writers(utm_cloud):
    data = bytearray(las(utm_cloud, compress=True, point_format=3))
    start, place = chunk_table(data)
    data[start : start + 8] = b"\xff" * 8
    points = parse_las(bytes(data) + place.to_bytes(8, "little"), "a.las")
    np.testing.assert_allclose(points, utm_cloud, rtol=0, atol=1e-8)


def test_many_chunks():
    points = np.round(np.random.default_rng(0).uniform(0, 100, size=(120_000, 3)), 3)
    np.testing.assert_allclose(parse_las(las(points, scale=0.001, compress=True), "a.laz"), points, atol=1e-9)


def test_promises_are_compared_in_numbers(utm_cloud):
    data = las(utm_cloud)
    with pytest.raises(ValueError, match=r"40 points of 30 bytes, it holds 1190 bytes"):
        parse_las(data[:-10], "a.las")
    with pytest.raises(ValueError, match="holds 100 bytes, a LAS header alone takes 227"):
        parse_las(data[:100], "a.las")


def test_copc_is_read_as_what_it_is(tmp_path):
    copclib = pytest.importorskip("copclib")
    points = np.round(np.random.default_rng(0).uniform(1, 9, (200, 3)), 3)
    path = tmp_path / "a.copc.laz"
    writer = copclib.FileWriter(str(path), copclib.CopcConfigWriter(6, [0.001] * 3, [0, 0, 0]))
    rows = copclib.Points(writer.copc_config.las_header)
    for x, y, z in points.tolist():
        row = rows.CreatePoint()
        row.x, row.y, row.z = x, y, z
        rows.AddPoint(row)
    writer.AddNode(copclib.VoxelKey(0, 0, 0, 0), rows)
    writer.Close()
    np.testing.assert_allclose(
        np.sort(parse_las(path.read_bytes(), "a.copc.laz"), axis=0), np.sort(points, axis=0), atol=1e-9
    )
