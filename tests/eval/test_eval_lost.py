# SPDX-License-Identifier: MIT
"""Rows that are done stay: full disks, deleted files, two writers, clocks that jump, data that changes."""

from __future__ import annotations

import errno
import json
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eval_stubs import Moody, RowByRow, Scattered

from hybridreg import testing
from hybridreg.data import content, open_dataset, yaw_starts
from hybridreg.eval import predict, read
from hybridreg.eval.run.prediction import weights_of
from hybridreg.io.lock import InUse, file_lock

RIGHT = Moody(moods=("right",))


def interrupt_at(number: int, do: Callable[[], None]) -> Callable[[Any], None]:
    """Heard with each row; does something at one of them."""
    return lambda row: do() if row.index == number else None


def test_a_file_that_is_being_written_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.jsonl"

    def second() -> None:
        for overwrite in (False, True):
            with pytest.raises(InUse, match=f"p.jsonl is being written by process {os.getpid()}"):
                predict(RIGHT, Scattered(3), path, overwrite=overwrite)

    rows = predict(RIGHT, Scattered(3), path, on_row=interrupt_at(1, second))
    assert read(path).rows == rows
    assert [file.name for file in tmp_path.iterdir()] == ["p.jsonl"]


def test_a_finished_file_is_read_while_it_is_locked(tmp_path: Path) -> None:
    path = tmp_path / "p.jsonl"
    rows = predict(RIGHT, Scattered(2), path)
    with file_lock(path):
        assert predict(RIGHT, Scattered(2), path) == rows


