# SPDX-License-Identifier: MIT
"""What cannot be written is told before the work, and where a folder is made for a command, all of it goes there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import hybridreg as hr
from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.cli.outputs import check_folder
from hybridreg.io import write_points

PLAIN = ["--set", "match=none", "--set", "estimate=identity", "--set", "refine=none"]


@pytest.fixture
def clouds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.chdir(tmp_path)
    pair, _ = testing.sample_pair()
    write_points("a.ply", pair.source.points)
    write_points("b.ply", pair.target.points)
    return ["a.ply", "b.ply"]


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--aligned", "none/x.ply"], "none/x.ply: the folder .* does not exist; create it first"),
        (["--merged", "none/x.pcd"], "none/x.pcd: the folder .* does not exist; create it first"),
        (["--aligned", "x.ply", "--merged", "./x.ply"], "x.ply: two clouds would be written to this file"),
        (["--out", "b.ply"], "b.ply: File exists; name another folder: a file of this name is in the way"),
        (["--out", "b.ply/x"], "b.ply/x: Not a directory; name another folder: a file is in the way"),
        (["--sensors", "A,B"], "--sensors A,B: names them in the report; add --out"),
        (["--crop", "-3"], "--crop -3: there is nothing inside; give a radius"),
        (["--crop", "1,2,3,0,9,9"], "--crop 1,2,3,0,9,9: there is nothing inside; give a radius"),
        (
            ["--crop-source", "1,2,3,0,9,9"],
            "--crop-source 1,2,3,0,9,9: there is nothing inside; give the six",
        ),
    ],
)
def test_before_a_registration(
    clouds: list[str], options: list[str], problem: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hr.Pipeline, "run", lambda *_, **__: pytest.fail("it began"))
    done = call("register", *clouds, *options)
    assert done.exit_code == 2, done.output
    assert re.search(problem, " ".join(done.output.split())), done.output


def test_before_links_are_sought(clouds: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridreg.many.together_run.aligned", lambda *_, **__: pytest.fail("it began"))
    done = call("together", *clouds, "--out", "run", "--merged", "none/x.ply")
    assert done.exit_code == 2
    assert "none/x.ply: the folder" in done.output
    assert not Path("run").exists()


@pytest.mark.parametrize(
    "command", [["view", "a.ply", "b.ply", "--out", "none/v.html"], ["demo", "--out", "a.ply"]]
)
def test_before_pages_are_made(
    clouds: list[str], command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hr.PointCloud, "of", lambda *_, **__: pytest.fail("it began"))
    assert call(*command).exit_code == 2


def test_clouds_go_into_the_folder_that_is_made(clouds: list[str]) -> None:
    call(
        "register",
        *clouds,
        *PLAIN,
        "--out",
        "new/run",
        "--aligned",
        "new/run/x.ply",
        "--merged",
        "new/run/y.ply",
    )
    assert {"result.json", "x.ply", "y.ply"} <= {path.name for path in Path("new/run").iterdir()}


def test_a_stage_without_fields_says_so(clouds: list[str]) -> None:
    done = call("register", *clouds, "--set", "refine=none", "--set", "refine.kind=plane")
    assert "argument 'kind'; it has no fields" in " ".join(done.output.split())


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs /proc")
def test_a_folder_in_which_nothing_can_be_made_is_told_before_the_work(tmp_path: Path) -> None:
    for folder in (Path("/proc/x"), Path("/proc/x/y")):
        with pytest.raises(
            ValueError, match=r"^/proc/x.*: nothing can be written to /proc .*; name another folder"
        ):
            check_folder(folder)
    check_folder(tmp_path / "new" / "one")
    assert not list(tmp_path.iterdir())
