# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hybridreg.io import read_points
from hybridreg.io.point_files import parse_points


def test_every_format_gives_the_same_cloud(samples, cloud, tmp_path):
    assert len(samples) >= 17
    for name, data in samples.items():
        path = tmp_path / name
        path.write_bytes(data)
        points = read_points(path)
        assert points.dtype == np.float64, name
        np.testing.assert_array_equal(points, cloud, err_msg=name)


def test_string_paths_and_upper_case_endings(samples, cloud, tmp_path):
    path = tmp_path / "SCAN.PLY"
    path.write_bytes(samples["ascii.ply"])
    np.testing.assert_array_equal(read_points(str(path)), cloud)


def test_points_are_writable_and_own_their_memory(samples, tmp_path):
    path = tmp_path / "cloud.ply"
    path.write_bytes(samples["binary_little_endian.ply"])
    points = read_points(path)
    points += 1.0
    assert points.flags.owndata


@pytest.mark.parametrize("name", ["there.ply", "there", "there.jpg"])
def test_missing_path(tmp_path, name):
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_points(tmp_path / name)


def test_folder(tmp_path):
    (tmp_path / "scan.ply").mkdir()
    with pytest.raises(IsADirectoryError, match=r"scan\.ply.*folder"):
        read_points(tmp_path / "scan.ply")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipe_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(ValueError, match="pipe"):
        read_points(tmp_path / "pipe.ply")


def test_unknown_ending_lists_the_known(tmp_path):
    path = tmp_path / "scan.xyzq"
    path.write_bytes(b"x")
    with pytest.raises(ValueError, match=r"scan\.xyzq.*'\.xyzq'.*\.ply, \.pcd"):
        read_points(path)


def test_empty_file_of_each_ending(samples):
    for name in samples:
        with pytest.raises(ValueError, match=rf"{name}.*0 bytes"):
            parse_points(b"", name)


DISGUISES = {
    "JPEG": b"\xff\xd8\xff\xe0\x00\x10JFIF" + bytes(100),
    "PNG": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "zip archive": b"PK\x03\x04" + bytes(100),
    "gzip": b"\x1f\x8b\x08\x00" + bytes(100),
    "web page": b"\n<!DOCTYPE html><html><body>404</body></html>",
    "Git LFS": b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n",
    "HDF5": b"\x89HDF\r\n\x1a\n" + bytes(100),
}


@pytest.mark.parametrize("ending", ["ply", "pcd", "bin", "npy", "npz", "xyz", "csv", "las", "laz"])
@pytest.mark.parametrize("kind", DISGUISES)
def test_content_that_is_not_what_the_name_says(kind, ending):
    name = f"cloud.{ending}"
    with pytest.raises(ValueError, match=rf"cloud\.{ending}") as caught:
        parse_points(DISGUISES[kind], name)
    if not (kind == "zip archive" and ending == "npz"):
        assert kind in str(caught.value)


@pytest.mark.parametrize(
    "content, wrong, right",
    [
        ("ascii.ply", "cloud.pcd", r"rename it to end in \.ply"),
        ("ascii.pcd", "cloud.ply", r"rename it to end in \.pcd"),
        ("plain.npy", "cloud.npz", r"rename it to end in \.npy"),
        ("plain.npz", "cloud.npy", r"rename it to end in \.npz"),
        ("binary_big_endian.ply", "cloud.xyz", r"rename it to end in \.ply"),
        ("plain.xyz", "cloud.bin", r"rename it to end in \.txt"),
    ],
)
def test_swapped_endings_name_the_right_one(samples, content, wrong, right):
    with pytest.raises(ValueError, match=right):
        parse_points(samples[content], wrong)


def test_import_is_light():
    heavy = ["cv2", "laspy", "open3d", "torch"]
    code = f"import hybridreg.io, sys; print([name for name in {heavy} if name in sys.modules])"
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == "[]"


def test_las_without_laspy_is_one_sentence(monkeypatch, samples):
    monkeypatch.setitem(sys.modules, "laspy", None)
    with pytest.raises(ImportError, match=r"hybridreg\[las\]"):
        parse_points(b"LASF" + bytes(400), "cloud.las")


def test_real_cloud(real_data):
    for path in sorted(real_data.glob("*/source.npz"))[:3]:
        points = read_points(path)
        with np.load(path) as archive:
            np.testing.assert_array_equal(points, archive["xyz"].astype(np.float64))


@pytest.mark.parametrize("ending", ["asc", "pts", "xyzn", "xyzrgb", "xyzi", "tsv", "XYZ"])
def test_text_under_every_ending(cloud, ending):
    head = f"{len(cloud)}\n" if ending == "pts" else "// from CloudCompare\n" if ending == "asc" else ""
    rows = "".join(f"{x!r} {y!r} {z!r} 0 0 1\n" for x, y, z in cloud.tolist())
    np.testing.assert_array_equal(parse_points((head + rows).encode(), f"a.{ending}"), cloud)


@pytest.mark.parametrize(
    "name, data, cure",
    [
        ("a.bin", b"CCB2" + bytes(200), "CloudCompare's own format.*save it there as .ply or .las"),
        ("a.ply", b"ASTM-E57" + bytes(200), "an E57 file.*rename it to end in .e57"),
        ("a.csv", b"PAR1" + bytes(100), "Parquet"),
        ("a.vtk", b"# vtk DataFile", "ParaView"),
        ("a.ptx", b"4", r"\.pts"),
        ("a.pcap", b"\xd4\xc3\xb2\xa1", "sensor's own tool"),
        ("a.mat", b"MATLAB 5.0", "save the array"),
        ("a.csv.gz", b"\x1f\x8b\x08", "unpack it first"),
        ("a.hgt", b"\x00\x01", "gdalwarp"),
        ("a.kmall", b"#IIP", "soundings as text"),
        ("a.ifc", b"ISO-10303-21;", "surface as .ply or .obj"),
        ("a.db3.zstd", b"\x28\xb5\x2f\xfd", "of a ROS 2 bag give the folder"),
    ],
)
def test_files_of_other_tools_name_their_cure(name, data, cure):
    with pytest.raises(ValueError, match=rf"{name}: .*{cure}"):
        parse_points(data, name)
