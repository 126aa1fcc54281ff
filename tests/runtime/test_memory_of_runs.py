# SPDX-License-Identifier: MIT
"""What a finished run has made is freed at once, not when the garbage collector comes."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest

import hybridreg as hr
from hybridreg.cli import main
from hybridreg.data import PairFolder
from hybridreg.eval import predict
from hybridreg.testing import sample_pair


@pytest.fixture
def no_collector() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


class Grid:
    """A downsample stage that remembers the levels it made, weakly."""

    def __init__(self) -> None:
        self._made: list[weakref.ref[hr.Level]] = []

    def __call__(self, pair: hr.Pair) -> hr.Scene:
        scene = hr.Scene.on_cells(pair, 0.5)
        self._made += [weakref.ref(scene.source), weakref.ref(scene.at(0.8).source)]
        return scene

    def left(self) -> list[hr.Level]:
        return [level for ref in self._made if (level := ref()) is not None]


@pytest.mark.usefixtures("no_collector")
def test_a_run_leaves_no_cycles() -> None:
    grid = Grid()
    pair, _ = sample_pair()
    pipe = hr.Pipeline(downsample=grid, match="none", estimate="birdseye", refine="gicp")
    result = pipe(pair.source, pair.target)
    assert len(grid._made) == 2
    assert not grid.left()
    assert result.found


@pytest.mark.usefixtures("no_collector")
def test_a_predicted_row_leaves_no_cycles(tmp_path: Path) -> None:
    demo = PairFolder(Path(str(hr.__path__[0])) / "data")
    grid = Grid()
    pipe = hr.Pipeline(downsample=grid, match="none", estimate="birdseye", refine="none")
    assert len(predict(pipe, demo, tmp_path / "rows.jsonl")) == 1
    assert grid._made
    assert not grid.left()


@pytest.mark.parametrize(("command", "usual"), [("list", False), ("table", True), ("batch", True)])
def test_only_short_commands_collect_seldom(command: str, usual: bool) -> None:
    before = gc.get_threshold()
    try:
        with pytest.raises(SystemExit):
            main([command, "--no-such-option"])
        assert (gc.get_threshold() == before) is usual
    finally:
        gc.set_threshold(*before)
