# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
import pickle
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from eval_stubs import Moody, RowByRow, Scattered, kabsch

from hybridreg.cloud import PointCloud
from hybridreg.config.changed_settings import differences
from hybridreg.eval import predict, protocol, read, score
from hybridreg.eval.score import metrics
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair, Pair

KITTI = protocol("kitti")


def test_rows_hold_the_truth_and_all_that_scoring_needs(tmp_path: Path) -> None:
    pairs = Scattered()
    rows = predict(RowByRow(slip=3.0), pairs, tmp_path / "p.jsonl", seed=5)
    assert [row.id for row in rows] == list(pairs.ids)
    for row, labelled in zip(rows, pairs, strict=True):
        assert np.allclose(row.T_true, labelled.T_target_source)
        assert metrics.rte_m(np.array(row.T), labelled.T_target_source) == pytest.approx(3.0)
        assert metrics.rte_m(np.array(row.T_estimated), labelled.T_target_source) < 1e-9
        assert row.n_matches == 200
        assert row.inlier_ratio is not None
        assert row.inlier_ratio["1"] == 1.0
        assert row.n_points == {"source": 400, "target": 200, "source_level": 400, "target_level": 200}
        assert row.mask == pytest.approx({"precision": 1.0, "recall": 1.0, "f1": 1.0, "iou": 1.0}, abs=0.25)
        assert row.overlap == pytest.approx(0.5, abs=0.05)
        assert (row.verdict, row.reasons) == ("ok", ["rows agree"])
        assert row.evidence["fitness"] == 0.5
        assert row.evidence["violations"] is None
        assert set(row.seconds) == {"match", "estimate", "total"}
    s = score(rows, KITTI)
    assert (s.recall, s.recall_estimated, s.inlier_ratio) == (0.0, 1.0, 1.0)


def test_what_is_read_back_is_what_was_returned(tmp_path: Path) -> None:
    for method in (Moody(), RowByRow()):
        rows = predict(method, Scattered(5), tmp_path / f"{type(method).__name__}.jsonl")
        assert read(tmp_path / f"{type(method).__name__}.jsonl").rows == rows


def test_every_failure_is_a_row(tmp_path: Path) -> None:
    rows = predict(Moody(), Scattered(6, broken=(5,)), tmp_path / "p.jsonl")
    right, raised, none, nan, wrong, lost = rows
    assert right.T is not None
    assert np.array_equal(wrong.T, np.eye(4))
    assert raised.error == "RuntimeError: pair-1 is beyond me"
    assert (none.T, none.error) == (None, None)
    assert nan.T is None
    assert "the method's answer: the matrix is not finite" in str(nan.error)
    assert raised.T_true is not None
    assert lost.error == "OSError: pair-5: the disk is gone"
    assert lost.T_true is None
    s = score(rows, KITTI)
    assert (s.n, s.n_failed, s.recall) == (6, 4, pytest.approx(1 / 6))


def test_a_pose_that_was_not_found_is_none_not_the_identity(tmp_path: Path) -> None:
    rows = predict(RowByRow(found=False), Scattered(2), tmp_path / "p.jsonl")
    assert all(row.T is None and row.T_estimated is None for row in rows)


def _bent(pair: Pair, seed: int, by: Any) -> Any:
    return kabsch(pair.source.points[:200], pair.target.points) @ by


def _answer(pair: Pair, seed: int, what: Any) -> Any:
    return what


def _as_open3d(pair: Pair, seed: int) -> Any:
    return SimpleNamespace(transformation=kabsch(pair.source.points[:200], pair.target.points))


