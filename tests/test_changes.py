# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import pytest

import hybridreg as hr
from hybridreg import changes


def test_a_preset_and_what_differs() -> None:
    pipe = changes.build({"preset": "icp", "voxel": 0.3, "refine": {"iterations": 7}, "match": "none"})
    assert isinstance(pipe.refine, hr.Icp)
    assert (pipe.refine.iterations, pipe.downsample.voxel) == (7, 0.3)
    assert changes.build({}).to_spec() == hr.Pipeline.preset("default").to_spec()


def test_another_stage_drops_the_fields_of_the_old_one() -> None:
    pipe = changes.build({"preset": "icp", "refine": {"stage": "gicp"}})
    assert pipe.refine == hr.Gicp()


def test_a_file_is_a_start_too(tmp_path: Path) -> None:
    hr.Pipeline.preset("icp", voxel=0.7).save(tmp_path / "mine.toml")
    pipe = changes.build({"pipeline": tmp_path / "mine.toml", "refine": "none"})
    assert (pipe.downsample.voxel, pipe.refine) == (0.7, hr.NoRefinement())


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["match=fpfh"], {"match": "fpfh"}),
        (["match.radius=1.25", "match.mutual=false"], {"match": {"radius": 1.25, "mutual": False}}),
        (["match=fpfh", "match.radius=2"], {"match": {"stage": "fpfh", "radius": 2}}),
        (["match.radius=2", "match=none"], {"match": "none"}),
        (["voxel=0.3", " refine = gicp "], {"voxel": 0.3, "refine": "gicp"}),
        (["refine.kind=plane", "estimate.layers=[0.3, 0.5]"],
         {"refine": {"kind": "plane"}, "estimate": {"layers": [0.3, 0.5]}}),
    ],
)  # fmt: skip
def test_settings_are_read(texts: list[str], expected: dict[str, object]) -> None:
    assert changes.parse(texts) == expected


@pytest.mark.parametrize("text", ["match", "=fpfh", "match.=1", "a.b.c=1", ""])
def test_a_setting_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"--set .*: expected slot=name or slot\.field=value"):
        changes.parse([text])


@pytest.mark.parametrize(
    ("given", "error", "told"),
    [
        ({"mach": "fpfh"}, ValueError, "mach: unknown"),
        ({"preset": "icq"}, KeyError, "no preset is called 'icq'"),
        ({"preset": "icp", "pipeline": "x.toml"}, ValueError, "leave one of them out"),
        ({"preset": "icp", "refine": "gicpp"}, KeyError, "did you mean 'gicp'"),
        ({"preset": "icp", "refine": {"iteration": 3}}, ValueError, "its fields are .*iterations"),
    ],
)
def test_a_change_that_cannot_be_made_is_named(
    given: dict[str, object], error: type[Exception], told: str
) -> None:
    with pytest.raises(error, match=told):
        changes.build(given)


def test_merge_joins_fields_and_replaces_stages() -> None:
    base = {"match": "fpfh", "refine": {"stage": "icp", "iterations": 5}}
    merged = changes.merge(base, {"match": {"radius": 1.0}, "refine": {"kind": "plane"}})
    assert merged == {
        "match": {"stage": "fpfh", "radius": 1.0},
        "refine": {"stage": "icp", "iterations": 5, "kind": "plane"},
    }
    assert changes.merge(base, {"refine": "gicp"})["refine"] == "gicp"
    assert base["match"] == "fpfh"
