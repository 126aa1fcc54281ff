# SPDX-License-Identifier: MIT
"""`.vtp` files, written by hand and by vtk: every storage, several pieces, surfaces, and what is none."""

from __future__ import annotations

import base64
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.io import read_points

HUNDRED = np.random.default_rng(3).integers(-4000, 4000, (100, 3)) / 64.0


@pytest.fixture
def vtk() -> Any:
    return pytest.importorskip("vtkmodules.vtkIOXML")


def numbers(values: np.ndarray, kind: str) -> str:
    """A DataArray's content: `ascii`, or `binary` (a count of bytes and the bytes), or `zlib` in two blocks."""
    flat = np.ascontiguousarray(values).ravel()
    if kind == "ascii":
        return " ".join(map(repr, flat.tolist()))
    raw = flat.tobytes()
    if kind == "binary":
        return base64.b64encode(np.uint32(len(raw)).tobytes() + raw).decode()
    size = 512
    blocks = [raw[k : k + size] for k in range(0, len(raw), size)]
    packed = [zlib.compress(block) for block in blocks]
    head = np.array([len(blocks), size, len(raw) % size, *map(len, packed)], dtype="<u4").tobytes()
    return base64.b64encode(head).decode() + base64.b64encode(b"".join(packed)).decode()


def written(
    path: Path, pieces: list[np.ndarray], kind: str = "ascii", faces: list[list[int]] | None = None
) -> Path:
    """A `.vtp` file by hand, float64 points; `faces` are of each piece."""
    compressor = ' compressor="vtkZLibDataCompressor"' if kind == "zlib" else ""
    form = "ascii" if kind == "ascii" else "binary"
    text = '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" '
    text += f'byte_order="LittleEndian"{compressor}>\n<PolyData>\n'
    for points in pieces:
        text += f'<Piece NumberOfPoints="{len(points)}" NumberOfPolys="{len(faces or ())}">\n<Points>\n'
        text += f'<DataArray type="Float64" NumberOfComponents="3" format="{form}">{numbers(points, kind)}'
        text += "</DataArray>\n</Points>\n"
        if faces:
            rows = np.concatenate([np.array(face) for face in faces])
            ends = np.cumsum([len(face) for face in faces])
            for name, values in (("connectivity", rows), ("offsets", ends)):
                content = numbers(values.astype(np.int64), kind)
                text += f'{"<Polys>" if name == "connectivity" else ""}<DataArray type="Int64" Name="{name}" '
                text += f'format="{form}">{content}</DataArray>\n'
            text += "</Polys>\n"
        text += "</Piece>\n"
    path.write_text(text + "</PolyData>\n</VTKFile>\n")
    return path


