# SPDX-License-Identifier: MIT
"""Training beside another run, on a full disk, on data that changed, without shared memory."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import MakeRecipe, Run, environment, options, same, state, write_pair, write_recipe

from hybridreg.io.lock import InUse, folder_lock
from hybridreg.learned.training import checkpoint
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.curve_files import CurveFile
from hybridreg.learned.training.data import pair_source, samples
from hybridreg.learned.training.data.pair_source import open_source
from hybridreg.learned.training.data.preparing import prepare_all
from hybridreg.learned.training.data.tensor_cache import NotKept
from hybridreg.learned.training.recipe import Recipe, Source
from hybridreg.learned.training.resuming import tell_changed_data
from hybridreg.learned.training.training_run import train


def test_a_folder_in_which_another_trains_is_refused(whole: Run, cache: Path, tmp_path: Path) -> None:
    with (
        folder_lock(tmp_path),
        pytest.raises(InUse, match=f"{tmp_path} is being written by process {os.getpid()}"),
    ):
        train(whole.recipe, options(tmp_path, cache))
    with folder_lock(whole.out), pytest.raises(InUse):
        train(whole.recipe, options(whole.out, cache, resume=True))


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_sigterm_ends_with_143_and_says_how_to_go_on(
    whole: Run, content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    long = {**content, "phase": [{**content["phase"][0], "steps": 400}, content["phase"][1]]}
    recipe, out = write_recipe(tmp_path / "tiny.toml", long), tmp_path / "run"
    command = [
        sys.executable,
        "-m",
        "hybridreg",
        "train",
        str(recipe),
        "--out",
        str(out),
        "--cache",
        str(cache),
    ]
    process = subprocess.Popen(
        [*command, "--accelerator", "cpu"], env=environment(), stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 120.0
    while not (out / "checkpoint.pt").is_file():
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.terminate()
    _, told = process.communicate(timeout=120.0)
    assert process.returncode == 143
    assert told.splitlines()[-1] == f"hybridreg: stopped by SIGTERM; continue with --resume --out {out}"
    assert checkpoint.load(out / "checkpoint.pt")["progress"].total > 0


def full(*_: object) -> int:
    """Stands in for a system call of a full disk."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_in_the_cache_is_no_fault_of_the_pairs(
    make_recipe: MakeRecipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = make_recipe()
    source = open_source(recipe.data.train[0], recipe, tmp_path / "cache")
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(NotKept, match="No space left") as told:
            prepare_all(source, 1)
        assert str(told.value.filename).startswith(str(tmp_path / "cache"))
        assert len(source.load(0).features) > 0, "what is computed can be used all the same"
    assert prepare_all(source, 1).usable == (0, 1)


def test_a_full_disk_leaves_the_last_checkpoint_and_whole_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network, path = torch.nn.Linear(2, 2), tmp_path / "checkpoint.pt"
    checkpoint.save(path, Progress(total=1), network, None, {}, {"yards": "a"})
    curve = CurveFile(tmp_path / "log.csv", ("loss",))
    curve.begin(0)
    curve.append({"total": 1, "loss": 0.5})
    true_write = os.write
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left") as told:
            checkpoint.save(path, Progress(total=2), network, None, {})
        assert told.value.filename == str(path)
        patched.setattr(os, "write", lambda handle, data: true_write(handle, data[:2]))
        with pytest.raises(OSError, match="No space left") as told:
            curve.append({"total": 2, "loss": 0.5})
        assert told.value.filename == str(tmp_path / "log.csv")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["checkpoint.pt", "log.csv"]
    assert checkpoint.load(path)["progress"].total == 1
    curve.append({"total": 2, "loss": 0.25})
    assert [row["total"] for row in curve.rows()] == ["1", "2"]


def test_a_pair_that_changed_under_the_same_size_and_time_is_prepared_again(
    make_recipe: MakeRecipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe, root = make_recipe(), tmp_path / "pairs"
    for name in ("one", "two"):
        write_pair(root / name, 0)

    def opened() -> pair_source.PairSource:
        return open_source(Source(data=str(root)), recipe, tmp_path / "cache")

    before = prepare_all(opened(), 1)
    file = root / "one" / "source.npy"
    stat, data = file.stat(), bytearray(file.read_bytes())
    data[-9] ^= 0x10
    file.write_bytes(data)
    os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    after = opened()
    assert [after.is_prepared(index) for index in (0, 1)] == [False, True]
    assert after.content != before.content


def test_a_changed_source_is_told_when_a_run_goes_on(whole: Run, caplog: pytest.LogCaptureFixture) -> None:
    then = checkpoint.load(whole.out / "checkpoint.pt")["data"]
    assert list(then) == ["yards"]
    with caplog.at_level("WARNING"):
        tell_changed_data(then, then)
        tell_changed_data({}, then)
        assert not caplog.records
        tell_changed_data(then, {"yards": "other"})
    assert "the data of yards has changed since the checkpoint" in caplog.text


def test_samples_through_loaders_are_the_same_bits(
    whole: Run, make_recipe: MakeRecipe, content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    loaded = make_recipe(data={**content["data"], "loaders": 1})
    assert train(loaded, options(tmp_path, cache)) == tmp_path / "best"
    assert same(state(tmp_path), state(whole.out))


def test_where_no_process_can_be_started_samples_are_read_here(
    whole: Run, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true_loader = samples._loader
    refuse: Callable[..., Any] = lambda s, n, loaders: full() if loaders else true_loader(s, n, 0)  # noqa: E731
    monkeypatch.setattr(samples, "_loader", refuse)
    phase = phase_samples(whole.recipe, cache)
    with pytest.warns(UserWarning, match=r"no loaders can be started here .*No space left"):
        found = list(samples.stream(phase, [0, 1], 2))
    assert [sample.number for sample in found] == [0, 1]


def phase_samples(recipe: Recipe, cache: Path) -> samples.PhaseSamples:
    """Samples of the recipe's training source."""
    from hybridreg.learned.training.data.order import Order

    source = open_source(replace(recipe.data.train[0]), recipe, cache)
    return samples.PhaseSamples([source], Order([len(source)], [1.0], 4, (0, 0)), recipe.augmentation, (0, 0))
