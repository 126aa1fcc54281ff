# SPDX-License-Identifier: MIT
"""`hybridreg register` and `demo`: what is printed, what is written, how they end."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import hybridreg as hr
from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import Overlay
from hybridreg.io import write_points
from hybridreg.io.poses.pose_file import read_pose
from hybridreg.pipeline import Trace
from hybridreg.result import RegistrationResult

SMALL = ["--set", "match=none", "--set", "estimate=identity", "--set", "refine=icp", "--voxel", "0.5"]


def judged(self: hr.Pipeline, trace: Trace, *, seed: int = 0, verdict: Any = "ok") -> RegistrationResult:
    """A pipeline's result under a verdict that the test chooses."""
    return RegistrationResult(
        transformation=trace.refined.T, verdict=verdict, confidence=0.5, reasons=("because", "and so"),
        overlay=Overlay(np.eye(3), np.eye(3), np.eye(4), 0.5), information=np.eye(6),
        rivals=np.zeros((0, 4, 4)), matches=trace.matches,
        evidence={"violations": 0.01}, notes=tuple(trace.scene.notes),
        seconds={**trace.seconds, "verdict": 0.01}, peak_memory_mb=1.0, seed=seed, spec=self.to_spec(),
    )  # fmt: skip


@pytest.fixture
def verdict(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Choose the verdict of every pipeline."""

    def choose(word: str) -> None:
        monkeypatch.setattr(
            hr.Pipeline, "conclude", lambda self, trace, seed=0: judged(self, trace, seed=seed, verdict=word)
        )

    choose("ok")
    return choose


@pytest.fixture
def clouds(tmp_path: Path) -> tuple[str, str]:
    """A pair that lies nearly right, as two files."""
    pair, _ = testing.sample_pair()
    source = pair.target.points + np.array([0.2, -0.1, 0.05])
    np.save(tmp_path / "a.npy", source)
    np.savetxt(tmp_path / "b.xyz", pair.target.points)
    return str(tmp_path / "a.npy"), str(tmp_path / "b.xyz")


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def refused(result: Result) -> str:
    """The one sentence of a refusal."""
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("hybridreg: ")
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.output
    return result.stderr


@pytest.mark.usefixtures("verdict")
def test_prints_pose_verdict_reasons_and_seconds(clouds: tuple[str, str]) -> None:
    result = call("register", *clouds, *SMALL, "--seed", "3")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    T = np.array([[float(x) for x in line.split()] for line in lines[1:5]])
    assert np.allclose(T[:3, 3], [-0.2, 0.1, -0.05], atol=0.05)
    assert "verdict: ok (confidence 0.50)" in lines
    assert lines[lines.index("verdict: ok (confidence 0.50)") + 1 :][:2] == ["  - because", "  - and so"]
    last = lines[-1]
    assert last.startswith("seconds: ")
    assert all(
        stage in last for stage in ("downsample", "match", "estimate", "refine", "verdict", "together")
    )


@pytest.mark.parametrize(("word", "code"), [("ok", 0), ("doubtful", 0), ("failed", 3)])
def test_exit_code_follows_the_verdict(clouds: tuple[str, str], verdict: Any, word: str, code: int) -> None:
    verdict(word)
    result = call("register", *clouds, *SMALL)
    assert result.exit_code == code
    assert f"verdict: {word}" in result.stdout


def test_out_gets_pose_result_page_and_picture_even_when_it_failed(
    clouds: tuple[str, str], verdict: Any, tmp_path: Path
) -> None:
    verdict("failed")
    out = tmp_path / "deep" / "run"
    result = call("register", *clouds, *SMALL, "--out", out, "--seed", "9", "--sensors", "Avia,HDL <64E>")
    assert result.exit_code == 3
    assert sorted(f.name for f in out.iterdir()) == [
        "T_target_source.txt", "before_after.png", "report.html", "result.json",
    ]  # fmt: skip
    stored = json.loads((out / "result.json").read_text())
    assert stored["hybridreg"] == hr.__version__
    assert stored["origin"]["source"].endswith("a.npy")
    assert stored["origin"]["command"].startswith("hybridreg register ")
    assert np.allclose(np.loadtxt(out / "T_target_source.txt"), stored["transformation"], atol=1e-9)
    assert (stored["verdict"], stored["seed"], stored["spec"]["refine"]["stage"]) == ("failed", 9, "icp")
    page = (out / "report.html").read_text()
    assert "Registration: failed" in page
    assert "<li>because</li>" in page
    assert page.count('class="orbit"') == 1
    assert "a.npy onto b.xyz" in page
    assert "HDL &lt;64E&gt;" in page
    assert f"--out {out} --sensors" in page
    assert (out / "before_after.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("names", ["Avia", "a,b,c", ""])
def test_sensors_are_two_names(clouds: tuple[str, str], names: str) -> None:
    assert "one comma" in refused(call("register", *clouds, *SMALL, "--sensors", names))


@pytest.mark.usefixtures("verdict")
def test_an_image_and_a_pipeline_file_are_taken(clouds: tuple[str, str], tmp_path: Path) -> None:
    import cv2

    cv2.imwrite(str(tmp_path / "i.png"), np.zeros((4, 4, 3), np.uint8))
    hr.Pipeline(match="none", estimate="identity", refine="none", voxel=0.5).save(tmp_path / "p.toml")
    result = call("register", *clouds, "--image", tmp_path / "i.png", "--pipeline", tmp_path / "p.toml")
    assert result.exit_code == 0, result.output
    told = refused(
        call("register", *clouds, "--image", tmp_path / "none.png", "--pipeline", tmp_path / "p.toml")
    )
    assert "none.png" in told


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--preset", "icq"], "no preset is called 'icq'; did you mean 'icp'? Known: "),
        (["--set", "match"], "--set match: expected slot=name"),
        (["--set", "refine=icq"], "no refine stage is called 'icq'; did you mean 'icp'? Known: "),
        (["--set", "refine=nearest"], "no refine stage is called 'nearest'. Known: "),
        (["--set", "refine=icp", "--set", "refine.color=1"], "its fields are"),
        (["--voxel", "-1", "--preset", "icp"], "--voxel -1.0 must be a positive length"),
        (["--pipeline", "nowhere.toml"], "nowhere.toml: no such file; check the name"),
    ],
)
def test_a_setting_that_is_wrong_is_one_sentence(
    clouds: tuple[str, str], arguments: list[str], told: str
) -> None:
    assert told in refused(call("register", *clouds, *arguments))


@pytest.mark.parametrize(
    ("content", "told"),
    [(None, "no such file"), (b"", "empty"), (b"\x00\x01\x02", "broken.ply"), (b"ply\n", "broken.ply")],
)
def test_a_cloud_that_is_wrong_is_one_sentence(
    clouds: tuple[str, str], tmp_path: Path, content: bytes | None, told: str
) -> None:
    broken = tmp_path / "broken.ply"
    if content is not None:
        broken.write_bytes(content)
    assert told in refused(call("register", broken, clouds[1], *SMALL))


@pytest.mark.usefixtures("verdict")
def test_points_that_are_not_finite_are_refused_or_dropped(clouds: tuple[str, str], tmp_path: Path) -> None:
    points = np.load(clouds[0])
    points[5] = np.nan
    np.save(tmp_path / "nan.npy", points)
    told = refused(call("register", tmp_path / "nan.npy", clouds[1], *SMALL))
    assert "source: 1 of" in told
    assert "row 5" in told
    assert call("register", tmp_path / "nan.npy", clouds[1], *SMALL, "--nonfinite", "drop").exit_code == 0


@pytest.mark.usefixtures("verdict")
def test_a_warning_is_one_line(tmp_path: Path) -> None:
    points = 1000.0 * testing.sample_pair()[0].target.points
    np.save(tmp_path / "mm.npy", points)
    result = call("register", tmp_path / "mm.npy", tmp_path / "mm.npy", *SMALL[:-2], "--voxel", "500")
    assert result.exit_code == 0, result.output
    warned = result.stderr.splitlines()
    assert warned
    assert all(line.startswith("hybridreg: warning: ") for line in warned)
    assert "millimetres" in result.stderr


def test_usage_errors_end_with_2_as_well() -> None:
    assert call("register").exit_code == 2
    assert call("regster").exit_code == 2
    assert call("register", "a", "b", "--nonfinite", "keep").exit_code == 2


@pytest.mark.usefixtures("verdict")
def test_demo_compares_with_the_true_pose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pair, truth = testing.sample_pair()
    near = np.asarray(pair.source.points) @ truth[:3, :3].T + truth[:3, 3] - [0.3, 0.0, 0.0]
    folder = tmp_path / "data" / "demo"
    folder.mkdir(parents=True)
    np.save(folder / "source.npy", near)
    np.save(folder / "target.npy", pair.target.points)
    T = se3.from_rt(np.eye(3), np.array([0.3, 0.0, 0.0]))
    (folder / "meta.json").write_text(json.dumps({"T_target_source": T.tolist(), "source_sensor": "fan"}))
    monkeypatch.setattr("hybridreg.cli.demo.files", lambda _: tmp_path / "data")
    result = call("demo", "--preset", "icp", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "fan -> target" in result.stdout
    against = next(line for line in result.stdout.splitlines() if line.startswith("against the true pose"))
    assert float(against.split()[4]) < 1.0
    assert (tmp_path / "out" / "before_after.png").exists()


def test_the_module_runs_as_a_command(clouds: tuple[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "hybridreg", "register", clouds[0], "none.ply"],
        capture_output=True, text=True, check=False, cwd=Path(hr.__file__).parent.parent,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("hybridreg: none.ply: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.usefixtures("verdict")
def test_one_cloud_as_source_and_target_is_told(clouds: tuple[str, str]) -> None:
    path = Path(clouds[0])
    told = call("register", path, path.parent / ".." / path.parent.name / path.name, *SMALL).stderr
    assert "source and target are the same cloud" in told
    assert "name two files" in told
    assert "the same cloud" not in call("register", *clouds, *SMALL).stderr


@pytest.mark.parametrize("option", ["--aligned", "--merged"])
def test_no_cloud_is_written_over_one_that_is_read(tmp_path: Path, option: str) -> None:
    pair = testing.sample_pair()[0]
    write_points(tmp_path / "a.ply", pair.source.points)
    write_points(tmp_path / "b.ply", pair.target.points)
    (tmp_path / "link.ply").symlink_to(tmp_path / "b.ply")
    for name in ("a.ply", "b.ply", "link.ply"):
        told = refused(call("register", tmp_path / "a.ply", tmp_path / "b.ply", option, tmp_path / name))
        assert f"{name}: is one of the clouds that are read, and would be lost; choose another name" in told


@pytest.mark.usefixtures("verdict")
def test_out_gets_the_pose_in_the_form_that_was_asked_for_too(
    clouds: tuple[str, str], tmp_path: Path
) -> None:
    out = tmp_path / "run"
    for form in ("tum", "ros-tf", "matrix"):
        result = call("register", *clouds, *SMALL, "--out", out, "--format", form)
        assert result.exit_code == 0, result.output
        assert [f.name for f in out.glob("pose.*")] == ([] if form == "matrix" else [f"pose.{form}.txt"])
        if form != "matrix":
            T = json.loads((out / "result.json").read_text())["transformation"]
            np.testing.assert_allclose(read_pose(out / f"pose.{form}.txt"), T, atol=1e-12)