@pytest.mark.parametrize("kind", ["ascii", "binary", "zlib"])
def test_pieces_follow_one_another(tmp_path: Path, vtk: Any, kind: str) -> None:
    path = written(tmp_path / "a.vtp", [HUNDRED, HUNDRED[:7] + 1.0, HUNDRED[:1]], kind)
    wanted = np.vstack([HUNDRED, HUNDRED[:7] + 1.0, HUNDRED[:1]])
    np.testing.assert_array_equal(read_points(path), wanted)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("packed", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("encode", [False, True])
def test_every_storage_of_vtk(tmp_path: Path, vtk: Any, mode: str, packed: str, encode: bool) -> None:
    if encode and mode != "Appended":
        return
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    points, data = vtkPoints(), vtkPolyData()
    points.SetData(numpy_to_vtk(HUNDRED.astype(np.float32), deep=True))
    data.SetPoints(points)
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(str(tmp_path / "a.vtp"))
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.SetCompressorType(["None", "ZLib", "LZ4", "LZMA"].index(packed))
    writer.SetEncodeAppendedData(encode)
    writer.SetByteOrderToBigEndian()
    writer.SetInputData(data)
    assert writer.Write()
    np.testing.assert_array_equal(read_points(tmp_path / "a.vtp"), HUNDRED)


def test_a_surface_becomes_points_spread_over_it(tmp_path: Path, vtk: Any) -> None:
    # A square of one polygon, an L of one concave polygon beside it, and a point that belongs to nothing.
    corners = np.array(
        [
            [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
            [2, 0, 5], [4, 0, 5], [4, 1, 5], [3, 1, 5], [3, 2, 5], [2, 2, 5],
            [99, 99, 99],
        ],
        dtype=np.float64,
    )  # fmt: skip
    path = written(tmp_path / "a.vtp", [corners], faces=[[0, 1, 2, 3], [4, 5, 6, 7, 8, 9]])
    cloud = hr.read(path)
    assert len(cloud) == 200_000
    assert (cloud.points[:, 2] == 5.0).mean() == pytest.approx(0.75, abs=0.01)  # 3 of 4 square metres
    upper = cloud.points[cloud.points[:, 2] == 5.0]
    assert not ((upper[:, 0] > 3.0) & (upper[:, 1] > 1.0)).any()  # the notch stays empty
    quarter = (upper[:, 0] > 3.0).mean()
    assert quarter == pytest.approx(1 / 3, abs=0.01)
    assert cloud.viewpoint is None
    np.testing.assert_array_equal(cloud.points, hr.read(path).points)


def test_strips_are_surfaces_too(tmp_path: Path, vtk: Any) -> None:
    path = written(tmp_path / "a.vtp", [np.eye(4, 3)], faces=[[0, 1, 2, 3]])
    text = path.read_text().replace("Polys", "Strips")
    path.write_text(text)
    points = read_points(path)
    plane = np.isclose(points.sum(axis=1), 1.0)
    assert plane.any()
    assert (np.isclose(points[~plane], 0.0).any(axis=1)).all()  # the second triangle holds the origin


def test_lines_and_points_that_nothing_uses_are_points(tmp_path: Path, vtk: Any) -> None:
    path = written(tmp_path / "a.vtp", [HUNDRED], faces=[[0, 1, 2]])
    path.write_text(path.read_text().replace("Polys", "Lines"))
    np.testing.assert_array_equal(read_points(path), HUNDRED)


def test_missing_coordinates_are_told_by_the_gate(tmp_path: Path, vtk: Any) -> None:
    holed = HUNDRED.copy()
    holed[3, 1] = np.nan
    path = written(tmp_path / "a.vtp", [holed], "binary")
    assert np.isnan(read_points(path)).sum() == 1
    with pytest.raises(ValueError, match="not finite"):
        hr.read(path)
    assert len(hr.read(path, nonfinite="drop")) == 99


@pytest.mark.parametrize("change, word", [
    ((b'NumberOfPoints="100"', b'NumberOfPoints="0"'), "holds no points"),
    ((b'NumberOfPoints="100"', b'NumberOfPoints="101"'), "cannot be read as a file of VTK"),
    ((b"</PolyData>", b"</Poly>"), "cannot be read as a file of VTK"),
    ((b"Float64", b"Float65"), "cannot be read as a file of VTK"),
    ((b'type="PolyData"', b'type="UnstructuredGrid"'), "no surface or cloud.*Extract Surface"),
    ((b"<VTKFile", b"<html"), "does not begin|web page"),
])  # fmt: skip
def test_what_is_damaged_or_none(
    tmp_path: Path, vtk: Any, change: tuple[bytes, bytes], word: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path / "a.vtp", [HUNDRED])
    path.write_bytes(path.read_bytes().replace(*change))
    with pytest.raises(ValueError, match=rf"a\.vtp: .*({word})"):
        read_points(path)
    assert not capfd.readouterr().err  # VTK's own words stand in the message, not on the screen


@pytest.mark.parametrize("corners, faces, word", [
    (HUNDRED, [[0, 1, 200]], "a face names point 200, there are 100"),
    (HUNDRED, [[0, 1, -3]], "a face names point"),
    (np.zeros((3, 3)), [[0, 1, 2]], "1 faces have no area"),
    (np.array([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]]), [[0, 1, 2]], "1 of 1 faces have corners that are not finite"),
])  # fmt: skip
def test_surfaces_that_are_none(
    tmp_path: Path, vtk: Any, corners: np.ndarray, faces: list[list[int]], word: str
) -> None:
    with pytest.raises(ValueError, match=word):
        read_points(written(tmp_path / "a.vtp", [corners], "binary", faces))


@pytest.mark.parametrize("share", [0.1, 0.4, 0.7, 0.99])
@pytest.mark.parametrize("kind", ["ascii", "binary", "zlib"])
def test_a_file_that_breaks_off(tmp_path: Path, vtk: Any, kind: str, share: float) -> None:
    path = written(tmp_path / "a.vtp", [HUNDRED], kind)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(ValueError, match=r"a\.vtp: "):
        read_points(path)


def test_without_vtk_the_extra_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("vtkmodules", "vtkmodules.vtkCommonCore"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(
        ImportError, match=r"a\.vtp: a file of VTK needs vtk: run `pip install 'hybridreg\[vtk\]'`"
    ):
        read_points(written(tmp_path / "a.vtp", [HUNDRED]))


@pytest.mark.parametrize("ending, word", [
    ("vtk", "save it as .vtp or .ply"), ("vtu", "Extract Surface"), ("pvtp", "names pieces in other files"),
])  # fmt: skip
def test_siblings_tell_what_to_do(tmp_path: Path, ending: str, word: str) -> None:
    (tmp_path / f"a.{ending}").write_text("# vtk DataFile Version 3.0\n")
    with pytest.raises(ValueError, match=word):
        read_points(tmp_path / f"a.{ending}")


def test_another_name_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "a.vtp", [HUNDRED])
    for ending in ("ply", "txt", "obj"):
        path = path.rename(tmp_path / f"a.{ending}")
        with pytest.raises(ValueError, match=r"rename it to end in \.vtp"):
            read_points(path)


# --- the same of other meshes


@pytest.mark.parametrize("content, word", [
    ("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "1 faces have no area"),
    ("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "1 of 1 faces have corners that are not finite"),
    ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read as a mesh"),
])  # fmt: skip
def test_other_meshes_that_are_none(tmp_path: Path, content: str, word: str) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text(content)
    with pytest.raises(ValueError, match=word):
        read_points(tmp_path / "a.obj")


@pytest.mark.usefixtures("vtk")
def test_points_that_no_face_holds_are_not_left_out_in_silence(tmp_path: Path) -> None:
    few = np.concatenate([np.eye(3), HUNDRED[:2]])
    assert (
        len(read_points(written(tmp_path / "a.vtp", [few], faces=[[0, 1, 2]]))) > 100
    )  # two of five are no scan
    with pytest.raises(
        ValueError, match="surfaces and 97 points that belong to none; export only the points"
    ):
        read_points(written(tmp_path / "b.vtp", [HUNDRED], faces=[[0, 1, 2]]))


def in_unit(word: str, key: str = "units", faces: bool = False) -> Any:
    """A vtkPolyData whose field data say a unit."""
    core = pytest.importorskip("vtkmodules.vtkCommonCore")
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    support = pytest.importorskip("vtkmodules.util.numpy_support")
    points, said, data = core.vtkPoints(), core.vtkStringArray(), model.vtkPolyData()
    points.SetData(support.numpy_to_vtk(HUNDRED, deep=True))
    said.SetName(key)
    said.InsertNextValue(word)
    data.SetPoints(points)
    data.GetFieldData().AddArray(said)
    if faces:
        cells = model.vtkCellArray()
        for k in range(0, 99, 3):
            cells.InsertNextCell(3, [k, k + 1, k + 2])
        data.SetPolys(cells)
    return data


def saved(vtk: Any, data: Any, path: Path) -> Path:
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    assert writer.Write()
    return path


@pytest.mark.parametrize(
    "word, key, metres", [("mm", "units", 1e-3), ("ft", "unit", 0.3048), ("centimeters", "Length_Unit", 0.01)]
)
def test_a_unit_in_the_field_data_counts(
    vtk: Any, tmp_path: Path, word: str, key: str, metres: float
) -> None:
    data = in_unit(word, key)
    for x in (saved(vtk, data, tmp_path / "a.vtp"), data):
        with pytest.warns(UserWarning, match=f"its unit is {metres:g} m"):
            cloud = hr.PointCloud.of(x)
        np.testing.assert_allclose(cloud.points, HUNDRED * metres)
    with pytest.warns(UserWarning, match=f"its unit is {metres:g} m"):
        surface = read_points(saved(vtk, in_unit(word, key, faces=True), tmp_path / "b.vtp"))
    assert np.abs(surface).max() <= np.abs(HUNDRED).max() * metres


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("word, key", [("m", "units"), ("mm", "title"), ("dBZ", "units")])
def test_other_field_data_do_not(vtk: Any, tmp_path: Path, word: str, key: str) -> None:
    np.testing.assert_array_equal(read_points(saved(vtk, in_unit(word, key), tmp_path / "a.vtp")), HUNDRED)


def test_an_angle_in_the_field_data_is_refused(vtk: Any, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="deg"):
        read_points(saved(vtk, in_unit("degrees"), tmp_path / "a.vtp"))
