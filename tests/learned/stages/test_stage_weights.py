# SPDX-License-Identifier: MIT
"""Where a stage's weights come from, and which it refuses."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg import testing
from hybridreg.io import shipped_weights
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.geotransformer.official_names import official_name
from hybridreg.learned.stages import networks
from hybridreg.learned.untrained import untrained_parts
from hybridreg.matches import Overlap
from hybridreg.stage import Stage

MakeWeights = Callable[..., str]
CROSS, PLAIN = named_config("nano", omp=True, vgam=True), named_config("nano")


@pytest.mark.parametrize("cls", [hr.Omp, hr.Vgam, hr.GeoTransformer])
def test_no_weights_are_refused_at_once(cls: type[Stage]) -> None:
    with pytest.raises(ValueError, match=f"{cls.__name__}: .*these weights are random.*untrained=True"):
        cls()


@pytest.mark.parametrize(
    "cls", [hr.Fcgf, hr.Predator, hr.PredatorOverlap, hr.Cofinet, hr.OmNet, hr.Roitr, hr.Vrhcf]
)
def test_weights_of_the_package_are_taken_where_none_are_named(
    cls: type[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped_weights, "_folder", lambda: tmp_path)
    with pytest.raises(ValueError, match="these weights are random"):
        cls()
    for name in ("config.json", "model.safetensors"):
        (tmp_path / f"{cls.kind}-small").mkdir(exist_ok=True)
        (tmp_path / f"{cls.kind}-small" / name).touch()
    assert cls().weights == f"{cls.kind}-small"
    # Who asks for a size or for random weights gets what was asked for.
    assert cls(untrained=True).weights is None
    assert cls(untrained=True, size="nano").weights is None
    assert cls(weights=str(tmp_path)).weights == str(tmp_path)
    with pytest.raises(ValueError, match="these weights are random"):
        cls(size="nano")


def test_a_pipeline_of_random_weights_is_not_built() -> None:
    with pytest.raises(ValueError, match="random"):
        hr.Pipeline(overlap="omp")


def test_random_weights_in_a_folder_are_found_out(tmp_path: Path) -> None:
    hr.Vgam(untrained=True).save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="these weights are random: backbone, transformer, vgam of"):
        hr.Vgam.from_pretrained(tmp_path)
    pair, _ = testing.sample_pair(n_points=1000)
    with pytest.raises(ValueError, match="these weights are random"):
        hr.Pipeline(voxel=0.5, match=hr.Vgam(weights=str(tmp_path)), estimate="lgr").run(pair)
    insisted = hr.Pipeline(
        voxel=0.5, match=hr.Vgam(weights=str(tmp_path), untrained=True), estimate="lgr", refine="none"
    )
    assert "Vgam ran with random weights (untrained=True)" in insisted.run(pair).notes


def test_one_part_that_was_never_trained_is_named(make_weights: MakeWeights) -> None:
    folder = make_weights(CROSS, but=("omp",))
    assert hr.Vgam.from_pretrained(folder).weights == folder
    with pytest.raises(ValueError, match="random: omp of"):
        hr.Omp.from_pretrained(folder)


def test_one_step_of_training_is_enough_to_be_trained() -> None:
    network = RegistrationNetwork(PLAIN)
    assert untrained_parts(network) == {"backbone", "transformer"}
    norm = next(p for name, p in network.backbone.named_parameters() if "norm" in name)
    with torch.no_grad():
        norm[0] += 1e-4
    assert untrained_parts(network) == {"transformer"}


def test_what_a_stage_saves_it_takes_back(make_weights: MakeWeights, tmp_path: Path) -> None:
    stage = hr.Omp.from_pretrained(make_weights(CROSS))
    stage.save_pretrained(tmp_path / "again")
    again = hr.Omp.from_pretrained(tmp_path / "again")
    scene, _ = testing.sample_scene()
    other, _ = testing.sample_scene()
    assert np.array_equal(stage(scene).source, again(other).source)
    assert stage(scene).source.std() > 0.0


def test_weights_of_another_network_are_refused(make_weights: MakeWeights) -> None:
    plain, cross = make_weights(PLAIN, name="plain"), make_weights(CROSS, name="cross")
    with pytest.raises(ValueError, match=r"plain' hold no overlapping mask predictor"):
        hr.Omp.from_pretrained(plain)
    with pytest.raises(ValueError, match=r"plain' hold no visual-geometric attention; GeoTransformer"):
        hr.Vgam.from_pretrained(plain)
    with pytest.raises(ValueError, match=r"were trained with a visual-geometric attention.*Vgam"):
        hr.GeoTransformer.from_pretrained(cross)
    with pytest.raises(ValueError, match="have their own configuration"):
        hr.GeoTransformer.from_pretrained(plain, size="nano")


def test_missing_and_damaged_weights_are_told(make_weights: MakeWeights, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no-such-weights"):
        hr.Vgam.from_pretrained("no-such-weights")
    with pytest.raises(FileNotFoundError, match=r"no checkpoint .*gone.pth.tar"):
        hr.GeoTransformer.load_official(tmp_path / "gone.pth.tar")
    folder = Path(make_weights(PLAIN))
    whole = (folder / "model.safetensors").read_bytes()
    (folder / "model.safetensors").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"model.safetensors is damaged"):
        hr.GeoTransformer.from_pretrained(folder)


def test_weights_that_changed_on_disk_are_read_again(make_weights: MakeWeights) -> None:
    folder = make_weights(PLAIN)
    stage = hr.GeoTransformer(weights=folder)
    old = stage.network()
    assert stage.network() is old
    changed = RegistrationNetwork(PLAIN)
    with torch.no_grad():
        for parameter in changed.parameters():
            parameter += 0.5
    hr.learned.weights.save_pretrained(changed, folder)
    assert not torch.equal(stage.network().in_proj.bias, old.in_proj.bias)


def test_a_published_checkpoint_is_a_stage(tmp_path: Path) -> None:
    network = RegistrationNetwork(named_config("geotransformer-3dmatch"))
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            parameter += 0.01 * ("norm" in name)
    state = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    torch.save({"epoch": 1, "model": state}, tmp_path / "geo.pth.tar")
    stage = hr.GeoTransformer.load_official(tmp_path / "geo.pth.tar")
    assert stage.weights == str(tmp_path / "geo.pth.tar")
    loaded = stage.network()
    assert loaded.config == named_config("geotransformer-3dmatch")
    assert loaded.config.backbone.norm_scope == "stacked", "the published weights were trained so"
    assert not loaded.training


def test_vanilla_self_attention_is_a_matter_of_the_weights(make_weights: MakeWeights) -> None:
    vanilla = dataclasses.replace(
        named_config("nano", omp=True),
        transformer=dataclasses.replace(PLAIN.transformer, self_attention="vanilla"),
    )
    folder = make_weights(vanilla)
    scene, _ = testing.sample_scene()
    overlap = hr.Omp.from_pretrained(folder)(scene)
    assert len(hr.GeoTransformer.from_pretrained(folder)(scene, overlap))


def test_a_gpu_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ValueError, match=r"device='cuda': torch finds no GPU"):
        hr.Vgam(untrained=True, device="cuda").network()


def test_loading_leaves_the_callers_generator_alone(make_weights: MakeWeights) -> None:
    folder = make_weights(CROSS)
    networks._load.cache_clear()
    torch.manual_seed(3)
    before = torch.get_rng_state()
    hr.Vgam.from_pretrained(folder).network()
    assert torch.equal(before, torch.get_rng_state())


def test_a_pipeline_travels_through_a_file(make_weights: MakeWeights, tmp_path: Path) -> None:
    folder = make_weights(CROSS)
    pipe = hr.Pipeline(
        voxel=0.5,
        overlap=hr.Omp(weights=folder),
        match=hr.Vgam(weights=folder, min_overlap=0.3),
        estimate=hr.Lgr(max_distance=1.0),
        refine="none",
    )
    pipe.save(tmp_path / "pipe.toml")
    again = hr.Pipeline.load(tmp_path / "pipe.toml")
    assert pickle.loads(pickle.dumps(pipe)) == pipe
    assert again.to_spec() == pipe.to_spec()
    pair, _ = testing.sample_pair(n_points=1000)
    assert np.array_equal(again.run(pair).transformation, pipe.run(pair).transformation)


def test_a_path_is_as_good_as_its_name(make_weights: MakeWeights) -> None:
    folder = make_weights(CROSS)
    assert hr.Omp(weights=Path(folder)) == hr.Omp(weights=folder)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"min_overlap=1.5 must lie in"):
        hr.Vgam(weights=folder, min_overlap=1.5)


def test_an_image_means_nothing_to_weights_that_never_saw_one(make_weights: MakeWeights) -> None:
    stage = hr.Vgam(weights=make_weights(CROSS, but=("image_encoder",)))
    scene, _ = testing.sample_scene()
    blind = dataclasses.replace(scene, pair=dataclasses.replace(scene.pair, image=None), notes=[], _shared={})
    full = Overlap.full(len(scene.source), len(scene.target))
    assert np.array_equal(stage(scene, full).weight, stage(blind, full).weight)
    assert any("trained without images" in note for note in scene.notes)
    assert any("no image" in note for note in blind.notes)
