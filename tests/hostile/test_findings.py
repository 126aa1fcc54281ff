# SPDX-License-Identifier: MIT
"""What fuzzing found, each refused in words or done right."""

from __future__ import annotations

import datetime
import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridreg as hr
from hybridreg import Pipeline, PointCloud, changes, registry, spec
from hybridreg.classical.overhead import sweep as sweep_module
from hybridreg.classical.overhead.overhead_columns import Columns, FromAbove
from hybridreg.data.loaders.folder import load_pair
from hybridreg.eval import stored_table, table_file
from hybridreg.eval.run.store import read
from hybridreg.geometry import se3
from hybridreg.io import read_points, write_json, write_points
from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.training import recipe_file
from hybridreg.stage import Stage
from hybridreg.testing import sample_pair
from tools.hostile.containers import contain
from tools.hostile.stored import FILES, StoredCase

POINTS = np.random.default_rng(0).uniform(-10.0, 10.0, (60, 3))


@pytest.mark.parametrize(
    ("container", "words"),
    [
        ("liar", "Liar: the device is gone"),
        ("bad array", "BadArray: the file behind this array was closed"),
        ("torch complex", "numbers, got dtype complex64"),
        ("open3d empty tensor", "the cloud is empty"),
    ],
)
def test_objects_that_fail_when_asked_for_points(container: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        PointCloud.of(contain(POINTS, container))


def test_sparse_tensors_are_read() -> None:
    assert np.array_equal(PointCloud.of(contain(POINTS, "torch sparse")).points, POINTS)


def test_bfloat16_tensors_are_read() -> None:
    cloud = PointCloud.of(contain(POINTS, "torch bfloat16"))
    assert np.allclose(cloud.points, POINTS, atol=0.05)


def test_a_name_that_no_file_can_have(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be looked up"):
        read_points(tmp_path / ("x" * 300 + ".ply"))


@pytest.mark.filterwarnings("error")
def test_a_grid_with_more_cells_than_a_float_holds() -> None:
    pair, _ = sample_pair(0, 200)
    with pytest.raises(ValueError, match="choose a larger voxel"):
        hr.VoxelGrid(voxel=1e-300)(pair)


@pytest.mark.parametrize("voxel", ["a", True, datetime.date(2024, 2, 29), [0.3], -1.0, float("nan")])
def test_a_voxel_that_is_no_length(voxel: Any) -> None:
    with pytest.raises(ValueError, match="voxel="):
        Pipeline(voxel=voxel)


@pytest.mark.parametrize("seed", [-1, 1.5, "a", True, None])
def test_a_seed_that_is_no_seed(seed: Any) -> None:
    pair, _ = sample_pair(0, 200)
    with pytest.raises(ValueError, match="seed="):
        Pipeline(match="none", estimate="identity", refine="none").run(pair, seed=seed)


@pytest.mark.parametrize(
    "text",
    ["x = " + "[" * 3000, "x = " + "9" * 5000, "= 1", "\ufeffvoxel = 1", "voxel = 0.3\nvoxel = 0.4"],
    ids=["deep", "digits", "no key", "mark", "twice"],
)
@pytest.mark.parametrize("reader", [Pipeline.load, table_file.read, recipe_file.read])
def test_text_that_is_no_toml(tmp_path: Path, reader: Any, text: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"mine\.toml: not a TOML file"):
        reader(path)


@pytest.mark.parametrize(
    ("stage", "words"),
    [
        ({"stage": "refine.icp", "iterations": "a"}, "'icp': iterations: expected a number, got 'a'"),
        ({"stage": "refine.icp", "iterations": 0.5}, "expected a whole number, got 0.5"),
        ({"stage": "refine.icp", "iterations": -1}, "iterations=-1 must be at least 1"),
        ({"stage": "refine.icp", "kind": ["point"]}, "expected one of 'point', 'plane'"),
        ({"stage": "refine.gicp", "max_distances": []}, "must be positive"),
        ({"stage": "refine.gicp", "neighbours": 0}, "at least 3"),
        ({"stage": "refine.kiss-icp", "sigma": -1.0}, "must be positive"),
        ({"stage": "estimate.kiss", "max_matches": -1}, "at least 3"),
        ({"stage": "estimate.birdseye", "layers": 3}, "expected a list"),
        ({"stage": "estimate.candidates", "of": 3}, "expected a list"),
        ({"stage": "downsample.random", "n_points": -5}, "at least 20"),
        ({"stage": "match.fpfh", "mutual": 1}, "expected true or false"),
        ({"stage": "match.fpfh", "radius": 10**400}, "below 1e308"),
    ],
)
def test_fields_of_a_stage_from_a_file(stage: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        spec.from_table(stage)


@pytest.mark.parametrize(
    ("slot", "name", "fields", "words"),
    [
        ("estimate", "ransac", {"iterations": 1.5}, "Ransac: iterations: expected a whole number, got 1.5"),
        ("estimate", "ransac", {"iterations": float("nan")}, "iterations: expected a whole number, got nan"),
        ("estimate", "ransac", {"iterations": "5"}, "iterations: expected a number, got '5'"),
        ("estimate", "candidates", {"of": ("birdseye",)}, r"of\[0\]: expected a table, got 'birdseye'"),
        ("estimate", "candidates", {"of": ({"estimate": 3},)}, "of: estimate: 3 is not a stage"),
        ("estimate", "candidates", {"refine": 3}, "refine: 3 is not a stage"),
        ("refine", "icp", {"max_distances": 1.0}, "max_distances: expected a list, got 1.0"),
        ("refine", "icp", {"kind": "line"}, "kind: expected one of 'point', 'plane', got 'line'"),
        ("match", "fpfh", {"mutual": "no"}, "mutual: expected true or false, got 'no'"),
        ("match", "fcgf", {"untrained": "False"}, "untrained: expected true or false, got 'False'"),
        ("match", "fcgf", {"voxel": -1, "untrained": True}, "voxel=-1.0 must be positive"),
        ("match", "fcgf", {"voxel": "x", "untrained": True}, "voxel: expected a number, got 'x'"),
        ("match", "fcgf", {"weights": 3}, "weights: expected a text, got 3"),
    ],
)
def test_fields_of_a_stage_made_in_python(slot: str, name: str, fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        registry.load(slot, name)(**fields)


def test_numbers_of_numpy_and_lists_become_pythons() -> None:
    made = hr.Ransac(iterations=np.int64(9), max_distance=np.float32(0.5), local_optimisation=np.bool_(True))
    assert made == hr.Ransac(iterations=9, max_distance=0.5, local_optimisation=True)
    assert type(made.iterations) is int
    assert type(hr.Ransac(confidence=1).confidence) is float
    assert hr.Icp(max_distances=[2, np.float64(1.0)]) == hr.Icp(max_distances=np.array([2.0, 1.0]))
    assert hr.Icp(max_distances=[2]).max_distances == (2.0,)


def test_annotations_of_other_peoples_stages_are_taken_at_their_word() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Mine(Stage):
        count: int | str = 1
        lacking: float = None  # type: ignore[assignment]
        rows: np.ndarray | None = None
        nested: hr.Icp = hr.Icp()  # noqa: RUF009
        anything: Any = "x"

    table = np.eye(3)
    made = Mine(count="all", rows=table, nested=hr.Icp(iterations=2))
    assert (made.count, made.rows is table, made.nested.iterations) == ("all", True, 2)
    with pytest.raises(ValueError, match="count"):
        Mine(count=1.5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "content",
    [
        {"row": 1.0},
        {"row": [3]},
        {"row": [{"name": 3}]},
        {"row": [{"preset": "icp"}], "seed": -1},
        {"row": [{"preset": "icp"}], "starts": "a"},
        {"row": [{"preset": "icp"}], "base": 7},
        {"row": [{"preset": "icp"}], "paper": {"source": "s", "data": "d", "columns": 1.0, "rows": {}}},
        {"row": [{"pipeline": 3}]},
        {"row": [{"voxel": datetime.date(2024, 2, 29)}]},
        {"sweep": -1},
    ],
)
def test_values_of_a_table_file(content: dict[str, Any]) -> None:
    with pytest.raises(ValueError):
        table_file.parse(content)


def test_fields_upon_a_number_replace_it() -> None:
    assert changes.merge({"voxel": 0.3}, {"voxel": {"a": 1}}) == {"voxel": {"a": 1}}


@pytest.mark.parametrize("content", [{"size": [0.5]}, {"omp": 3}, {"network": 3}])
def test_values_of_a_training_recipe(content: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"recipe\."):
        recipe_file.parse(content, name="mine")


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("backbone", "voxel", float("inf")),
        ("backbone", "voxel", 0.0),
        ("backbone", "init_dim", 0),
        ("backbone", "init_dim", 2**31),
        ("backbone", "kernel_points", 0),
        ("backbone", "kernel_points", 10**6),
        ("backbone", "fine_dim", -1),
        ("transformer", "hidden_dim", 10**6),
        ("transformer", "sigma_a", 0.0),
        ("transformer", "blocks", ["self"] * 1000),
        ("vgam", "repeats", 2**31),
        ("matching", "temperature", 0.0),
    ],
)
def test_a_network_that_no_machine_holds(part: str, key: str, value: Any) -> None:
    values = named_config("nano", omp=True, vgam=True).to_dict()
    values[part][key] = value
    with pytest.raises(ValueError, match=key):
        NetworkConfig.from_dict(values)


def test_a_device_that_torch_does_not_know() -> None:
    with pytest.raises(ValueError, match="device=''"):
        hr.Omp(untrained=True, device="").network()


@pytest.mark.parametrize("value", ["a", None, {"a": 1}, [[1, 2], [3]], 10**400])
def test_a_pose_without_numbers(value: Any) -> None:
    with pytest.raises(ValueError, match="T_target_source"):
        se3.check(value, "T_target_source")


@pytest.mark.filterwarnings("error")
def test_a_pose_of_huge_numbers() -> None:
    with pytest.raises(ValueError, match="not a rotation"):
        se3.check(np.diag([1e300, 1e300, 1e300, 1.0]))


def test_a_meta_file_that_is_nested_too_deeply(tmp_path: Path) -> None:
    for name in ("source.ply", "target.ply"):
        write_points(tmp_path / name, POINTS)
    (tmp_path / "meta.json").write_text("[" * 100_000)
    with pytest.raises(ValueError, match="not a JSON file"):
        load_pair(tmp_path)
    write_json(tmp_path / "meta.json", {"T_target_source": np.eye(4), "overlap": "much"})
    with pytest.raises(ValueError, match="overlap: expected a number, got 'much'"):
        load_pair(tmp_path)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("index", "0"),
        ("id", 7),
        ("T", [[1.0, 0.0], [0.0, 1.0]]),
        ("T_true", [["a"] * 4] * 4),
        ("moments", [[float("inf")] * 4] * 4),
        ("reasons", [[1]]),
        ("seconds", {"total": "long"}),
        ("error", ["text"]),
        ("mask", {"f1": None}),
        ("offsets", {"source": 3}),
    ],
)
def test_a_row_with_a_value_of_another_kind(tmp_path: Path, field: str, value: Any) -> None:
    header, *lines = StoredCase(file=FILES[0], line=0).content().decode().splitlines()
    row = {**json.loads(lines[0]), field: value}
    path = tmp_path / "p.jsonl"
    path.write_text("\n".join([header, json.dumps(row)]) + "\n")
    with pytest.raises(ValueError, match=rf"line 2: not a row of predictions.*{field}"):
        read(path)


