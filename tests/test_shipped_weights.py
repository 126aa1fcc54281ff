# SPDX-License-Identifier: MIT
"""Presets of the learned stages: usable once their weights lie in the package, and told in one sentence until then."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg import changes, presets, testing
from hybridreg.cli.app import app
from hybridreg.io import shipped_weights

LEARNED = {"cross3dreg": "cross3dreg-small", "geotransformer": "geotransformer-small"}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package whose folder of weights is empty."""
    monkeypatch.setattr(shipped_weights, "_folder", lambda: tmp_path / "weights")
    return tmp_path / "weights"


@pytest.fixture
def drop(package: Path) -> Path:
    """Weights dropped into it, as if they had been trained."""
    torch = pytest.importorskip("torch")
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork
    from hybridreg.learned.cross3dreg.sizes import named_config
    from hybridreg.learned.weights import save_pretrained

    for preset, name in LEARNED.items():
        full = preset == "cross3dreg"
        network = RegistrationNetwork(named_config("nano", omp=full, vgam=full))
        with torch.no_grad():
            for parameter in network.parameters():
                parameter += 0.01 * torch.randn_like(parameter)
        save_pretrained(network, package / name)
    return package


@pytest.mark.parametrize("preset", LEARNED)
@pytest.mark.usefixtures("package")
def test_missing_weights_are_one_sentence_with_the_cure(preset: str) -> None:
    with pytest.raises(FileNotFoundError, match=f"needs the weights '{LEARNED[preset]}', which do not come"):
        hr.Pipeline.preset(preset)
    done = CliRunner().invoke(app, ["eval", "--data", "sim:val/near#1", "--preset", preset])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    assert "hybridreg train" in done.stderr
    assert "--set match.weights=FOLDER" in done.stderr
    listed = CliRunner().invoke(app, ["list", "presets"]).stdout
    assert f"{preset} (its weights do not come with this version)" in listed


@pytest.mark.parametrize("preset", LEARNED)
@pytest.mark.usefixtures("drop")
def test_dropping_the_folder_in_suffices(preset: str) -> None:
    assert shipped_weights.names() == sorted(LEARNED.values())
    pipe = hr.Pipeline.preset(preset, voxel=0.5)
    assert type(pipe.estimate).__name__ == "Lgr"
    assert type(pipe.refine).__name__ == "NoRefinement"
    pair, _ = testing.sample_pair(n_points=600)
    found = pipe.run(pair)
    assert found.transformation.shape == (4, 4)
    assert not any("random weights" in note for note in found.notes)
    assert f"{preset}\n" in CliRunner().invoke(app, ["list", "presets"]).stdout


def test_own_weights_take_the_place_of_missing_ones(drop: Path, tmp_path: Path) -> None:
    mine = drop / "cross3dreg-small"
    mine.rename(tmp_path / "mine")
    own = {"weights": str(tmp_path / "mine")}
    built = changes.build({"preset": "cross3dreg", "overlap": own, "match": own, "estimate": own})
    assert (built.overlap.weights, built.match.weights) == (own["weights"], own["weights"])
    with pytest.raises(shipped_weights.MissingWeights, match=r"--set overlap\.weights=FOLDER$"):
        changes.build({"preset": "cross3dreg", "match": own, "estimate": own})


@pytest.mark.parametrize("preset", ["cross3dreg", "cross3dreg-as-published", "geotransformer"])
def test_the_estimate_takes_its_numbers_from_the_matches_own_network(
    preset: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped_weights, "require", lambda *_: None)  # only names are of interest here
    mine = {"weights": str(tmp_path / "mine")}

    def of(more: dict[str, Any]) -> Any:
        return changes.build({"preset": preset, **more}).estimate

    old = of({}).weights
    assert old == changes.build({"preset": preset}).match.weights
    assert of({"match": mine}).weights == mine["weights"]
    assert of({"match": mine, "estimate": {"steps": 7}}).weights == mine["weights"]
    assert of({"estimate": {"steps": 7}, "match": mine}).steps == 7
    assert of({"match": mine, "estimate": {"weights": "other"}}).weights == "other"
    assert of({"match": {"stage": "geotransformer", **mine}}).weights == mine["weights"]
    assert of({"overlap": {"stage": "omp", **mine}}).weights == old
    # Saved and merged settings, and objects in Python.
    text = changes.merge({"preset": preset}, changes.parse([f"match.weights={mine['weights']}"]))
    assert changes.build(text).estimate.weights == mine["weights"]
    pipe = hr.Pipeline(**presets.load(preset))
    match = dataclasses.replace(pipe.match, **mine)
    assert pipe.swap(match=match).estimate.weights == mine["weights"]
    assert pipe.swap(match=match, estimate=pipe.estimate).estimate.weights == old
    assert pipe.swap(match=match).swap(voxel=0.3).estimate.weights == mine["weights"]
    assert pipe.swap(match={"stage": "geotransformer", "untrained": True}).estimate.weights is None
    (tmp_path / "published.pth.tar").write_bytes(b"")
    assert of({"match": {"weights": str(tmp_path / "published.pth.tar")}}).weights is None
    # What named other weights before keeps them.
    other = pipe.swap(estimate=dataclasses.replace(pipe.estimate, weights="other"))
    assert other.swap(match=match).estimate.weights == "other"
    assert pipe.swap(refine="gicp").estimate.weights == old


def test_own_weights_of_the_match_suffice_where_shipped_ones_are_missing(drop: Path, tmp_path: Path) -> None:
    (drop / "geotransformer-small").rename(tmp_path / "mine")
    built = changes.build({"preset": "geotransformer", "match": {"weights": str(tmp_path / "mine")}})
    assert built.estimate.weights == str(tmp_path / "mine")
    pair, _ = testing.sample_pair(n_points=600)
    assert built.run(pair).transformation.shape == (4, 4)


def test_half_a_folder_is_no_weights(package: Path) -> None:
    (package / "cross3dreg-small").mkdir(parents=True)
    (package / "cross3dreg-small" / "config.json").write_text("{}")
    assert shipped_weights.names() == []
    assert shipped_weights.find("cross3dreg-small") is None


def test_a_folder_that_is_not_there_is_told_as_such() -> None:
    with pytest.raises(
        FileNotFoundError, match=r"^this pipeline needs the weights 'runs/x/last', a folder that is not there"
    ):
        changes.build({"match": {"stage": "vgam", "weights": "runs/x/last"}, "estimate": "svd"})