@pytest.mark.parametrize(
    "by",
    [
        np.diag([3.0, 3.0, 3.0, 1.0]),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [9, 9, 9, 5]]),
        np.array([[1.0, 0.3, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
    ],
)
def test_a_pose_that_is_no_rigid_motion_is_no_success(tmp_path: Path, by: np.ndarray) -> None:
    rows = predict(partial(_bent, by=by), Scattered(2), tmp_path / "p.jsonl")
    assert all(
        row.T is None and str(row.error).startswith("ValueError: the method's answer: ") for row in rows
    )
    assert score(rows, KITTI).recall == 0.0


@pytest.mark.parametrize(
    ("what", "told"),
    [
        (np.eye(4)[:3], "expected shape (4, 4), got (3, 4)"),
        ("right there", "expected numbers of shape (4, 4)"),
        ((np.eye(3), np.zeros(3)), "expected numbers of shape (4, 4)"),
        (b"4x4", "expected numbers of shape (4, 4)"),
    ],
)
def test_an_answer_of_another_form_is_named(tmp_path: Path, what: Any, told: str) -> None:
    (row,) = predict(partial(_answer, what=what), Scattered(1), tmp_path / "p.jsonl")
    assert told in str(row.error)
    assert "a method returns a rigid 4x4 pose" in str(row.error)


def test_a_result_with_a_transformation_is_taken_as_open3d_gives_it(tmp_path: Path) -> None:
    assert score(predict(_as_open3d, Scattered(2), tmp_path / "p.jsonl"), KITTI).recall == 1.0


def test_a_result_without_a_pose_is_no_success_though_the_identity_would_be(tmp_path: Path) -> None:
    near = Near(1)
    rows = predict(partial(_run, RowByRow(found=False)), near, tmp_path / "p.jsonl")
    assert (rows[0].T, rows[0].verdict, rows[0].error) == (None, "ok", None)
    assert score(rows, KITTI).recall == 0.0


def _run(method: RowByRow, pair: Pair, seed: int) -> Any:
    return replace(method.conclude(method.trace(pair)), found=method.found)


class Near(Scattered):
    """Pairs whose clouds lie as they are."""

    def load(self, index: int) -> LabelledPair:
        labelled = super().load(index)
        target = PointCloud.of(labelled.pair.source.points[:200])
        return replace(labelled, pair=labelled.pair.replaced(target=target), T_target_source=np.eye(4))


@pytest.mark.parametrize(
    ("method", "told"),
    [
        ("birdseye-gicp", r"Pipeline\.preset\('birdseye-gicp'\)"),
        (lambda pair: np.eye(4), "too many positional arguments"),
        (None, "expected a pipeline or a function"),
        (RowByRow, "expected a pipeline or a function"),
    ],
)
def test_what_no_pair_could_be_given_to_is_refused(tmp_path: Path, method: Any, told: str) -> None:
    with pytest.raises(TypeError, match=told):
        predict(method, Scattered(1), tmp_path / "p.jsonl")
    assert not (tmp_path / "p.jsonl").exists()


def test_a_negative_seed_is_refused_before_any_pair(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"seed=-1 must be a whole number"):
        predict(RowByRow(), Scattered(1), tmp_path / "p.jsonl", seed=-1)
    assert not (tmp_path / "p.jsonl").exists()


def test_a_stored_pose_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.jsonl"
    predict(RowByRow(), Scattered(1), path)
    header, line = path.read_text().splitlines()
    row = json.loads(line)
    row["T"][0][0] *= 3.0
    path.write_text(f"{header}\n{json.dumps(row)}\n")
    with pytest.raises(ValueError, match=r"T: the upper left 3x3 block is not a rotation"):
        read(path)


def test_stops_and_goes_on_without_doing_a_pair_twice(tmp_path: Path) -> None:
    log, path = tmp_path / "log", tmp_path / "p.jsonl"
    method = Moody(moods=("right",), log=str(log))

    def stop_after_two(row: Any) -> None:
        if row.index == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        predict(method, Scattered(5), path, on_row=stop_after_two)
    assert len(read(path).rows) == 2
    rows = predict(method, Scattered(5), path)
    assert [row.id for row in rows] == [f"pair-{i}" for i in range(5)]
    assert [line.split()[0] for line in log.read_text().splitlines()] == [f"pair-{i}" for i in range(5)]


@pytest.mark.parametrize("cut", [1, 40, 300])
def test_half_a_last_line_is_ignored_and_written_again(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "p.jsonl"
    whole = predict(RowByRow(), Scattered(3), path)
    path.write_bytes(path.read_bytes()[:-cut])
    assert len(read(path).rows) == 2
    again = predict(RowByRow(), Scattered(3), path)
    assert [row.timeless for row in again] == [row.timeless for row in whole]
    assert len(path.read_text().splitlines()) == 4
    assert all(json.loads(line) for line in path.read_text().splitlines())


def test_half_a_header_is_begun_anew(tmp_path: Path) -> None:
    path = tmp_path / "p.jsonl"
    predict(RowByRow(), Scattered(2), path)
    path.write_bytes(path.read_bytes()[:25])
    assert len(predict(RowByRow(), Scattered(2), path)) == 2


@pytest.mark.parametrize("content", ["my notes", "my notes\n", '{"a": 1}\n', "\x80"])
def test_another_kind_of_file_is_left_alone(tmp_path: Path, content: str) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(ValueError, match="not a file of predictions"):
        predict(RowByRow(), Scattered(2), path)
    assert path.read_bytes() == content.encode("latin-1")


def test_a_broken_line_in_the_middle_is_named(tmp_path: Path) -> None:
    path = tmp_path / "p.jsonl"
    predict(RowByRow(), Scattered(3), path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:2], '{"index": 1, "colour": "red"}\n', *lines[3:]]))
    with pytest.raises(ValueError, match=r"line 3.*colour"):
        read(path)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"method": RowByRow(slip=0.5)}, "method.estimate.slip: 0.0 before, 0.5 now"),
        ({"seed": 1}, "seed: 0 before, 1 now"),
        ({"pairs": Scattered(3)}, "data.pairs: 2 before, 3 now"),
    ],
)
def test_a_changed_configuration_is_refused_and_named(
    tmp_path: Path, change: dict[str, Any], told: str
) -> None:
    path = tmp_path / "p.jsonl"
    first = {"method": RowByRow(), "pairs": Scattered(2), "seed": 0, "data": ""}

    def run(overwrite: bool = False, **given: Any) -> list[Any]:
        return predict(given.pop("method"), given.pop("pairs"), path, overwrite=overwrite, **given)

    run(**first)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="overwrite=True") as refused:
        run(**{**first, **change})
    assert told in str(refused.value)
    assert path.read_bytes() == before
    run(overwrite=True, **{**first, **change})
    run(**{**first, **change})


