# SPDX-License-Identifier: MIT
"""`hybridreg list`: kinds, and what one name stands for."""

from __future__ import annotations

from typing import Any

import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg import presets, registry
from hybridreg.cli.app import app
from hybridreg.io.structured import parse_toml
from hybridreg.slots import SLOTS


def call(*words: str) -> Any:
    return CliRunner().invoke(app, ["list", *words])


@pytest.mark.parametrize("kind", ["stages", "presets", "protocols", "weights"])
def test_a_kind_lists_its_names(kind: str) -> None:
    assert call(kind).output.startswith(f"{kind}:\n")


@pytest.mark.parametrize("slot", SLOTS)
def test_what_it_tells_of_a_stage_is_a_pipelines_table(slot: str) -> None:
    for name in registry.names(slot):
        told = call(name).output
        assert f'{slot} = "{name}"' in told
        assert "Traceback" not in told
        begin = told.find(f"[{slot}]\nstage = ")
        if begin < 0 or "# needed" in told:
            continue
        table = parse_toml(told[begin:].split("\n\n")[0], name)
        if "weights" not in told and name != "given":
            hr.Pipeline(**{slot: table[slot]})


def test_a_preset_is_shown_as_its_file_has_it() -> None:
    told = call("kiss-gicp").output
    assert parse_toml(told.partition("\n\n")[2], "told") == presets.load("kiss-gicp")


def test_a_name_of_both_is_told_as_both() -> None:
    told = call("icp").output
    assert 'refine = "icp"' in told
    assert "preset icp" in told


def test_what_is_nothing_gets_the_nearest_names() -> None:
    found = call("randsac")
    assert found.exit_code == 2
    assert "did you mean ransac" in found.output
