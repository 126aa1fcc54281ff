# SPDX-License-Identifier: MIT
"""Objects as drivers, kits and tools hand them out: read right, or refused with a cure that works."""

from __future__ import annotations

import base64
import contextlib
import io
from collections import namedtuple
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hybridreg import PointCloud

P = np.random.default_rng(0).normal(size=(60, 3)) * [5, 4, 2]
F = P.astype("<f4").astype(np.float64)


def same(x: Any, points: np.ndarray = P) -> None:
    np.testing.assert_array_equal(PointCloud.of(x).points, points)


def refused(x: Any) -> str:
    with pytest.raises(ValueError, match=r"^target: ") as caught:
        PointCloud.of(x, name="target")
    return str(caught.value)


def record(*fields: tuple[Any, ...], offsets: list[int] | None = None, size: int = 0) -> np.ndarray:
    if offsets is None:
        array = np.zeros(60, list(fields))
    else:
        names, formats = zip(*fields, strict=True)
        array = np.zeros(60, {"names": names, "formats": formats, "offsets": offsets, "itemsize": size})
    for axis, values in zip("xyz", P.T, strict=True):
        for name in array.dtype.names or ():
            if name.lower().split(" ")[0].split("_")[-1] == axis:
                array[name] = values
    return array


def test_records_of_any_order_type_and_padding() -> None:
    same(record(("z", "f8"), ("i", "u1"), ("y", ">f8"), ("x", "f8")))
    same(
        record(
            ("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), offsets=[0, 4, 8, 16], size=32
        ),
        F,
    )
    same(record(("X", "f8"), ("Y", "f8"), ("Z", "f8")).view(np.recarray))
    same(record(("pos_x", "f8"), ("pos_y", "f8"), ("pos_z", "f8"), ("nx", "f4"), ("ny", "f4"), ("nz", "f4")))
    same(record(("x", "f8"), ("y", "f8"), ("z", "f8")).reshape(6, 10))
    together = np.zeros(60, [("intensity", "f4"), ("xyz", "f8", 3)])
    together["xyz"] = P
    same(together)


def test_records_in_another_unit_become_metres_and_say_so() -> None:
    rows = record(("x (mm)", "f8"), ("y (mm)", "f8"), ("z (mm)", "f8"))
    with pytest.warns(UserWarning, match=r"unit is 0\.001 m"):
        cloud = PointCloud.of(rows)
    np.testing.assert_allclose(cloud.points, P / 1000)


def test_records_without_coordinates_name_what_they_hold() -> None:
    assert "'nx, ny, nz'" in refused(np.zeros(60, [("nx", "f4"), ("ny", "f4"), ("nz", "f4")]))
    assert "longitudes" in refused(np.zeros(60, [("lon", "f8"), ("lat", "f8"), ("height", "f8")]))
    raw = np.zeros(60, [("X", "i4"), ("Y", "i4"), ("Z", "i4"), ("bit_fields", "u1")])
    assert "laspy.read" in refused(raw)


@pytest.mark.parametrize("fill", [1e3, 0.0, -9999.0])
def test_fill_values_are_never_points(fill: float) -> None:
    mask = np.zeros(P.shape, bool)
    mask[::3, 1] = True
    masked = np.ma.masked_array(np.where(mask, fill, P), mask)
    assert "20 of 60 points" in refused(masked)
    kept = PointCloud.of(masked, nonfinite="drop")
    np.testing.assert_array_equal(kept.points, P[~mask.any(axis=1)])
    for several in (list(masked), tuple(masked.T), [*masked[:59], P[59]]):
        assert PointCloud.of(several, nonfinite="drop").dropped == 20
    whole = np.ma.masked_array((P * 100).astype(int), mask)
    assert PointCloud.of(whole, nonfinite="drop").dropped == 20
    rows = np.ma.masked_array(record(("x", "f8"), ("y", "f8"), ("z", "f8")), mask[:, 1])
    assert PointCloud.of(rows, nonfinite="drop").dropped == 20


def test_channels_first_organised_and_homogeneous() -> None:
    same(P.T)
    same(np.c_[P, np.ones(60)].T)
    same(np.c_[P, np.ones(60)])
    same(P.reshape(10, 6, 3))
    same(np.moveaxis(P.reshape(2, 30, 3), -1, 0))
    same(P[None])
    same(tuple(P.T))
    same(SimpleNamespace(points=np.c_[P, np.ones(60)].T))


def test_several_clouds_are_not_one() -> None:
    torch = pytest.importorskip("torch")
    assert "x[0]" in refused(np.stack([P, P]))
    assert "x[0]" in refused(torch.tensor(np.stack([P] * 16)))
    assert "x[0]" in refused(torch.tensor(P.T)[None])
    same(torch.tensor(P)[None])


@pytest.mark.parametrize("shape", [(4, 4), (3, 4), (3, 3)])
def test_a_trajectory_is_no_organised_cloud(shape: tuple[int, int]) -> None:
    # Rotations were read as points at 1 m from the origin.
    T = np.tile(np.eye(4), (100, 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(np.linspace(0.0, 3.0, 100)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    T[:, :3, 3] = np.linspace(0.0, 50.0, 300).reshape(100, 3)
    poses = T[:, : shape[0], : shape[1]]
    for given in (poses, list(poses), poses.astype(np.float32)):
        assert "holds 100 poses, not points" in refused(given)
    assert ("x[:, :3, 3]" in refused(poses)) == (shape[1] == 4)
    scan = np.concatenate([P.reshape(20, 3, 3), np.ones((20, 3, 1))], axis=2)[:, : shape[0], : shape[1]]
    assert len(PointCloud.of(scan)) == 60  # an organised cloud of three columns


def test_a_column_that_counts_is_no_coordinate() -> None:
    assert "is a row number" in refused(np.c_[np.arange(60), P])
    assert "is a row number" in refused(np.c_[np.arange(1, 61), P, P])


IMAGE = np.random.default_rng(1).uniform(0.5, 9, (64, 1024)).astype("f4")


@pytest.mark.parametrize("kind", ["f4", "u2"])
@pytest.mark.parametrize("shape", [(64, 1024), (1024, 64), (1, 64, 1024), (64, 1024, 1)])
def test_an_image_is_no_cloud(shape: tuple[int, ...], kind: str) -> None:
    pixels = (IMAGE * 7000).astype(kind).reshape(shape)
    assert "64" in refused(pixels)
    assert "an image; unproject" in refused(pixels).replace(", not a row for each point", "")


def test_images_of_torch_pandas_and_xarray() -> None:
    assert "an image" in refused(pytest.importorskip("torch").tensor(IMAGE))
    assert "an image" in refused(pytest.importorskip("pandas").DataFrame(IMAGE))
    heights = pytest.importorskip("xarray").DataArray(
        IMAGE, dims=("y", "x"), coords={"x": np.arange(1024.0), "y": np.arange(64.0)}
    )
    assert 'x.to_dataframe("z").reset_index()' in refused(heights)
    assert len(PointCloud.of(heights.to_dataframe("z").reset_index())) == IMAGE.size
    assert "x.to_dataframe().reset_index()" in refused(heights.to_dataset(name="z"))


def test_a_photo_is_no_cloud() -> None:
    photo = np.random.default_rng(1).integers(0, 256, (48, 64, 3)).astype("u1")
    assert "colours of a photo" in refused(photo)
    assert "colours of a photo" in refused(np.moveaxis(photo, -1, 0))
    with pytest.warns(UserWarning, match="48 x 64 values are those of a photo"):
        PointCloud.of(photo / 255.0)


@pytest.mark.filterwarnings("error")
def test_features_of_each_point_are_no_image() -> None:
    points = np.random.default_rng(1).normal(size=(5000, 3))
    same(np.c_[points, np.ones((5000, 64))], points)
    same(np.c_[P, np.ones((60, 33))])
    assert len(PointCloud.of((points * 100 + 1000).astype("u2"))) == 5000


def in_millimetres() -> dict[str, Any]:
    """The same cloud in millimetres, as each package says so that is installed."""
    mm, axes = P * 1000, dict(zip("xyz", (P * 1000).T, strict=True))
    held: dict[str, Any] = {"dictionary": {**axes, "unit": "mm"}, "together": {"xyz": mm, "units": "mm"}}
    held["attribute"] = SimpleNamespace(points=mm, units="millimeters")
    with contextlib.suppress(ImportError):
        import pandas as pd

        held["pandas"] = pd.DataFrame(axes)
        held["pandas"].attrs["units"] = "mm"
    with contextlib.suppress(ImportError):
        import xarray as xr

        held["Dataset"] = xr.Dataset({k: ("n", v, {"units": "mm"}) for k, v in axes.items()})
        held["DataArray"] = xr.DataArray(
            mm, dims=("n", "axis"), coords={"axis": list("xyz")}, attrs={"units": "mm"}
        )
        held["DataArray without labels"] = xr.DataArray(mm, attrs={"units": "mm"})
    with contextlib.suppress(ImportError):
        import pyarrow as pa

        fields = [pa.field(k, pa.float64(), metadata={"unit": "mm"}) for k in axes]
        held["pyarrow"] = pa.table([pa.array(v) for v in axes.values()], schema=pa.schema(fields))
    with contextlib.suppress(ImportError):
        import trimesh

        held["trimesh"] = trimesh.PointCloud(mm)
        held["trimesh"].units = "mm"
    with contextlib.suppress(ImportError):
        from astropy import units
        from astropy.coordinates import CartesianRepresentation
        from astropy.table import QTable

        held["Quantity"] = mm * units.mm
        held["CartesianRepresentation"] = CartesianRepresentation(*mm.T * units.mm)
        held["QTable"] = QTable({k: v * units.mm for k, v in axes.items()})
    return held


MILLIMETRES = in_millimetres()


@pytest.mark.parametrize("kind", MILLIMETRES)
def test_a_unit_in_the_data_is_believed_and_told_once(kind: str) -> None:
    with pytest.warns(UserWarning, match=r"target: its own header says that its unit is 0\.001 m") as told:
        cloud = PointCloud.of(MILLIMETRES[kind], name="target")
    np.testing.assert_allclose(cloud.points, P)
    assert len(told) == 1


@pytest.mark.filterwarnings("error")
def test_what_is_called_unit_and_is_none() -> None:
    pd = pytest.importorskip("pandas")
    same(pd.DataFrame(P, columns=list("xyz")).assign(unit="B 12", units=1.0))
    same({**dict(zip("xyz", P.T, strict=True)), "unit": P[:, 0]})
    same(SimpleNamespace(points=P, units="m"))
    same(SimpleNamespace(points=P, units=None))


@pytest.mark.parametrize("word, metres", [("fathoms", 1.8288), ("Nautical_Mile", 1852.0), ("nmi", 1852.0)])
def test_units_of_soundings(word: str, metres: float) -> None:
    with pytest.warns(UserWarning, match=f"its unit is {metres:g} m"):
        cloud = PointCloud.of({**dict(zip("xyz", P.T, strict=True)), "units": word}, name="target")
    np.testing.assert_allclose(cloud.points + cloud.offset, P * metres)


def test_angles_and_units_that_differ_are_refused() -> None:
    for angle in (
        "degrees_north",
        "degree_north",
        "degree_E",
        "degreesN",
        "degrees_true",
    ):  # CF's, for netCDF
        assert f"{angle!r}" in refused({**dict(zip("xyz", P.T, strict=True)), "units": angle})
    xr = pytest.importorskip("xarray")
    units = {"x": "mm", "y": "mm", "z": "m"}
    mixed = xr.Dataset({k: ("n", v, {"units": units[k]}) for k, v in zip("xyz", P.T, strict=True)})
    assert "differ: 0.001 m, 0.001 m, 1 m" in refused(mixed)


R = np.linalg.norm(P, axis=1)


def test_a_range_before_the_points_is_no_coordinate() -> None:
    for table in (np.c_[R, P], np.c_[R, P, R].astype("f4")):
        assert "length of the next three" in refused(table)
        assert "x[..., 1:4]" in refused(table)
        same(table[..., 1:4], table[..., 1:4].astype(float))
    missing = np.c_[R, P, R].T.reshape(5, 6, 10).copy()
    missing[:, ::3] = -1
    assert "x[1:4]" in refused(missing)


FIRST = {
    "0 in each row, like an index in a batch": np.zeros(60),
    "2 whole numbers, like a ring": np.repeat([0, 1], 30),
    "16 whole numbers, like a ring": np.arange(60) % 16,
    "1.6e.09, like a time": 1.6e9 + np.random.default_rng(3).uniform(0, 0.1, 60),
    "rises from row to row, like a time": np.linspace(0, 0.1, 60),
    "rises from row to row": np.arange(60) * 10,
    "rises .* a number of the row": np.cumsum(np.random.default_rng(3).integers(1, 90, 60)),
}


@pytest.mark.parametrize("words", FIRST)
def test_a_doubtful_first_column_is_told(words: str) -> None:
    pd = pytest.importorskip("pandas")
    table = np.c_[FIRST[words], P]
    with pytest.warns(
        UserWarning, match=rf"target: its first column was read as x, and .*{words}.*x\[\.\.\., 1:4\]"
    ):
        PointCloud.of(table, name="target")
    with pytest.warns(UserWarning, match="call the columns of x, y and z so"):
        PointCloud.of(pd.DataFrame(table))


@pytest.mark.parametrize("colours", [0, 3])
@pytest.mark.parametrize("holes", [1, 3])
def test_row_and_column_before_the_points_are_told(tmp_path: Any, holes: int, colours: int) -> None:
    # As organised scans are exported; they were taken for x and y without a word.
    pixels = np.stack(np.meshgrid(np.arange(12.0), np.arange(40.0), indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.random.default_rng(3).uniform(-9.0, 9.0, (480, 3))
    points[::holes] *= float(holes == 1)
    table = np.c_[pixels, points, np.zeros((480, colours))]
    np.savetxt(tmp_path / "a.txt", table)
    for given in (table, tmp_path / "a.txt", table[:, [1, 0, *range(2, 5 + colours)]]):
        with pytest.warns(UserWarning, match="first two columns .*row column x y z"):
            PointCloud.of(given)
    np.savetxt(tmp_path / "b.txt", table, header="row column x y z" + " c" * colours, comments="")
    same(tmp_path / "b.txt", points)


def test_normals_before_the_points_are_told() -> None:
    with pytest.warns(UserWarning, match=r"first three columns .* length 1 in each row"):
        PointCloud.of(np.c_[P / R[:, None], P])


@pytest.mark.filterwarnings("error")
def test_first_columns_that_may_well_be_x() -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.arange(40.0), np.arange(30.0), indexing="ij"))
    heights = np.c_[x, y, np.sin(x) + np.cos(y), x % 5]
    repeated = np.c_[heights[:, :3], np.sin(x), np.cos(y)][np.r_[:1200, :1200]]
    PointCloud.of(np.c_[heights[:, :3] + [450_000.0, 5_400_000.0, 0.0], np.sin(x), np.cos(y)])
    for table in (heights, heights[:, [1, 0, 2, 3]], heights * [0.5, 0.5, 1, 1], repeated):
        same(table, table[:, :3])
    sorted_ = np.unique(np.c_[P, R], axis=0)
    same(sorted_, sorted_[:, :3])
    same(np.c_[P, P / R[:, None]])
    same(np.c_[0 * R, P[:, 1:], R / R.max()], P * [0, 1, 1])  # a flat scan with an intensity
    cells = np.unique(np.floor(P * 4), axis=0)
    same(np.c_[cells, cells[:, 0] * 0], cells)


def test_tensors() -> None:
    torch = pytest.importorskip("torch")
    same(torch.tensor(P, requires_grad=True))
    same(torch.tensor(P).T)
    same(torch.tensor(P).to_sparse())
    same(torch.tensor(F).to(torch.bfloat16), torch.tensor(F).to(torch.bfloat16).double().numpy())
    same(SimpleNamespace(pos=torch.tensor(P)))
    same({"coord": torch.tensor(P), "feat": torch.zeros(60, 4)})


def test_dictionaries_and_rows_with_names(tmp_path: Any) -> None:
    x, y, z = P.T
    same({"Z": z, "time": z, "x": x, "Y": y})
    same({"cartesianX": x, "cartesianY": y, "cartesianZ": z})  # pye57
    same({"point": P, "feat": z})  # Open3D-ML
    np.savez(tmp_path / "a.npz", xyz=P)
    same(np.load(tmp_path / "a.npz"))
    same([{"z": c, "x": a, "y": b} for a, b, c in P.tolist()])
    point = namedtuple("point", "intensity x y z")
    same([point(9, *row) for row in P.tolist()])
    same([SimpleNamespace(x=a, y=b, z=c, reflectivity=1) for a, b, c in P.tolist()])  # Livox, geometry_msgs
    same(list(record(("z", "f8"), ("y", "f8"), ("x", "f8"))))
    assert "lengths 60, 60, 59" in refused({"x": x, "y": y, "z": z[1:]})
    assert "several columns" in refused(
        {"pos_x": x, "pos_y": y, "pos_z": z, "point_x": x, "point_y": y, "point_z": z}
    )


def cloud2(order: str, rows: int) -> SimpleNamespace:
    data = np.zeros(
        60, {"names": ["y", "x", "z"], "formats": [f"{order}f4"] * 3, "offsets": [4, 0, 8], "itemsize": 20}
    )
    data["x"], data["y"], data["z"] = P.T
    padded = [data[k::rows][: 60 // rows].tobytes() + bytes(12) for k in range(rows)]
    fields = [
        SimpleNamespace(name=n, offset=o, datatype=7, count=1) for n, o in (("x", 0), ("y", 4), ("z", 8))
    ]
    return SimpleNamespace(
        fields=fields, point_step=20, row_step=20 * 60 // rows + 12, width=60 // rows, height=rows,
        is_bigendian=order == ">", data=b"".join(padded),
    )  # fmt: skip


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("rows", [1, 4])
def test_point_cloud_2(order: str, rows: int) -> None:
    message = cloud2(order, rows)
    expected = np.concatenate([F[k::rows] for k in range(rows)])
    same(message, expected)
    message.data = np.frombuffer(message.data, np.uint8)
    same(message, expected)
    message.data = message.data[:100]
    assert "holds 100 bytes" in refused(message)


def test_point_cloud_2_as_drivers_and_bridges_make_it() -> None:
    odd = [SimpleNamespace(name=n, offset=12, datatype=7, count=1) for n in ("rgb", "rgb", "", "")]
    message = cloud2("<", 1)
    message.fields += odd
    same(message, F)
    message.data = base64.b64encode(message.data).decode()  # rosbridge
    same(message, F)
    table = {**vars(message), "fields": [vars(each) for each in message.fields]}
    same(table, F)
    same({**table, "data": base64.b64decode(message.data)}, F)
    assert "are text, but not base64: 'no'" in refused({**table, "data": "no"})
    together = cloud2("<", 1)
    together.fields = [SimpleNamespace(name="xyz", offset=0, datatype=7, count=3)]
    same(together, F)
    message.fields[2].offset = 18
    assert "correct their offsets" in refused(message)


def test_point_cloud_2_whose_row_step_is_that_of_all_rows() -> None:
    whole = cloud2("<", 1)
    whole.data = whole.data[: 60 * 20]
    whole.height, whole.width, whole.row_step = 4, 15, len(whole.data)
    same(whole, F)
    whole.data = whole.data[:-1]
    assert "holds 1199 bytes" in refused(whole)


def test_pandas() -> None:
    pd = pytest.importorskip("pandas")
    frame = pd.DataFrame({"t": range(60), "Z": P[:, 2], "x": P[:, 0], "y": P[:, 1]})
    same(frame)
    same(frame.set_index("t"))
    same(frame.convert_dtypes())
    same(frame.iloc[::-1], P[::-1])
    same(pd.DataFrame(P))
    same(frame.rename(columns={"Z": ("lidar", "z")}))
    with pytest.warns(UserWarning, match="0.01 m"):
        np.testing.assert_allclose(
            PointCloud.of(frame.rename(columns={"x": "x[cm]", "y": "y[cm]", "Z": "z[cm]"})).points, P / 100
        )
    assert "'a, b, c'" in refused(pd.DataFrame(P, columns=list("abc")))
    assert "2 fields called 'x'" in refused(pd.concat([frame, frame], axis=1))
    lacking = frame.convert_dtypes()
    lacking.loc[3, "x"] = pd.NA
    assert PointCloud.of(lacking, nonfinite="drop").dropped == 1
    assert "than numbers" in refused(frame.assign(x="far"))


def test_polars_and_pyarrow() -> None:
    columns = {"t": range(60), "Z": P[:, 2], "x": P[:, 0], "y": P[:, 1]}
    pl = pytest.importorskip("polars")
    same(pl.DataFrame(columns))
    same(pl.DataFrame(P))
    assert "collect()" in refused(pl.DataFrame(columns).lazy())
    pa = pytest.importorskip("pyarrow")
    same(pa.table({k: list(v) for k, v in columns.items()}))
    same(pa.RecordBatch.from_pydict({k: list(v) for k, v in columns.items()}))
    lacking = pa.table({"x": [None, *P[1:, 0]], "y": P[:, 1], "z": P[:, 2]})
    assert PointCloud.of(lacking, nonfinite="drop").dropped == 1


def test_xarray() -> None:
    xr = pytest.importorskip("xarray")
    same(xr.Dataset({axis: ("n", values) for axis, values in zip("xyz", P.T, strict=True)}))
    same(xr.DataArray(P[:, ::-1], dims=("n", "axis"), coords={"axis": list("zyx")}))
    same(xr.DataArray(P))


def test_dask() -> None:
    da = pytest.importorskip("dask.array")
    same(da.from_array(P))


def test_laspy() -> None:
    laspy = pytest.importorskip("laspy")
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.header.scales = [1 / 512] * 3
    grid = np.round(P * 512) / 512
    las.x, las.y, las.z = grid.T
    same(las, grid)
    same(las.points, grid)
    assert "laspy.read" in refused(las.points.array)
    # The same as a table, as many make it, or as lazpy 0.9.2's `arrays()`: thousandths were read as metres.
    columns = {each: las.points.array[each] for each in las.points.array.dtype.names}
    assert "laspy.read" in refused(columns)
    assert "laspy.read" in refused(
        {**{axis: columns[axis] for axis in "XYZ"}, "point_source_ID": np.zeros(60)}
    )
    assert "laspy.read" in refused(pytest.importorskip("pandas").DataFrame(columns))
    same({**columns, **dict(zip("XYZ", grid.T, strict=True))}, grid)  # scaled beforehand


def test_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh")
    same(trimesh.PointCloud(P))
    box = trimesh.creation.box()
    assert "x.sample(100_000)" in refused(box)
    assert "x.to_mesh().sample" in refused(trimesh.Scene(box))
    assert len(PointCloud.of(box.sample(1000))) == 1000
    assert len(PointCloud.of(trimesh.Scene(box).to_mesh().sample(1000))) == 1000
    assert len(PointCloud.of(trimesh.creation.icosphere().vertices)) > 20


def test_open3d() -> None:
    from hybridreg.runtime.open3d import load_open3d

    try:
        o3d = load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    for module in (o3d, o3d.t):
        mesh = module.geometry.TriangleMesh.create_sphere()
        assert "sample_points_uniformly(100_000)" in refused(mesh)
        assert len(PointCloud.of(mesh.sample_points_uniformly(1000))) == 1000
    assert len(PointCloud.of(mesh.vertex["positions"])) > 20
    same(o3d.core.Tensor(P))
    same(o3d.utility.Vector3dVector(P))
    same(o3d.geometry.LineSet(o3d.utility.Vector3dVector(P), o3d.utility.Vector2iVector()))
    assert "image" in refused(o3d.geometry.Image()).lower()


def test_meshes_of_meshio_pyntcloud_and_pymeshlab_are_no_clouds() -> None:
    # As meshio 5.3.5, pyntcloud 0.3.1 and pymeshlab 2025.7 keep them: the vertices where others keep a cloud's points,
    # the faces elsewhere. Of the first two the vertices were read, however far apart.
    pandas = pytest.importorskip("pandas")
    points, triangle = pandas.DataFrame(P, columns=list("xyz")), np.array([[0, 1, 2]])
    faces = pandas.DataFrame(triangle, columns=["v1", "v2", "v3"])

    def meshio(kind: str, rows: np.ndarray) -> SimpleNamespace:
        return SimpleNamespace(points=P, cells=[SimpleNamespace(type=kind, data=rows)])

    def meshlab(count: int) -> SimpleNamespace:
        return SimpleNamespace(
            vertex_matrix=lambda: P - 1.0,  # not moved yet by the matrix beside it, as of an E57 scan
            transformed_vertex_matrix=lambda: P,
            face_matrix=lambda: triangle,
            face_number=lambda: count,
        )

    same(SimpleNamespace(points=P, cells=[]))
    same(SimpleNamespace(vertices=P, cells=[[0], [1, 2]]))
    # vedo 2026.6.3, whose cells are lists of corners: its meshes were read as their vertices
    assert "x.vertices" in refused(SimpleNamespace(vertices=P, cells=[[0, 1, 2]]))
    same(meshio("vertex", np.arange(len(P))[:, None]))
    same(SimpleNamespace(points=points, mesh=None))
    same(meshlab(0))
    for mesh in (meshio("triangle", triangle), SimpleNamespace(points=points, mesh=faces)):
        assert "a mesh is not a cloud; sample its surface, or pass its vertices, x.points" in refused(mesh)
    assert "x.transformed_vertex_matrix()" in refused(meshlab(1))
    assert "x.current_mesh()" in refused(SimpleNamespace(current_mesh=lambda: meshlab(0)))


def test_reconstructions_of_pycolmap() -> None:
    # As pycolmap 4.2.1 keeps them; they were refused with a cure that led nowhere, "pass what its read() returns".
    points = {7 * k: SimpleNamespace(xyz=p, color=np.zeros(3, np.uint8)) for k, p in enumerate(P)}
    same(SimpleNamespace(points3D=points, read=lambda path: None))
    assert "empty" in refused(SimpleNamespace(points3D={}, read=lambda path: None))


def test_clouds_with_a_reader_of_their_class() -> None:
    # As pointcloudkit 0.1.0's, whose `PointCloud.read(path)` reads files: the cure was "pass what its read() returns".
    class Cloud:
        @staticmethod
        def read(path: str) -> None: ...

    class Built(Cloud):
        @classmethod
        def read(cls, path: str) -> None: ...

    for each in (Cloud(), Built()):
        assert "numpy.column_stack([x, y, z])" in refused(each)
        assert "read()" not in refused(each)


@pytest.mark.parametrize("error", [KeyError, ValueError, RuntimeError, TypeError])
def test_types_that_raise_another_error_for_what_they_lack(error: type[Exception]) -> None:
    # As pylas 0.4.3's clouds; the words were pylas's own, "no field of name prepared", and named no cloud.
    class Cloud:
        x, y, z = P.T

        def __getattr__(self, asked: str) -> Any:
            raise error(f"no field of name {asked}")

    told = refused(Cloud())
    assert f"it raises {error.__name__}, not AttributeError" in told
    assert "numpy.column_stack([x.x, x.y, x.z])" in told
    same(np.column_stack([Cloud.x, Cloud.y, Cloud.z]))


def test_dictionaries_whose_attributes_are_their_entries() -> None:
    # As configurations of networks often are; what such a one lacks was a KeyError of 'prepared'.
    class Entries(dict[str, Any]):
        __getattr__ = dict.__getitem__

    same(Entries(zip("xyz", P.T, strict=True)))
    same(Entries(points=P))
    with pytest.warns(UserWarning, match="0.001 m"):
        np.testing.assert_allclose(
            PointCloud.of(Entries(points=P * 1000, unit="mm"), name="target").points, P
        )


def test_groups_that_are_no_mappings() -> None:
    # As zarr 3.1's, whose arrays were names to numpy: "got dtype <U1".
    class Held(np.ndarray):
        attrs: Any = MappingProxyType({})

    class Group:
        def __init__(self, arrays: dict[str, Any], **attrs: Any) -> None:
            self.arrays, self.attrs = arrays, attrs

        def keys(self) -> Any:
            return self.arrays.keys()

        def __iter__(self) -> Any:
            return iter(self.arrays)

        def __len__(self) -> int:
            return len(self.arrays)

        def __getitem__(self, key: str) -> Any:
            return self.arrays[key]

    same(Group(dict(zip("xyz", P.T, strict=True))))
    same(Group({"points": P}))
    for group in (
        Group({"points": P * 1000}, units="mm"),
        Group(dict(zip("xyz", P.T * 1000, strict=True)), units="mm"),
    ):
        with pytest.warns(UserWarning, match="0.001 m"):
            np.testing.assert_allclose(PointCloud.of(group, name="target").points, P)
    counts = np.round(P.T * 1000).astype(np.int32)
    scaled = Group(dict(zip("xyz", (each.view(Held) for each in counts), strict=True)))
    for each in scaled.arrays.values():
        each.attrs = {"scale_factor": 0.001}
    assert "multiply them by it" in refused(scaled)
    assert "name the coordinates x, y and z" in refused(Group({"a": P[:, 0]}))


def test_epochs_of_py4dgeo() -> None:
    same(SimpleNamespace(cloud=P, normals=None))  # as py4dgeo 1.2.0 keeps them


def test_small_gicp_and_plyfile() -> None:
    small_gicp = pytest.importorskip("small_gicp")
    same(small_gicp.PointCloud(P))
    plyfile = pytest.importorskip("plyfile")
    element = plyfile.PlyElement.describe(record(("z", "f8"), ("y", "f8"), ("x", "f8")), "vertex")
    same(element)
    same(plyfile.PlyData([element]))


def test_a_column_of_lists(tmp_path: Any) -> None:
    pd, pl, pa = (pytest.importorskip(each) for each in ("pandas", "polars", "pyarrow"))
    same(pd.DataFrame({"time": P[:, 0], "xyz": list(P)}))
    same(pl.DataFrame({"xyz": P.tolist()}))
    same(pl.DataFrame({"points": P}))
    table = pa.table({"pts": pa.FixedSizeListArray.from_arrays(pa.array(P.ravel()), 3)})
    same(table)
    pytest.importorskip("pyarrow.parquet").write_table(table, tmp_path / "a.parquet")
    same(tmp_path / "a.parquet")
    assert "hold from 2 to 3 numbers" in refused(pd.DataFrame({"xyz": [*P[1:].tolist(), [1.0, 2.0]]}))
    assert "not finite" in refused(pa.table({"xyz": [*P[1:].tolist(), None]}))
    assert "name the coordinates" in refused(pl.DataFrame({"quaternion": [[0.0, 0.0, 0.0, 1.0]] * 60}))
    assert "something else than numbers" in refused(pd.DataFrame({"xyz": [["a", "b", "c"]] * 60}))
    assert "name the coordinates" in refused(pl.DataFrame({"p": [{"z": 1.0, "y": 2.0, "x": 3.0}] * 60}))


def test_arrays_x_y_and_z_of_an_archive(tmp_path: Any) -> None:
    np.savez(tmp_path / "a.npz", x=P[:, 0], y=P[:, 1], z=P[:, 2], time=P[:, 0], T=np.eye(4))
    same(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", cloud=record(("z", "f8"), ("y", "f8"), ("x", "f8")))
    same(tmp_path / "b.npz")


def test_vtk() -> None:
    core, data = (pytest.importorskip(f"vtkmodules.vtkCommon{each}") for each in ("Core", "DataModel"))
    convert = pytest.importorskip("vtkmodules.util.numpy_support").numpy_to_vtk
    points = core.vtkPoints()
    points.SetData(convert(P, deep=True))
    cloud = data.vtkPolyData()
    cloud.SetPoints(points)
    same(points)
    same(cloud)
    faces = data.vtkCellArray()
    faces.InsertNextCell(3)
    for corner in range(3):
        faces.InsertCellPoint(corner)
    cloud.SetPolys(faces)
    assert "x.GetPoints()" in refused(cloud)
    same(cloud.GetPoints())
    assert "empty" in refused(data.vtkPolyData())


def test_grids_of_vtk_are_clouds_where_their_cells_are_points_or_they_lie_in_rows() -> None:
    core, data = (pytest.importorskip(f"vtkmodules.vtkCommon{each}") for each in ("Core", "DataModel"))
    convert = pytest.importorskip("vtkmodules.util.numpy_support").numpy_to_vtk
    points = core.vtkPoints()
    points.SetData(convert(P, deep=True))
    loose, rows, volume = data.vtkUnstructuredGrid(), data.vtkStructuredGrid(), data.vtkStructuredGrid()
    for grid in (loose, rows, volume):
        grid.SetPoints(points)
    vertex, tetra = 1, 10  # VTK's numbers of these kinds of cells
    for k in range(len(P)):
        loose.InsertNextCell(vertex, 1, [k])
    rows.SetDimensions(len(P) // 2, 2, 1)
    volume.SetDimensions(len(P) // 4, 2, 2)
    same(loose)
    same(rows)
    loose.InsertNextCell(tetra, 4, [0, 1, 2, 3])
    image = data.vtkImageData()
    image.SetDimensions(5, 5, 5)
    for grid in (loose, volume, image):
        assert "a surface or a grid is not a cloud; save its surface as .vtp" in refused(grid)
    assert "give one of them" in refused(data.vtkMultiBlockDataSet())


def test_a_scene_of_clouds_alone() -> None:
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    place = trimesh.transformations.translation_matrix([10, 0, 0])
    scene.add_geometry(trimesh.PointCloud(P), transform=place)
    same(scene, P + [10, 0, 0])
    scene.add_geometry(trimesh.creation.box())
    assert "a scene is not a cloud" in refused(scene)


@pytest.mark.parametrize(
    "x, cure",
    [
        (P.astype(str), "astype(float)"),
        (P.astype(object), "astype(float)"),
        (P + 0j, "x.real"),
        (np.full((60, 3), "far"), "column_stack"),
        (P.ravel(), "reshape(-1, 3)"),
        (P[:, :2], "three coordinates"),
        (np.c_[P, P, P, P].T, "x[:3].T"),
        (b"abc", "frombuffer"),
        (io.BytesIO(b"ply"), "pass the path of the file"),
        (zip(*P.T, strict=True), "column_stack"),
        (object(), "column_stack"),
        (lambda: P, "column_stack"),
        ({"a": 1}, "name the coordinates"),
        (SimpleNamespace(read=lambda: P), "read()"),
        (memoryview(P.tobytes()), "reshape(-1, 3)"),
    ],
)
def test_refusals_name_a_cure(x: Any, cure: str) -> None:
    assert cure in refused(x)


def test_cures_of_arrays_work() -> None:
    same(P.astype(str).astype(float), P)
    same((P + 0j).real)
    same(P.ravel().reshape(-1, 3))
    same(np.c_[P, P, P, P].T[:3].T)
    same(memoryview(np.ascontiguousarray(P)))
