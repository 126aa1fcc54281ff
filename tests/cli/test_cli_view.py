# SPDX-License-Identifier: MIT
"""`hybridreg view`: a page of two clouds, written or opened, and what it refuses."""

from __future__ import annotations

import base64
import json
import re
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.geometry import se3

SHIFT = np.array([0.2, -0.1, 0.05])


@pytest.fixture
def clouds(tmp_path: Path) -> tuple[str, str]:
    """A cloud and a shifted copy, as two files, one of them with a name that HTML would take for markup."""
    pair, _ = testing.sample_pair()
    np.save(tmp_path / "a<b>.npy", pair.target.points + SHIFT)
    np.savetxt(tmp_path / "b.xyz", pair.target.points)
    return str(tmp_path / "a<b>.npy"), str(tmp_path / "b.xyz")


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["view", *map(str, arguments)])


def layers(page: str) -> dict[str, Any]:
    stored = re.search(r'<script type="application/json">(.*?)</script>', page)
    assert stored is not None
    return {layer["name"]: layer for layer in json.loads(stored[1])["layers"]}


def points(layer: dict[str, Any]) -> np.ndarray:
    cells = np.frombuffer(base64.b64decode(layer["points"]), "<u2").reshape(-1, 3)
    return np.array(layer["low"]) + cells * np.array(layer["step"])


def test_a_page_shows_both_clouds_at_the_pose(clouds: tuple[str, str], tmp_path: Path) -> None:
    np.savetxt(tmp_path / "pose.txt", se3.from_rt(np.eye(3), -SHIFT))
    result = call(*clouds, tmp_path / "pose.txt", "--out", tmp_path / "v.html")
    assert result.exit_code == 0, result.output
    page = (tmp_path / "v.html").read_text()
    shown = layers(page)
    assert np.allclose(points(shown["source"]), points(shown["target"]), atol=0.01)
    assert np.allclose(points(shown["source as it came"]) - SHIFT, points(shown["target"]), atol=0.01)
    # They coincide, but for the grid of two centimetres on which distances are taken.
    assert np.median(np.frombuffer(base64.b64decode(shown["source"]["shade"]), np.uint8)) < 254 / 10
    assert "a&lt;b&gt;.npy onto b.xyz" in page
    assert "<b>" not in page
    assert not re.search(r"\b(src|href)\s*=", page)


def test_a_result_brings_its_pose_and_scale(clouds: tuple[str, str], tmp_path: Path) -> None:
    told = {"transformation": se3.from_rt(np.eye(3), [1.0, 2.0, 3.0]).tolist(), "scale": 2.0}
    (tmp_path / "result.json").write_text(json.dumps(told))
    assert call(*clouds, tmp_path / "result.json", "--out", tmp_path / "v.html").exit_code == 0
    shown = layers((tmp_path / "v.html").read_text())
    raw = np.load(clouds[0])
    assert np.allclose(points(shown["source"]).mean(axis=0), 2.0 * raw.mean(axis=0) + [1, 2, 3], atol=0.02)


def test_without_a_pose_the_clouds_are_as_they_came(clouds: tuple[str, str], tmp_path: Path) -> None:
    assert call(*clouds, "--out", tmp_path / "v.html", "--points", "50").exit_code == 0
    shown = layers((tmp_path / "v.html").read_text())
    assert np.array_equal(points(shown["source"]), points(shown["source as it came"]))
    assert len(points(shown["target"])) == 50


@pytest.mark.parametrize(("works", "words"), [(True, "opened: "), (False, "open this page yourself: ")])
def test_it_opens_the_browser_or_says_where_the_page_is(
    clouds: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, works: bool, words: str
) -> None:
    asked: list[str] = []
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix: str(tmp_path))
    monkeypatch.setattr(webbrowser, "open", lambda address: bool(asked.append(address)) or works)
    result = call(*clouds)
    assert result.exit_code == 0, result.output
    assert words in result.stdout
    assert asked == [(tmp_path / "view.html").as_uri()]
    assert layers((tmp_path / "view.html").read_text())


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("p.txt", "1 2 3", "3 numbers"),
        ("p.txt", " ".join(map(str, np.diag([2.0, 1, 1, 1]).ravel())), "not a rotation"),
        ("p.json", '{"transformation": [1, 0], "scale": 1}', "2 numbers"),
        ("p.json", json.dumps({"transformation": np.eye(4).tolist(), "scale": -1}), "no positive number"),
        ("p.json", json.dumps({"transformation": np.eye(4).tolist(), "scale": "x"}), "no positive number"),
    ],
)
def test_a_bad_pose_is_refused_by_name(
    clouds: tuple[str, str], tmp_path: Path, name: str, text: str, words: str
) -> None:
    (tmp_path / name).write_text(text)
    result = call(*clouds, tmp_path / name, "--out", tmp_path / "v.html")
    assert result.exit_code == 2, result.output
    assert name in result.stderr
    assert words in result.stderr
    assert not (tmp_path / "v.html").exists()


def test_a_page_is_called_html(clouds: tuple[str, str], tmp_path: Path) -> None:
    result = call(*clouds, "--out", tmp_path / "v.png")
    assert result.exit_code == 2
    assert "v.html" in result.stderr