@pytest.mark.parametrize("noise", ["null", "[" * 100_000, '{"format": "hybridreg predictions 1"}', "{}"])
@pytest.mark.parametrize("file", FILES[:2])
def test_stored_files_that_are_none(file: str, noise: str) -> None:
    with pytest.raises(ValueError):
        StoredCase(file=file, line=0, noise=noise).run()


def test_a_table_without_a_row_yet(tmp_path: Path) -> None:
    whole = StoredCase(file=FILES[0], line=0).content()
    (tmp_path / "p.jsonl").write_bytes(whole[: whole.index(b"\n") + 1])
    with pytest.raises(ValueError, match="no rows yet"):
        stored_table.of_files([tmp_path / "p.jsonl"])


@pytest.mark.filterwarnings("error")
def test_poses_beyond_any_world_are_no_rows(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"line 2: not a row of predictions: T: the last row"):
        stored_table.of_files([_with_pose(tmp_path, np.full((4, 4), 1e300).tolist())])
    far = np.eye(4)
    far[:3, 3] = 1e300
    whole = stored_table.of_files([_with_pose(tmp_path, far.tolist())])
    assert whole.scores(hr.eval.protocol("cross3dreg"))["p"].recall < 1.0


def _with_pose(folder: Path, T: Any) -> Path:
    header, *lines = StoredCase(file=FILES[0], line=0).content().decode().splitlines()
    rows = [json.dumps({**json.loads(line), "T": T}) for line in lines]
    path = folder / "p.jsonl"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.filterwarnings("ignore::UserWarning")  # the library's advice on the unit
