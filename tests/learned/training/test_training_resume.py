# SPDX-License-Identifier: MIT
"""A run that was killed or stopped goes on as if nothing had happened."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from training_runs import MakeRecipe, Run, environment, log, options, same, state, write_recipe

from hybridreg.learned.training import checkpoint
from hybridreg.learned.training.steps import forward_pass
from hybridreg.learned.training.steps.objective import Outcome
from hybridreg.learned.training.training_run import train


def killed_after(lines: int, recipe: Path, out: Path, cache: Path) -> int:
    """Start a run in a process of its own, kill it at that line of its log; how many steps it saved."""
    command = [sys.executable, "-m", "hybridreg", "train", recipe, "--out", out, "--cache", cache]
    process = subprocess.Popen(
        [*map(str, command), "--accelerator", "cpu"], env=environment(), stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + 240.0
    while not (out / "log.csv").is_file() or len(log(out)) < lines:
        assert process.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    saved: int = checkpoint.load(out / "checkpoint.pt")["progress"].total
    return saved


def test_killed_and_resumed_equals_unbroken(
    whole: Run, content: dict[str, Any], cache: Path, tmp_path: Path
) -> None:
    # Line 2 is the warm-up's last step: the kill falls into the second phase or just before it.
    out = tmp_path / "run"
    saved = killed_after(2, write_recipe(tmp_path / "tiny.toml", content), out, cache)
    assert 0 < saved < 8
    before = log(out)
    assert train(whole.recipe, options(out, cache, resume=True)) == out / "best"
    assert same(state(out), state(whole.out))
    assert log(out) == log(whole.out)
    assert log(out)[: len(before)] == before
    assert log(out, "validation.csv") == log(whole.out, "validation.csv")
    for folder in ("best", "last"):
        weights = [run / folder / "model.safetensors" for run in (out, whole.out)]
        assert weights[0].read_bytes() == weights[1].read_bytes()


def on_call(number: int, do: Callable[[], None]) -> Callable[..., Outcome]:
    """The objective, which does something else too when it is called for the so manieth time."""
    calls = 0

    def called(*arguments: Any) -> Outcome:
        nonlocal calls
        calls += 1
        if calls == number:
            do()
        return true_objective(*arguments)

    true_objective = forward_pass.objective
    return called


def test_sigterm_finishes_the_step_and_saves(
    whole: Run, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = signal.getsignal(signal.SIGTERM)
    with monkeypatch.context() as patched:
        patched.setattr(forward_pass, "objective", on_call(5, lambda: signal.raise_signal(signal.SIGTERM)))
        assert train(whole.recipe, options(tmp_path / "run", cache)) is None
    assert signal.getsignal(signal.SIGTERM) == before
    progress = checkpoint.load(tmp_path / "run" / "checkpoint.pt")["progress"]
    # The fifth call belongs to the fifth step, the first of the second phase.
    assert (progress.phase, progress.step, progress.total) == (1, 1, 5)
    train(whole.recipe, options(tmp_path / "run", cache, resume=True))
    assert same(state(tmp_path / "run"), state(whole.out))
    assert log(tmp_path / "run") == log(whole.out)


def test_a_second_signal_ends_at_once(
    whole: Run, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def twice() -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(forward_pass, "objective", on_call(2, twice))
    with pytest.raises(KeyboardInterrupt):
        train(whole.recipe, options(tmp_path, cache))


def test_a_folder_that_holds_a_run_is_not_run_over(whole: Run, cache: Path) -> None:
    with pytest.raises(FileExistsError, match="already holds a run: continue with --resume"):
        train(whole.recipe, options(whole.out, cache))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"seed": 4}, "another seed"),
        ({"infonce": {"anchors": 65}}, "another infonce"),
        ({"augmentation": {"shift": 1.0}, "clip": 2.0}, "another augmentation, clip"),
    ],
)
def test_another_recipe_is_not_resumed(
    whole: Run, make_recipe: MakeRecipe, cache: Path, changes: dict[str, Any], named: str
) -> None:
    with pytest.raises(ValueError, match=f"{named}; resume with its own recipe"):
        train(make_recipe(**changes), options(whole.out, cache, resume=True))


def test_nothing_and_damage_are_not_resumed(whole: Run, cache: Path, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no checkpoint to resume from"):
        train(whole.recipe, options(tmp_path, cache, resume=True))
    content = (whole.out / "checkpoint.pt").read_bytes()
    (tmp_path / "checkpoint.pt").write_bytes(content[: len(content) // 2])
    with pytest.raises(ValueError, match="is damaged"):
        train(whole.recipe, options(tmp_path, cache, resume=True))