def test_rows_belong_to_the_content_of_the_data_not_to_its_name(tmp_path: Path) -> None:
    rows = predict(RowByRow(), Scattered(2), tmp_path / "p.jsonl", data="pairs")
    assert predict(RowByRow(), Scattered(2), tmp_path / "p.jsonl", data="./pairs/") == rows


def test_rows_of_another_version_are_not_mixed_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    predict(RowByRow(), Scattered(2), tmp_path / "p.jsonl")
    monkeypatch.setattr("hybridreg.eval.run.prediction.__version__", "99.0")
    with pytest.raises(ValueError, match=r'version: ".*" before, "99\.0" now'):
        predict(RowByRow(), Scattered(2), tmp_path / "p.jsonl")


def test_differences_name_every_leaf() -> None:
    old, new = {"a": {"b": 1, "c": [1]}, "d": 2}, {"a": {"b": 1, "c": [2]}, "e": "x"}
    assert list(differences(old, new)) == [
        "a.c: [1] before, [2] now", "d: 2 before, unset now", 'e: unset before, "x" now',
    ]  # fmt: skip


class Peeking:
    """Keeps everything it is handed."""

    def __init__(self) -> None:
        self.seen: list[Pair] = []

    def __call__(self, pair: Pair, seed: int) -> np.ndarray:
        self.seen.append(pair)
        return np.eye(4)


def test_no_truth_reaches_the_method(tmp_path: Path) -> None:
    spy = Peeking()
    predict(spy, Scattered(2), tmp_path / "p.jsonl")
    truths = [labelled.T_target_source for labelled in Scattered(2)]
    for pair, T in zip(spy.seen, truths, strict=True):
        assert not hasattr(pair, "T_target_source")
        stored = pickle.dumps(pair)
        assert not any(np.ascontiguousarray(part).tobytes() in stored for part in (T, T[:3, :3], T[:3, 3]))


def test_map_coordinates_do_not_blow_up_the_errors(tmp_path: Path) -> None:
    far = Scattered(2, offset=5e6)
    rows = predict(RowByRow(slip=0.25), far, tmp_path / "p.jsonl")
    for row, labelled in zip(rows, far, strict=True):
        assert row.offsets is not None
        assert metrics.rte_m(np.array(row.T), np.array(row.T_true)) == pytest.approx(0.25, abs=1e-5)
        assert np.allclose(row.T_true, lower_pose(labelled.T_target_source, labelled.pair), atol=1e-6)
    moved = se3.inverse(np.array(rows[0].T_true)) @ np.array(rows[0].T)
    assert se3.angle_deg(moved[:3, :3]) < 1e-5


def test_predictions_that_are_not_there_are_told_as_such(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"row.jsonl: no file of predictions; run `hybridreg eval`"):
        read(tmp_path / "row.jsonl")