def test_kiss_matcher_is_not_asked_for_voxels_that_it_refuses() -> None:
    pair, truth = sample_pair(0, 300)
    small = hr.Pair.of(pair.source.points * 1e-3, pair.target.points * 1e-3)
    found = Pipeline(match="none", estimate="kiss", refine="none").run(small)
    assert "KISS-Matcher found no pose" in " ".join(found.notes) or np.allclose(
        found.transformation[:3, :3], truth[:3, :3], atol=0.1
    )


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_birdseye_on_a_cloud_with_nothing_about_its_middle() -> None:
    pair, _ = sample_pair(0, 300)
    halves = pair.source.points.copy()
    halves[len(halves) // 2 :] += 1e5
    pipeline = Pipeline(match="none", estimate="birdseye", refine="none")
    assert pipeline(halves, pair.target.points).verdict == "failed"


def test_an_archive_that_unpacks_to_what_no_cloud_is(tmp_path: Path) -> None:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (2**24, 3)}
    )
    with (
        zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("xyz.npy", "w", force_zip64=True) as member,
    ):
        member.write(header.getvalue())
        for _ in range(24):
            member.write(bytes(2**24))
    with pytest.raises(ValueError, match="would unpack from .* as no cloud does"):
        read_points(tmp_path / "bomb.npz")


def test_birdseye_maps_do_not_grow_with_the_distance_from_the_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    # A shift keeps the sensor's place out of reach, so both runs take the clouds' middles for it.
    pair, _ = sample_pair(0, 300)
    cells: list[int] = []
    whole = sweep_module.signed
    monkeypatch.setattr(
        sweep_module, "signed", lambda view, turn, n, cell: cells.append(n) or whole(view, turn, n, cell)
    )
    pipeline = Pipeline(match="none", estimate="birdseye", refine="none")
    for away in ([900.0, 400.0, 0.0], [9000.0, 4000.0, 0.0]):
        pipeline(pair.source.points + away, pair.target.points + away)
    assert 0 < max(cells) <= sweep_module._LONGEST


def test_a_sweep_refuses_maps_that_would_not_fit() -> None:
    far = Columns(np.array([9000.0 + 4000.0j]), np.array([0]))
    view = FromAbove(far, far, 1)
    with pytest.raises(ValueError, match="move each cloud's sensor"):
        sweep_module.sweep(view, view, cell=1.0, yaws=np.zeros(1), farthest=10.0, most=1, share=0.5)
