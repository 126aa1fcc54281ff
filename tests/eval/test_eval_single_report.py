# SPDX-License-Identifier: MIT
"""The page of one registration: whole, small, offline, escaped, and right in its numbers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hybridreg as hr
from hybridreg.data.loaders.folder import load_pair
from hybridreg.eval.report import laid_out, orbit_view, plain_evidence, pose_words, single_report
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.verdict import usual
from hybridreg.verdict.training import usual_range

pytest.importorskip("matplotlib")
HOSTILE = "a</script><script>alert(1)</script>\"'&<b>.ply"


@pytest.fixture(scope="module")
def demo() -> Pair:
    return load_pair(Path(str(files("hybridreg.data") / "demo"))).pair


@pytest.fixture(scope="module")
def result(demo: Pair) -> hr.RegistrationResult:
    return hr.register(demo.source, demo.target)


@pytest.fixture(scope="module")
def text(demo: Pair, result: hr.RegistrationResult) -> str:
    odd = replace(
        result,
        reasons=(f"because of {HOSTILE}",),
        notes=(HOSTILE,),
        rivals=np.array([se3.from_rt(np.eye(3), np.array([3.0, 4.0, 0.0])) @ result.transformation]),
    )
    return single_report.html(demo, odd, single_report.Origin(*[HOSTILE] * 4, command=f"hybridreg {HOSTILE}"))


def test_it_holds_what_a_reader_asks_for(text: str, result: hr.RegistrationResult) -> None:
    told = re.sub(r"<[^>]+>", " ", text)
    for words in (
        "The clouds are aligned: the pose is right to 2° and 0.5 m with a confidence of",
        f"hybridreg {hr.__version__}",
        f"x {result.transformation[0, 3]:.4f}",
        "Rz(yaw) Ry(pitch) Rx(roll)",
        f"{np.degrees(np.sqrt(result.covariance[2, 2])):.3f}°",
        f"{np.sqrt(result.covariance[5, 5]):.3f} m",
        "16,140",
        "Seen from above",
        "Seen from the side",
        "Where a sensor saw through",
        "turned by 0.0°, 5.00 m away",
        "9 in 10 right poses",
        "birdseye",
        '"transformation"',
    ):
        assert words in told.replace("&quot;", '"'), words


def test_it_is_small_and_needs_no_network(text: str) -> None:
    assert len(text.encode()) < 3_000_000
    # Of every name that a browser would fetch, only data inside the page.
    fetched = re.findall(r"""\b(?:src|href)\s*=\s*["']([^"']*)""", text)
    assert fetched
    assert all(each.startswith("data:") for each in fetched)
    assert not re.search(r"@import|url\(", text)


def test_it_is_made_for_phones_dark_rooms_and_paper(text: str) -> None:
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in text
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text
    for table in re.findall(r"<div[^>]*>\s*<table|<table", text):
        assert table.startswith('<div class="scroll">')


def test_every_name_is_escaped(text: str) -> None:
    assert "alert(1)" in text
    assert "<script>alert" not in text
    assert "<b>.ply" not in text
    assert text.count("<script") == text.count("</script>")


def test_angles_and_axis_make_the_rotation_again() -> None:
    R = Rotation.from_euler("xyz", [10.0, -20.0, 130.0], degrees=True).as_matrix()
    told = pose_words.pose(_with(R))
    angles = [float(x) for x in re.findall(r"(-?[\d.]+)°", told["Rotation, Euler angles"])]
    assert np.allclose(Rotation.from_euler("xyz", angles, degrees=True).as_matrix(), R, atol=1e-5)
    degrees, *axis = map(float, re.findall(r"-?\d+\.\d+", told["Rotation, axis and angle"]))
    assert np.allclose(Rotation.from_rotvec(np.radians(degrees) * np.array(axis)).as_matrix(), R, atol=1e-4)


def test_no_rotation_has_no_axis_and_an_upright_pitch_says_so() -> None:
    assert "no rotation" in pose_words.pose(_with(np.eye(3)))["Rotation, axis and angle"]
    upright = Rotation.from_euler("y", 90.0, degrees=True).as_matrix()
    assert "only the difference" in pose_words.pose(_with(upright))["Rotation, Euler angles"]


@pytest.mark.parametrize(
    ("share", "words"), [(1.0, "more than 99.9 %"), (0.0, "less than 0.1 %"), (0.584, "58.4 %")]
)
def test_confidence_is_never_certain(share: float, words: str) -> None:
    assert pose_words.confidence(share) == words


def test_an_open_direction_is_said_to_be_open() -> None:
    loose: Any = _with(np.eye(3))
    loose.covariance[3, 3] = np.inf
    assert pose_words.accuracy(loose)[0]["translation"] == "not constrained"


def test_clouds_are_laid_out_at_the_pose(demo: Pair, result: hr.RegistrationResult) -> None:
    laid = laid_out.of(demo, result)
    assert len(laid.source) == len(laid.before) == len(laid.residual) == laid_out.DRAWN
    assert np.allclose(laid.source, se3.apply(result.transformation, laid.before))
    assert np.nanmedian(laid.residual) < 0.05
    assert len(laid.violations) / laid.looked == pytest.approx(result.evidence["looked_through"], abs=0.003)
    off = replace(
        result, transformation=se3.from_rt(np.eye(3), np.array([6.0, 0, 0])) @ result.transformation
    )
    wrong = laid_out.of(demo, off)
    assert np.nanmedian(wrong.residual) > 2 * np.nanmedian(laid.residual)
    assert len(wrong.violations) > 3 * len(laid.violations)


def test_map_coordinates_scale_and_unknown_viewpoints_are_drawn(
    result: hr.RegistrationResult, demo: Pair
) -> None:
    far = np.array([500_000.0, 5_400_000.0, 100.0])
    pair = Pair.of(demo.source.points / 1.02, demo.target.points + far, target_viewpoint="none")
    T = se3.from_rt(np.eye(3), far) @ result.transformation
    laid = laid_out.of(pair, replace(result, transformation=T, scale=1.02, scale_verdict="ok"))
    assert np.nanmedian(laid.residual) < 0.05
    assert np.abs(laid.source).max() < 10_000
    assert not len(laid.sensors["target"])


def test_a_pose_that_brings_nothing_together_has_a_page(demo: Pair, result: hr.RegistrationResult) -> None:
    away = se3.from_rt(np.eye(3), np.array([3000.0, 0.0, 0.0]))
    lost = replace(result, transformation=away, verdict="failed", confidence=0.0, entries=(), evidence={})
    text = single_report.html(demo, lost)
    assert "No trustworthy pose was found" in text
    assert "0% have a surface" in text


def test_what_is_usual_comes_from_rows_and_every_fact_is_told() -> None:
    held = usual.usual()
    assert set(held.quantiles) == set(usual.FACTS) == set(plain_evidence.WORDS)
    assert all(list(each) == sorted(each) for each in held.quantiles.values())
    assert plain_evidence.standing("agreement_rare", 0.0) == "worse than usual"
    assert plain_evidence.standing("looked_through", 0.5) == "worse than usual"
    assert plain_evidence.standing("inlier_rmse", 0.0) == "better than usual"
    assert plain_evidence.standing("overlap", held.quantiles["overlap"][3]) == "usual"


def test_ranges_are_those_of_the_right_poses_by_weight(result: hr.RegistrationResult) -> None:
    def row(through: float, right: bool) -> dict[str, Any]:
        told = {**result.evidence, "looked_through": through, "matched": 0.5, "rival_margin": -3.0}
        return {"evidence": told, "right": right, "weight": 1.0}

    rows = [row(k / 1000, True) for k in range(101)] + [row(1.0, False)] * 50
    found = usual_range.ranges(rows)
    assert found["poses"] == 101
    assert found["facts"]["looked_through"][3] == pytest.approx(0.05)
    assert found["facts"]["looked_through"][-1] < 0.1
    with pytest.raises(ValueError, match="gather more rows"):
        usual_range.ranges(rows[:50])


def test_numbers_that_were_not_measured_are_left_out(result: hr.RegistrationResult) -> None:
    bare = {**result.evidence, "relief_cells": 3.0, "matched": 0.0, "rival_margin": -20.0}
    assert not {"relief_correlation", "matched", "lead"} & set(usual.facts(bare))
    assert usual.facts({"another judge's": 1.0}) == {}


def test_a_view_stores_its_points_to_a_fraction_of_their_extent() -> None:
    import base64

    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3)) * 40.0
    shade = np.where(points[:, 0] > 0, 0.5, np.nan)
    view = orbit_view.html([orbit_view.Layer("</script>", points, "#112233", shade=shade)])
    assert view.count("</script>") == 1
    layer = json.loads(re.search(r'json">(.*?)</script>', view)[1])["layers"][0]  # type: ignore[index]
    cells = np.frombuffer(base64.b64decode(layer["points"]), "<u2").reshape(-1, 3)
    assert np.allclose(np.array(layer["low"]) + cells * np.array(layer["step"]), points, atol=0.01)
    stored = np.frombuffer(base64.b64decode(layer["shade"]), np.uint8)
    assert np.array_equal(stored == 255, np.isnan(shade))


def _with(R: Any) -> Any:
    """As much of a result as its words need."""

    class Some:
        transformation = se3.from_rt(R, np.array([1.0, 2.0, 3.0]))
        covariance = np.eye(6)
        scale_verdict = None

    return Some()


def test_no_part_of_a_page_is_wider_than_a_phone() -> None:
    style = files("hybridreg.eval.report").joinpath("page.html").read_text().partition("</style>")[0]
    # A width in pixels must give way: as a largest one, or as the smaller of itself and the page's.
    rigid = re.sub(r"max-width: *\d+px|min\(\d+px, 100%\)|min\(\d+vh, \d+px\)|@media[^{]*", "", style)
    assert not [each for each in re.findall(r"(\d+)px", rigid) if int(each) > 100]
