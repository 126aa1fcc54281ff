# SPDX-License-Identifier: MIT
"""Two processes do what one does with two pairs a step."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import WARM_UP, environment, log, options, state, write_recipe

from hybridreg.learned.training import recipe_file
from hybridreg.learned.training.processes import start_processes
from hybridreg.learned.training.training_run import train


def test_two_gloo_processes_equal_one(content: dict[str, Any], cache: Path, tmp_path: Path) -> None:
    phase = {"accumulate": 2, "rate": 1e-3}
    short = {
        **content,
        "data": {"train": content["data"]["train"]},
        "log_every": 1,
        "phase": [
            {**phase, "name": "warm-up", "steps": 1, "losses": WARM_UP},
            {**phase, "name": "matching", "steps": 2},
        ],
    }
    file = write_recipe(tmp_path / "short.toml", short)
    several = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"]
    several += ["-m", "hybridreg", "train", str(file), "--accelerator", "cpu"]
    several += ["--out", str(tmp_path / "two"), "--cache", str(cache)]
    done = subprocess.run(several, env=environment(), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    train(recipe_file.read(file), options(tmp_path / "one", cache))
    one, two = state(tmp_path / "one"), state(tmp_path / "two")
    start = state_of_a_fresh_network(file)
    moved = max(float((one[name] - start[name]).abs().max()) for name in one if one[name].is_floating_point())
    apart = max(float((one[name] - two[name]).abs().max()) for name in one if one[name].is_floating_point())
    assert moved > 1e-3
    assert apart < 0.01 * moved
    # Every figure of the log is the mean over both processes' pairs, not over the first one's.
    for mine, theirs in zip(log(tmp_path / "one"), log(tmp_path / "two"), strict=True):
        numbers = {name: float(value) for name, value in mine.items() if value and name != "phase"}
        assert numbers == pytest.approx({name: float(theirs[name]) for name in numbers}, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("cards", "expected"), [(0, None), (1, [0, 0, 0]), (2, [0, 1, 0]), (3, None), (4, None)]
)
def test_more_processes_than_cards_share_them(
    cards: int, expected: list[int] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    class Fabric:
        def __init__(self, **given: Any) -> None:
            asked.update(given)

        def launch(self) -> None:
            pass

    monkeypatch.setattr("lightning_fabric.Fabric", Fabric)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: cards)
    monkeypatch.setenv("LOCAL_WORLD_SIZE", "3")
    monkeypatch.setenv("WORLD_SIZE", "3")
    start_processes(1, "auto", "32-true")
    if expected is None:
        assert asked["strategy"].parallel_devices is None
        assert asked["devices"] == 3
    else:
        assert [device.index for device in asked["strategy"].parallel_devices] == expected
        assert asked["strategy"]._process_group_backend == "gloo"
        assert asked["devices"] == "auto"


def state_of_a_fresh_network(file: Path) -> dict[str, torch.Tensor]:
    """Where both runs began."""
    from hybridreg.learned.training.initial_weights import first_network

    return first_network(recipe_file.read(file)).state_dict()