@pytest.mark.parametrize("what", ["file", "folder"])
@pytest.mark.parametrize("number", [1, 4])
def test_a_deleted_file_is_made_again(tmp_path: Path, what: str, number: int) -> None:
    path = tmp_path / "run" / "p.jsonl"

    def delete() -> None:
        if what == "file":
            path.unlink()
        else:
            shutil.rmtree(path.parent)

    with pytest.warns(UserWarning, match=r"p\.jsonl was deleted while it was being written"):
        rows = predict(RIGHT, Scattered(5), path, on_row=interrupt_at(number, delete))
    assert len(rows) == 5
    assert read(path).rows == rows
    assert [file.name for file in path.parent.iterdir()] == ["p.jsonl"]


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From then on half of what is written fits, and nothing after it."""

    def fill() -> None:
        true_write, calls = os.write, []

        def write(handle: int, data: bytes) -> int:
            calls.append(handle)
            if len(calls) > 1:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return true_write(handle, data[: len(data) // 2])

        monkeypatch.setattr(os, "write", write)

    return fill


def test_a_full_disk_is_named_and_leaves_whole_rows(
    tmp_path: Path, full_disk: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "p.jsonl"
    with pytest.raises(OSError, match="No space left") as told:
        predict(RIGHT, Scattered(4), path, on_row=interrupt_at(1, full_disk))
    assert told.value.filename == str(path)
    assert path.read_bytes().endswith(b"\n")
    assert len(read(path).rows) == 2
    monkeypatch.undo()
    assert len(predict(RIGHT, Scattered(4), path)) == 4


def test_a_clock_that_goes_back_between_rows_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [2e9]

    def jump() -> float:
        now[0] -= 1e6
        return now[0]

    whole = predict(RowByRow(), Scattered(4), tmp_path / "whole.jsonl")
    monkeypatch.setattr(time, "time", jump)
    monkeypatch.setattr(time, "time_ns", lambda: int(jump() * 1e9))
    predict(RowByRow(), Scattered(4), tmp_path / "p.jsonl")
    rows = predict(RowByRow(), Scattered(4), tmp_path / "p.jsonl")
    assert [row.timeless for row in rows] == [row.timeless for row in whole]


def write_pairs(root: Path, n: int = 2) -> Path:
    """A folder of pairs."""
    for seed in range(n):
        pair, T = testing.sample_pair(seed, 300)
        (root / f"p-{seed}").mkdir(parents=True)
        np.save(root / f"p-{seed}" / "source.npy", pair.source.points)
        np.save(root / f"p-{seed}" / "target.npy", pair.target.points)
        (root / f"p-{seed}" / "meta.json").write_text(json.dumps({"T_target_source": T.tolist()}))
    return root


def change_keeping_looks(file: Path) -> None:
    """Another content of the same size, under the same time of writing."""
    stat = file.stat()
    data = bytearray(file.read_bytes())
    data[-2] ^= 0x10
    file.write_bytes(data)
    os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))


@pytest.mark.parametrize("name", ["p-0/source.npy", "p-1/target.npy", "p-1/meta.json"])
@pytest.mark.parametrize("starts", [0, 1])
def test_data_that_changed_under_the_same_size_and_time_is_refused(
    tmp_path: Path, name: str, starts: int
) -> None:
    root = write_pairs(tmp_path / "data")

    def pairs() -> Any:
        return yaw_starts(open_dataset(root), starts, 0) if starts else open_dataset(root)

    predict(RIGHT, pairs(), tmp_path / "p.jsonl")
    file = root / name
    if name.endswith("json"):
        text = file.read_text()
        file.write_text(text.replace("0.", "1.", 1) if "0." in text else text.replace("0", "1", 1))
    else:
        change_keeping_looks(file)
    with pytest.raises(ValueError, match=r"data\.fingerprint: .*; pass overwrite=True"):
        predict(RIGHT, pairs(), tmp_path / "p.jsonl")
    assert len(predict(RIGHT, pairs(), tmp_path / "p.jsonl", overwrite=True)) == 2 * (starts + 1)


def test_data_that_was_only_touched_or_copied_is_the_same(tmp_path: Path) -> None:
    root = write_pairs(tmp_path / "data")
    before = predict(RIGHT, open_dataset(root), tmp_path / "p.jsonl")
    for file in root.rglob("*.npy"):
        file.touch()
    assert predict(RIGHT, open_dataset(root), tmp_path / "p.jsonl") == before
    shutil.copytree(root, tmp_path / "copy")
    assert predict(RIGHT, open_dataset(tmp_path / "copy"), tmp_path / "p.jsonl") == before


def test_files_that_look_the_same_are_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write_pairs(tmp_path / "data")
    monkeypatch.setattr(content, "_YOUNG_NS", -(10**12))
    before = predict(RIGHT, open_dataset(root), tmp_path / "p.jsonl")
    monkeypatch.setattr(content, "_KNOWN", {})  # as in a process of its own
    monkeypatch.setattr(content, "_hash", lambda _: pytest.fail("read again"))
    assert predict(RIGHT, open_dataset(root), tmp_path / "p.jsonl") == before


def test_hashes_are_kept_for_the_next_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(content, "_YOUNG_NS", -(10**12))
    file, notes = tmp_path / "a", tmp_path / "notes" / "contents.json"
    file.write_bytes(b"one")
    monkeypatch.setattr(content, "_KNOWN", {})
    with content.kept_in(notes):
        first = content.digest(file)
    monkeypatch.setattr(content, "_KNOWN", {})
    with monkeypatch.context() as patched, content.kept_in(notes):
        patched.setattr(content, "_hash", lambda _: pytest.fail("read again"))
        assert content.digest(file) == first
    for damaged in ("", "[]", '{"a": 1}', "{"):
        notes.write_text(damaged)
        monkeypatch.setattr(content, "_KNOWN", {})
        with content.kept_in(notes):
            assert content.digest(file) == first
    change_keeping_looks(file)
    assert content.digest(file) != first, "the time of the change cannot be set back"


def test_an_unreadable_file_does_not_end_the_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write_pairs(tmp_path / "data")

    def unreadable(path: str) -> str:
        raise OSError(errno.EIO, os.strerror(errno.EIO), path)

    monkeypatch.setattr(content, "_hash", unreadable)
    assert len(predict(RIGHT, open_dataset(root), tmp_path / "p.jsonl")) == 2


def test_weights_of_ones_own_are_told_by_their_content(tmp_path: Path) -> None:
    folder = tmp_path / "best"
    folder.mkdir()
    (folder / "config.json").write_text("{}")
    (folder / "model.safetensors").write_bytes(b"one")
    spec = {"match": {"stage": "vgam", "weights": str(folder)}, "of": [{"overlap": {"weights": "shipped"}}]}
    first = weights_of(spec)
    assert list(first) == [str(folder)]
    (folder / "model.safetensors").write_bytes(b"two")
    assert weights_of(spec) != first
