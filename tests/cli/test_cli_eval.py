# SPDX-License-Identifier: MIT
"""`hybridreg eval`, `table`, `report`, `list` and `doctor`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import hybridreg as hr
from hybridreg import testing
from hybridreg.cli import doctor
from hybridreg.cli.app import app
from hybridreg.eval import read
from hybridreg.geometry import se3

PLAIN = ["--set", "match=none", "--set", "estimate=identity", "--set", "refine=none", "--voxel", "0.5"]


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def pairs(tmp_path: Path) -> Path:
    """Three pairs: one lies right, one is 3 m off, one has a source that cannot be read."""
    points = testing.sample_pair()[0].target.points
    for name, shift in {"a-right": 0.1, "b-off": 3.0, "c-broken": 0.0}.items():
        folder = tmp_path / "pairs" / name
        folder.mkdir(parents=True)
        np.save(folder / "source.npy", points - [shift, 0, 0])
        np.save(folder / "target.npy", points)
        T = se3.from_rt(np.eye(3), np.array([shift, 0, 0]))
        (folder / "meta.json").write_text(json.dumps({"T_target_source": T.tolist()}))
    (tmp_path / "pairs" / "c-broken" / "source.npy").write_bytes(b"gone")
    return tmp_path / "pairs"


@pytest.fixture(autouse=True)
def light_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without plotly's five megabytes; that they carry it is another test's business."""
    monkeypatch.setattr("hybridreg.eval.report.plotly_figures.script", lambda: "")


@pytest.fixture(autouse=True)
def verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    from test_cli_register import judged

    monkeypatch.setattr(hr.Pipeline, "conclude", judged)


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_eval_writes_rows_and_reports(pairs: Path, tmp_path: Path) -> None:
    result = call("eval", "--data", pairs, *PLAIN, "--protocol", "kitti", "--out", "run", "--seed", "7")
    assert result.exit_code == 0, result.output
    stored = read(next((tmp_path / "run" / "predictions").iterdir()))
    assert [row.id for row in stored.rows] == ["a-right", "b-off", "c-broken"]
    assert stored.config["seed"] == 7
    assert "source.npy" in str(stored.rows[2].error)
    assert "33.3" in result.stdout
    assert "protocol kitti" in result.stdout
    assert {f.name for f in (tmp_path / "run").iterdir()} == {
        "predictions", "table.json", "table.md", "table.tex", "table.csv", "report.html",
    }  # fmt: skip


def test_eval_resumes_and_refuses_another_configuration(pairs: Path) -> None:
    given = ["eval", "--data", pairs, "--out", "run"]
    assert call(*given, *PLAIN).exit_code == 0
    before = (Path("run") / "predictions").stat().st_mtime_ns
    assert call(*given, *PLAIN).exit_code == 0
    assert (Path("run") / "predictions").stat().st_mtime_ns == before
    other = call(*given, *PLAIN, "--seed", "1")
    assert other.exit_code == 2
    assert "seed: 0 before, 1 now" in other.stderr
    assert "--overwrite" in other.stderr
    assert call(*given, *PLAIN, "--seed", "1", "--overwrite").exit_code == 0


