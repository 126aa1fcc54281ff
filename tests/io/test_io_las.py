# SPDX-License-Identifier: MIT
from __future__ import annotations

import io

import numpy as np
import pytest

from hybridreg.io.las import parse_las

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
