# SPDX-License-Identifier: MIT
"""The whole network: no truth near inference, the mask's fallbacks, image or none, sizes."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.cross3dreg.config import MatchingConfig, NetworkConfig, OmpConfig, TransformerConfig
from hybridreg.learned.cross3dreg.image_encoder import ImageEncoder
from hybridreg.learned.cross3dreg.image_input import image_tensor
from hybridreg.learned.cross3dreg.network import Output, RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.cross3dreg.superpoint_mask import cap, keep_all, keep_predicted
from hybridreg.learned.cross3dreg.targets import compute_targets
from hybridreg.learned.geotransformer.structure_embedding import StructureEmbedding
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.pyramid.patches import build_patches


@torch.no_grad()
def run(network: RegistrationNetwork, batch: Batch) -> Output:
    """One pass in evaluation mode."""
    return network.eval()(batch)


def same(first: Output, second: Output) -> bool:
    """Bit-equal matches."""
    names = ("target", "source", "weight", "group")
    return all(torch.equal(getattr(first.matches, n), getattr(second.matches, n)) for n in names)


def test_forward_takes_no_truth_and_none_changes_it(
    network: RegistrationNetwork, batch: Batch, nano: NetworkConfig
) -> None:
    assert list(inspect.signature(RegistrationNetwork.forward).parameters) == ["self", "batch"]
    first = run(network, batch)
    compute_targets(batch.pyramid, torch.from_numpy(yaw(120.0)), nano)
    assert same(first, run(network, batch))
    assert len(first.matches) > 0


def test_mask_off_is_geotransformer_bit_for_bit(batch: Batch) -> None:
    torch.manual_seed(3)
    plain = RegistrationNetwork(named_config("nano"))
    masked = RegistrationNetwork(named_config("nano", omp=True))
    masked.load_state_dict(plain.state_dict(), strict=False)
    blind = replace(
        batch, image=None
    )  # without an image and the other cloud the mask is uninformed: all stay
    assert same(run(plain, batch), run(masked, blind))


def test_matches_whose_ends_the_mask_believes_least_are_left_out(batch: Batch) -> None:
    torch.manual_seed(3)
    config = named_config("nano", omp=True)
    assert config.omp is not None
    all_of_them = RegistrationNetwork(replace(config, omp=replace(config.omp, threshold=0.0)))
    doubting = RegistrationNetwork(replace(config, omp=replace(config.omp, threshold=0.0, doubted=0.25)))
    doubting.load_state_dict(all_of_them.state_dict())
    whole, part = run(all_of_them, batch), run(doubting, batch)
    assert 0 < len(part.matches) < len(whole.matches)
    assert len(part.matches) == pytest.approx(0.75 * len(whole.matches), rel=0.1)

    def belief(output: Output) -> torch.Tensor:
        assert output.overlap is not None
        encoding, matches = output.encoding, output.matches
        target, source = torch.sigmoid(output.overlap.target), torch.sigmoid(output.overlap.source)
        return (
            target[encoding.target.patches.owner[matches.target_index]]
            * source[encoding.source.patches.owner[matches.source_index]]
        )

    least = belief(part).min()
    assert int((belief(whole) >= least).sum()) == len(part.matches)


def test_gated_visual_attention_starts_as_geotransformer(batch: Batch) -> None:
    torch.manual_seed(4)
    plain = RegistrationNetwork(named_config("nano"))
    config = named_config("nano", vgam=True)
    assert config.vgam is not None
    seeing = RegistrationNetwork(replace(config, vgam=replace(config.vgam, gated=True)))
    seeing.load_state_dict(plain.state_dict(), strict=False)
    assert same(run(plain, batch), run(seeing, batch))


def test_the_image_matters_and_may_be_missing(network: RegistrationNetwork, batch: Batch) -> None:
    with_image, without = run(network, batch), run(network, replace(batch, image=None))
    assert not torch.equal(with_image.node_features[0][:5], without.node_features[0][:5])
    assert all(torch.isfinite(f).all() for f in without.node_features)
    assert with_image.overlap is not None
    assert without.overlap is not None
    assert with_image.overlap.informed
    assert not without.overlap.informed


@pytest.mark.parametrize("formula", ["figure", "text"])
@pytest.mark.parametrize("cross", [False, True])
@pytest.mark.parametrize("position", ["none", "sine"])
def test_every_form_of_omp_runs(batch: Batch, formula: str, cross: bool, position: str) -> None:
    omp = OmpConfig(dim=64, heads=2, formula=formula, cross_cloud=cross, position=position)  # type: ignore[arg-type]
    network = RegistrationNetwork(replace(named_config("nano", omp=True), omp=omp))
    logits = run(network, batch).overlap
    assert logits is not None
    assert logits.target.shape == (batch.pyramid.lengths[-1][0],)
    assert logits.source.shape == (batch.pyramid.lengths[-1][1],)
    blind = run(network, replace(batch, image=None)).overlap
    assert blind is not None
    assert blind.informed == cross


@pytest.mark.parametrize("position", ["none", "mlp", "radial"])
@pytest.mark.parametrize("attention", ["geometric", "vanilla"])
def test_every_form_of_attention_runs(batch: Batch, position: str, attention: str) -> None:
    config = named_config("nano", omp=True, vgam=True)
    assert config.vgam is not None
    config = replace(
        config,
        vgam=replace(config.vgam, point_position=position),  # type: ignore[arg-type]
        transformer=replace(config.transformer, self_attention=attention),  # type: ignore[arg-type]
    )
    features = run(RegistrationNetwork(config), batch).node_features
    assert torch.allclose(features[0].norm(dim=1), torch.ones(len(features[0])), atol=1e-5)


def ladder(probability: torch.Tensor, occupied: int):  # type: ignore[no-untyped-def]
    """Patches of len(probability) superpoints, of which the first ``occupied`` own a point."""
    nodes = torch.arange(len(probability)).float()[:, None] * torch.tensor([10.0, 0, 0])
    return build_patches(nodes[:occupied], nodes, 4)


def test_the_mask_ladder() -> None:
    config = OmpConfig(min_kept=5, min_kept_share=0.2)
    probability = torch.linspace(0, 1, 40)
    kept = keep_predicted(probability, ladder(probability, 40), config)
    assert kept.fallback == "none"
    assert kept.index.tolist() == list(range(20, 40))
    low = probability * 0.4
    kept = keep_predicted(low, ladder(low, 40), config)
    assert kept.fallback == "topk"
    assert kept.index.tolist() == list(range(32, 40))
    kept = keep_predicted(low, ladder(low, 30), config)  # the most probable own nothing
    assert kept.fallback == "all"
    assert kept.index.tolist() == list(range(30))


def test_the_cap_takes_the_first_by_priority() -> None:
    probability = torch.linspace(0, 1, 40)
    kept = cap(keep_all(ladder(probability, 40)), probability, 10)
    assert kept.index.tolist() == list(range(30, 40))
    assert kept.capped == 30
    assert cap(kept, probability, 10) is kept


def test_a_capped_network_stays_within_its_cap(batch: Batch) -> None:
    config = named_config("nano")
    capped = replace(config, matching=replace(config.matching, max_superpoints=20))
    output = run(RegistrationNetwork(capped), batch)
    assert [len(f) for f in output.node_features] == [20, 20]
    assert output.kept[0].capped == batch.pyramid.lengths[-1][0] - 20


def test_structure_is_unchanged_by_motion_and_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    from hybridreg.learned.geotransformer import structure_embedding

    torch.manual_seed(0)
    embedding = StructureEmbedding(32, 4.0, 15.0, 3)
    points = torch.from_numpy(street(5, 30)).double()
    embedding = embedding.double()
    turned = points @ torch.from_numpy(yaw(77.0)[:3, :3]).T + 5.0
    whole = embedding(points)
    assert torch.allclose(whole, embedding(turned), atol=1e-5)
    monkeypatch.setattr(structure_embedding, "_CHUNK_VALUES", 1)
    assert torch.allclose(whole, embedding(points), atol=1e-12)


def test_products_with_structure_from_curves_alone_equal_those_with_every_vector() -> None:
    torch.manual_seed(1)
    embedding = StructureEmbedding(32, 4.0, 15.0, 1)
    points = torch.from_numpy(street(5, 30)).float()
    vectors = torch.randn(len(points), 4, 32)
    found = {}
    for form, structure in {"vectors": embedding(points), "curves": embedding.table(points)}.items():
        embedding.zero_grad()
        asked = vectors.clone().requires_grad_()
        products = (
            (asked @ structure.transpose(1, 2)).transpose(0, 1)
            if isinstance(structure, torch.Tensor)
            else structure.products(asked)
        )
        assert products.shape == (4, len(points), len(points))
        products.square().mean().backward()
        gradients = [asked.grad, *(parameter.grad for parameter in embedding.parameters())]
        found[form] = [products.detach(), *gradients]
    for one, other in zip(*found.values(), strict=True):
        assert torch.allclose(one, other, rtol=1e-4, atol=1e-5 * float(one.abs().max()))


@pytest.mark.parametrize(("angle_k", "n"), [(3, 9), (1, 1)])
def test_where_products_do_not_suffice_structure_is_made_of_vectors(angle_k: int, n: int) -> None:
    embedding = StructureEmbedding(16, 4.0, 15.0, angle_k)
    points = torch.rand(n, 3)
    table = embedding.table(points)
    assert isinstance(table, torch.Tensor)
    assert torch.equal(table, embedding(points))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_structure_of_few_superpoints(n: int) -> None:
    embedding = StructureEmbedding(16, 4.0, 15.0, 3)
    for points in (torch.rand(n, 3), torch.zeros(n, 3)):
        found = embedding(points)
        assert found.shape == (n, n, 16)
        assert torch.isfinite(found).all()


def test_turning_the_source_turns_the_pose_of_frozen_features(
    network: RegistrationNetwork, batch: Batch
) -> None:
    matches = run(network, batch).matches
    turn = yaw(63.0, (1.0, 2.0, 3.0))
    weight, group, target = matches.weight.double(), matches.group, matches.target.double()
    source = matches.source.double()
    turned = torch.from_numpy(source.numpy() @ turn[:3, :3].T + turn[:3, 3])
    plain = local_to_global(target, source, weight, group).transform.numpy()
    after = local_to_global(target, turned, weight, group).transform.numpy()
    # the 1e-5 in the published weights' sum moves centroids by a part in 1e5
    assert np.abs(after @ turn - plain).max() < 1e-3


def test_a_planted_truth_is_found_from_point_to_pose(
    pair: tuple[np.ndarray, np.ndarray], truth: np.ndarray
) -> None:
    """With features that say where a point is, everything after the backbone must work."""
    config = replace(
        named_config("nano"),
        transformer=TransformerConfig(hidden_dim=64, output_dim=64, heads=2, blocks=()),
        matching=MatchingConfig(superpoint_matches=64, matching_radius=1.0, sinkhorn_iterations=20),
    )
    network = RegistrationNetwork(config).eval()
    batch = make_batch(*pair, config)
    with torch.no_grad():
        encoding = network.encode(batch)
        frame = (np.eye(4), truth)
        clouds = []
        for cloud, pose in zip((encoding.target, encoding.source), frame, strict=True):
            gen = torch.Generator().manual_seed(0)
            waves = torch.randn(3, 64, generator=gen) * 1.5
            point = torch.from_numpy(moved(cloud.points.numpy(), pose))
            node = torch.from_numpy(moved(cloud.nodes.numpy(), pose))
            clouds.append(replace(cloud, point_features=6 * torch.cos(point @ waves), node_features=node))
        planted = replace(encoding, target=clouds[0], source=clouds[1])
        gen = torch.Generator().manual_seed(1)
        waves = torch.randn(3, 64, generator=gen) * 0.25
        features = [torch.nn.functional.normalize(torch.cos(c.node_features @ waves), dim=1) for c in clouds]
        kept = network.keep(planted, None)
        superpoints = network.match_superpoints(planted, kept, (features[0], features[1]))
        matches = network.match_points(planted, superpoints)
        pose = local_to_global(matches.target, matches.source, matches.weight, matches.group, config.lgr)
    found = pose.transform.double().numpy() @ np.linalg.inv(truth)
    assert np.abs(found[:3, :3] - np.eye(3)).max() < 0.05
    assert int(pose.inliers.sum()) > 30


@pytest.mark.parametrize(("name", "parameters"), [("full", 25.5e6), ("small", 7.1e6), ("tiny", 1.8e6)])
def test_sizes_have_their_number_of_parameters(name: str, parameters: float) -> None:
    network = RegistrationNetwork(named_config(name))
    assert sum(p.numel() for p in network.parameters()) == pytest.approx(parameters, rel=0.1)


def test_unknown_size_lists_the_known() -> None:
    with pytest.raises(KeyError, match="full, small, tiny, nano"):
        named_config("huge")


@pytest.mark.parametrize("shape", [(60, 100, 3), (100, 60, 3), (50, 50)])
def test_letter_box(shape: tuple[int, ...]) -> None:
    tensor = image_tensor(np.full(shape, 255, np.uint8), 36, 64)
    assert tensor.shape == (3, 36, 64)
    assert tensor[:, 18, 32].min() > 2.0
    if shape[0] != 60:
        assert tensor[:, 18, 0].abs().max() == 0


@pytest.mark.parametrize(
    "bad", [np.zeros((4, 4, 3)), np.zeros((4, 4, 4), np.uint8), np.zeros((0, 4, 3), np.uint8)]
)
def test_bad_images_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="image"):
        image_tensor(bad, 36, 64)


@pytest.mark.parametrize("stride", [1, 2, 4, 8])
def test_image_encoder_strides_and_dropout(nano: NetworkConfig, stride: int) -> None:
    assert nano.image is not None
    config = replace(nano.image, output_stride=stride, dropout=1.0)  # type: ignore[arg-type]
    encoder = ImageEncoder(config).eval()
    image = torch.randn(3, config.height, config.width)
    grid = encoder(image).grid
    assert grid is not None
    assert grid.shape == (config.dim, config.height // stride, config.width // stride)
    assert encoder.train()(image).grid is None


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"vote_temperature": 0.0}, "vote_temperature=0.0 must be positive"),
        ({"consistency": -1.0}, "consistency=-1.0 must be positive"),
        ({"uniqueness": 1.5, "vote_temperature": 0.1}, "uniqueness=1.5 must lie in"),
        ({"uniqueness": 0.1}, "uniqueness=0.1 needs a vote_temperature"),
    ],
)
def test_matching_that_cannot_be_is_refused(changes: dict[str, float], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        MatchingConfig(**changes)


def test_votes_and_filters_only_leave_matches_out(network: RegistrationNetwork, batch: Batch) -> None:
    plain = network.config
    matching = replace(plain.matching, vote_temperature=0.05, consistency=5.0)
    strict = replace(matching, uniqueness=0.02)
    found = []
    try:
        for config in (matching, strict):
            network.config = replace(plain, matching=config)
            with torch.no_grad():
                found.append(network(batch))
                output = found[-1]
                _, all_matches = network.match(
                    output.encoding, output.kept, output.node_features, filtered=False
                )
            assert 0 < len(output.matches) < len(all_matches)
    finally:
        network.config = plain
    loose, tight = found
    assert len(loose.superpoints) == len(tight.superpoints) > 0
    assert float(loose.superpoints.score.max()) == 1.0
    assert 0 < len(tight.matches) <= len(loose.matches)
    assert bool((tight.matches.weight <= 1.0).all())