def test_a_preset_that_changed_between_two_runs_is_refused(
    pairs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hybridreg import presets

    given = ["eval", "--data", pairs, "--preset", "icp", "--voxel", "0.5", "--out", "run"]
    assert call(*given).exit_code == 0
    icp = presets.load("icp")
    monkeypatch.setattr(presets, "load", lambda _: {**icp, "refine": "none"})
    refused = call(*given)
    assert refused.exit_code == 2
    assert 'method.refine.stage: "icp" before, "none" now' in refused.stderr
    assert "add --overwrite" in refused.stderr
    Path("mine.toml").write_text('match = "none"\nestimate = "identity"\nrefine = "none"\nvoxel = 0.5\n')
    own = ["eval", "--data", pairs, "--pipeline", "mine.toml", "--out", "own"]
    assert call(*own).exit_code == 0
    Path("mine.toml").write_text('match = "none"\nestimate = "identity"\nrefine = "none"\nvoxel = 0.6\n')
    assert "voxel" in call(*own).stderr


def test_eval_takes_starts_and_workers(pairs: Path) -> None:
    result = call("eval", "--data", pairs, *PLAIN, "--starts", "1", "--workers", "2", "--out", "run")
    assert result.exit_code == 0, result.output
    rows = read(next((Path("run") / "predictions").iterdir())).rows
    assert [row.id for row in rows][:2] == ["a-right", "a-right@yaw1"]
    assert len(rows) == 6


TABLE = """
title = "Nothing against ICP"
protocols = ["fine"]
[base]
match = "none"
estimate = "identity"
voxel = 0.5
[[row]]
name = "nothing"
refine = "none"
[[row]]
name = "icp"
refine = "icp"
"""


def test_table_then_report_under_other_protocols(pairs: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(TABLE)
    result = call("table", "mine.toml", "--data", pairs)
    assert result.exit_code == 0, result.output
    assert "protocol fine" in result.stdout
    out = tmp_path / "runs" / "mine"
    before = {f: f.read_bytes() for f in (out / "predictions").iterdir()}
    assert len(before) == 2

    again = call("report", out, "--protocol", "cross3dreg", "--protocol", "kitti-strict")
    assert again.exit_code == 0, again.output
    text = (out / "table.md").read_text()
    assert "protocol cross3dreg" in text
    assert "protocol kitti-strict" in text
    assert "protocol fine" not in text
    assert {f: f.read_bytes() for f in (out / "predictions").iterdir()} == before
    assert (out / "report.html").read_text().count("source, true pose") > 0


def test_table_takes_other_starts_than_the_file(pairs: Path) -> None:
    Path("mine.toml").write_text("starts = 1\n" + TABLE)
    result = call("table", "mine.toml", "--data", pairs, "--starts", "0")
    assert result.exit_code == 0, result.output
    rows = read(next((Path("runs") / "mine" / "predictions").iterdir())).rows
    assert [row.id for row in rows] == ["a-right", "b-off", "c-broken"]


def test_report_of_single_files_and_of_data_that_has_gone(pairs: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(TABLE)
    assert call("table", "mine.toml", "--data", pairs).exit_code == 0
    files = sorted((tmp_path / "runs" / "mine" / "predictions").iterdir())
    pairs.rename(tmp_path / "moved")
    result = call("report", *files, "--out", "elsewhere")
    assert result.exit_code == 0, result.output
    assert "no views" in (tmp_path / "elsewhere" / "report.html").read_text()
    assert call("report", *files, "--out", "elsewhere", "--data", "moved").exit_code == 0
    assert "no views" not in (tmp_path / "elsewhere" / "report.html").read_text()
    assert call("report", *files, "--data", "nowhere").exit_code == 2


def test_report_compares_runs_by_their_folders(pairs: Path, tmp_path: Path) -> None:
    for out, seed in (("one", 0), ("two", 5)):
        assert call("eval", "--data", pairs, *PLAIN, "--seed", seed, "--out", out).exit_code == 0
    result = call("report", "one", "two", "--out", "both")
    assert result.exit_code == 0, result.output
    told = (tmp_path / "both" / "table.md").read_text()
    assert "| one/" in told
    assert "| two/" in told
    (tmp_path / "empty").mkdir()
    refused = call("report", "one", "empty")
    assert refused.exit_code == 2
    assert "empty: holds no predictions" in refused.stderr


def test_report_draws_what_the_stages_made(pairs: Path, tmp_path: Path) -> None:
    matching = ["--set", "match=fpfh", "--set", "estimate=svd", "--set", "refine=none", "--voxel", "1.0"]
    assert call("eval", "--data", pairs, *matching, "--out", "run").exit_code == 0
    result = call("report", "run", "--pictures", "5")
    assert result.exit_code == 0, result.output
    assert "2 pictures in run/pictures" in result.stdout, "the third pair cannot be read"
    names = {file.name for file in (tmp_path / "run" / "pictures").glob("*/*.png")}
    assert names == {"a-right-matches.png", "b-off-matches.png"}
    pairs.rename(tmp_path / "moved")
    assert "--pictures 1 needs the data" in call("report", "run", "--pictures", "1").stderr
    assert call("report", "run", "--pictures", "1", "--data", "moved").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["table", "none.toml", "--data", "pairs"], "none.toml: no such file"),
        (["table", "mine.toml"], "mine.toml names no data; give --data"),
        (["table", "mine.toml", "--data", "nowhere"], "nowhere: there is no such folder, and no loader"),
        (
            ["table", "mine.toml", "--data", "pairs", "--protocol", "kiti"],
            "no protocol is called 'kiti'. Known: ",
        ),
        (["eval", "--data", "pairs", "--preset", "icq"], "no preset is called 'icq'"),
        (["report", "pairs"], "pairs: no table was run there"),
        (["report", "mine.toml"], "mine.toml: not a file of predictions"),
    ],
)
@pytest.mark.usefixtures("pairs")
def test_what_cannot_be_run_is_one_sentence(tmp_path: Path, arguments: list[str], told: str) -> None:
    (tmp_path / "mine.toml").write_text(TABLE)
    result = call(*arguments)
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_list_names_everything() -> None:
    text = call("list").stdout
    for part in (
        "refine: gicp, icp, kiss-icp, none",
        "default (default)",
        "folder:...",
        "classical",
        "cross3dreg",
        "fcgf: fcgf-kitti, fcgf-3dmatch, small, nano",
        "cross3dreg-small: 39,800 visits of training pairs",
    ):
        assert part in text
    presets = call("list", "presets").stdout
    assert "icp" in presets
    assert "sim" not in presets


def test_doctor_tells_versions_and_survives_what_does_not_load(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: str) -> None:
        raise OSError("libfoo.so.1: cannot open shared object file")

    monkeypatch.setattr(doctor.importlib, "import_module", broken)
    monkeypatch.setitem(sys.modules, "torch", None)
    result = call("doctor")
    assert result.exit_code == 0, result.output
    assert f"hybridreg {hr.__version__}" in result.stdout
    assert f"numpy {np.__version__}: does not load: libfoo.so.1" in result.stdout
    assert "GPU: unknown without torch" in result.stdout
    assert "weights that come with the package: cannot be listed: libfoo.so.1" in result.stdout
    monkeypatch.undo()
    assert doctor._weights().startswith("cofinet-small, cross3dreg-small, fcgf-small, ")
