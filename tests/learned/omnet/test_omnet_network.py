# SPDX-License-Identifier: MIT
"""OMNet's iterations, losses and labels, and that it learns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from hybridreg.learned.omnet.batch import OmnetBatch, make_batch
from hybridreg.learned.omnet.config import OmnetConfig, OmnetLossConfig, named_config
from hybridreg.learned.omnet.losses import mask_loss, quaternion_loss
from hybridreg.learned.omnet.network import OmnetNetwork
from hybridreg.learned.omnet.published_errors import pose_errors
from hybridreg.learned.omnet.quaternions import compose, matrix_of, multiply, pose_of, rotate
from hybridreg.learned.omnet.targets import compute_targets, overlap_labels

Four = tuple[OmnetBatch, torch.Tensor]
DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")),
]


def overfitted(four: Four, seed: int) -> tuple[list[float], list[float]]:
    """Loss and mean error of the rotation, degrees, of each step."""
    batch, truth = four
    torch.manual_seed(seed)
    network = OmnetNetwork(named_config("nano")).train()
    targets = compute_targets(truth)
    optimiser = torch.optim.Adam(network.parameters(), lr=5e-3)
    losses, errors = [], []
    for _ in range(200):
        output = network(batch)
        loss = torch.stack(list(network.losses(output, targets).values())).sum()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
        found = output.transform.detach().double().numpy()
        errors.append(float(pose_errors(found, truth.double().numpy(), "xyz")["Err_R"]))
    return losses, errors


def test_four_pairs_are_overfitted(four_shapes: Four) -> None:
    # Rounding decides where so small a network ends: on some processors one seed in a few comes to rest at 20 degrees.
    ends = []
    for seed in range(4):
        losses, errors = overfitted(four_shapes, seed)
        assert errors[0] > 20.0
        ends.append((np.mean(errors[-5:]), np.mean(losses[-5:]) / losses[0]))
        if ends[-1][0] < 10.0 and ends[-1][1] < 0.3:
            return
    pytest.fail(f"degrees and share of the loss at the end of each seed: {ends}")


def test_masks_come_from_the_iteration_before(nano_omnet: OmnetNetwork, four_shapes: Four) -> None:
    steps = nano_omnet(four_shapes[0]).steps
    assert len(steps) == nano_omnet.config.iterations
    for i, step in enumerate(steps):
        if i < nano_omnet.config.mask_delay:
            assert bool(step.source_mask.all())
            assert bool(step.target_mask.all())
        else:
            assert torch.equal(step.source_mask, steps[i - 1].source_logits.argmax(1) == 1)
            assert torch.equal(step.target_mask, steps[i - 1].target_logits.argmax(1) == 1)


def test_points_left_out_change_nothing(nano_omnet: OmnetNetwork, four_shapes: Four) -> None:
    batch, _ = four_shapes
    masks = [torch.ones(4, 120, dtype=torch.bool) for _ in range(2)]
    masks[0][:, 70:], masks[1][:, :30] = False, False
    moved = OmnetBatch(source=batch.source.clone(), target=batch.target.clone())
    moved.source[:, 70:] += 5.0
    moved.target[:, :30] -= 3.0
    with torch.no_grad():
        one, two = (nano_omnet.step(0, each, masks, None) for each in (batch, moved))
    assert torch.allclose(one.pose, two.pose, atol=1e-6)
    scores = one.source_logits[:, :, 70:]
    assert torch.allclose(scores, scores[:, :, :1].expand_as(scores)), "points left out share one score"


def test_the_last_pose_is_all_steps_in_turn(nano_omnet: OmnetNetwork, four_shapes: Four) -> None:
    batch, _ = four_shapes
    with torch.no_grad():
        output = nano_omnet(batch)
    T = np.tile(np.eye(4), (4, 1, 1))
    for step in output.steps:
        seen = batch.source.double().numpy() @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
        assert np.allclose(seen, step.source_points.numpy(), atol=1e-5)
        move = np.tile(np.eye(4), (4, 1, 1))
        move[:, :3] = matrix_of(step.pose_step).numpy()
        T = move @ T
    assert np.allclose(T[:, :3], output.transform.numpy(), atol=1e-5)


def test_no_gradient_goes_from_one_iteration_to_another(four_shapes: Four) -> None:
    network = OmnetNetwork(named_config("nano")).train()
    network(four_shapes[0]).steps[2].pose.sum().backward()
    touched = [
        any(p.grad is not None and bool(p.grad.any()) for p in part.parameters()) for part in network.encoder
    ]
    assert touched == [False, False, True]


def test_a_single_pair_cannot_be_trained(nano_omnet: OmnetNetwork, four_shapes: Four) -> None:
    one = OmnetBatch(source=four_shapes[0].source[:1], target=four_shapes[0].target[:1])
    assert nano_omnet(one).transform.shape == (1, 3, 4)
    with pytest.raises(ValueError, match="2 pairs or more a step, not with 1"):
        nano_omnet.train()(one)


def test_quaternions_as_scipy_has_them() -> None:
    rng = np.random.default_rng(0)
    turns = [Rotation.random(9, rng) for _ in range(2)]
    a, b = (torch.from_numpy(np.roll(turn.as_quat(), 1, axis=1)) for turn in turns)
    points = torch.from_numpy(rng.normal(size=(9, 5, 3)))
    turned = (turns[1] * turns[0]).as_matrix()
    first_then_second = torch.cat([multiply(a, b), torch.zeros(9, 3)], 1)
    assert np.allclose(matrix_of(first_then_second)[:, :, :3], turned)
    assert np.allclose(rotate(a, points), np.einsum("bij,bnj->bni", turns[0].as_matrix(), points))
    poses = torch.cat([a, torch.from_numpy(rng.normal(size=(9, 3)))], 1)
    assert np.allclose(matrix_of(pose_of(matrix_of(poses))), matrix_of(poses))
    assert bool((pose_of(matrix_of(poses))[:, 0] >= 0).all())
    inverse = pose_of(
        torch.linalg.inv(torch.cat([matrix_of(poses), torch.eye(4).double()[3:].expand(9, 1, 4)], 1))
    )
    assert np.allclose(matrix_of(compose(poses, inverse))[:, :, 3], 0.0, atol=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_have_quaternions_too(axis: int) -> None:
    R = -np.eye(3)
    R[axis, axis] = 1.0
    pose = pose_of(torch.from_numpy(np.column_stack([R, [1.0, 2.0, 3.0]]))[None])
    assert pose[0, 1 + axis].abs() == pytest.approx(1.0)
    assert np.allclose(matrix_of(pose)[0, :, :3], R)


def test_labels_are_partners_under_the_true_pose(four_shapes: Four) -> None:
    batch, truth = four_shapes
    found = overlap_labels(batch.source, batch.target, None, truth, 0.1)
    moved = batch.source @ truth[:, :, :3].transpose(1, 2) + truth[:, None, :, 3]
    apart = torch.cdist(moved.double(), batch.target.double())
    assert torch.equal(found[0], apart.min(2).values < 0.1)
    assert torch.equal(found[1], apart.min(1).values < 0.1)


def test_released_labels_hang_on_the_masks(four_shapes: Four) -> None:
    batch, truth = four_shapes
    every = overlap_labels(batch.source, batch.target, None, truth, 0.1)
    masks = (torch.ones(4, 120, dtype=torch.bool), torch.zeros(4, 120, dtype=torch.bool))
    masks[1][:, :40] = True
    found = overlap_labels(batch.source, batch.target, masks, truth, 0.1)
    assert not bool(found[1][:, 40:].any()), "points left out never overlap"
    assert torch.equal(found[1][:, :40], every[1][:, :40])
    assert int(found[0].sum()) < int(every[0].sum()), "nor do those whose only partners were left out"


@pytest.mark.parametrize("labels", ["masked", "true"])
def test_true_labels_are_an_option(nano_omnet: OmnetNetwork, four_shapes: Four, labels: str) -> None:
    batch, truth = four_shapes
    nano_omnet.config = replace(nano_omnet.config, loss=OmnetLossConfig(labels=labels))  # type: ignore[arg-type]
    output = nano_omnet(batch)
    last = replace(output.steps[-1], source_mask=torch.zeros(4, 120, dtype=torch.bool))
    output = replace(output, steps=(last,))
    loss = nano_omnet.losses(output, compute_targets(truth))["mask_0"]
    every = overlap_labels(batch.source, batch.target, None, truth, 0.1)
    sides = [
        mask_loss(x, y, OmnetLossConfig())
        for x, y in zip((last.source_logits, last.target_logits), every, strict=True)
    ]
    assert (float(loss) == pytest.approx(float(sum(sides)) / 2)) == (labels == "true")


def test_mask_losses_by_hand() -> None:
    logits, labels = torch.zeros(2, 2, 3), torch.tensor([[True, False, False], [True, True, True]])
    logits[0, 0, 0] = 2.0
    point = float(torch.log(1 + torch.exp(torch.tensor(2.0))))  # of the one wrong point; others cost log 2
    cloud = [0.3 * point + 2 * 0.7 * np.log(2), 3 * 0.3 * np.log(2)]
    by_batch = mask_loss(logits, labels, OmnetLossConfig())
    by_cloud = mask_loss(logits, labels, OmnetLossConfig(mask_form="megengine"))
    assert float(by_batch) == pytest.approx(sum(cloud) / (4 * 0.3 + 2 * 0.7), rel=1e-6)
    assert float(by_cloud) == pytest.approx((cloud[0] / 1.7 + cloud[1] / 0.9) / 2, rel=1e-6)


def test_the_sign_of_a_quaternion_counts_unless_told_otherwise() -> None:
    true, found = torch.tensor([[1.0, 0.0, 0.0, 0.0]]), torch.tensor([[-1.0, 0.0, 0.0, 0.0]])
    assert float(quaternion_loss(found, true, signed=True)) == pytest.approx(0.5)
    assert float(quaternion_loss(found, true, signed=False)) == 0.0


def test_units_go_there_and_back() -> None:
    rng = np.random.default_rng(0)
    target, source = rng.normal(0, 9, (300, 3)), rng.normal(2, 4, (50, 3))
    centres = (np.array([1.0, 2.0, 3.0]), np.array([-1.0, 0.0, 4.0]))
    batch, units = make_batch(target, source, 80, np.random.default_rng(1), centres=centres)
    assert batch.source.shape == batch.target.shape == (1, 80, 3)
    assert float(batch.target.norm(dim=2).max()) <= 1.0
    metres = batch.source[0].double().numpy() * units.radius + centres[1]
    distance = np.linalg.norm(metres[:, None] - source[None], axis=2)
    assert distance.min(axis=1).max() < 1e-4, "every point is one of the cloud"
    assert set(distance.argmin(axis=1)) == set(range(50)), "of few points all are taken, some twice"
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=1).as_matrix(), [3.0, -2.0, 1.0]
    assert np.allclose(units.metres(units.normalised(T)), T)
    point = source[0]
    normalised = units.normalised(T)
    there = normalised[:3, :3] @ ((point - centres[1]) / units.radius) + normalised[:3, 3]
    assert np.allclose(there * units.radius + centres[0], T[:3, :3] @ point + T[:3, 3])


def test_the_order_of_points_does_not_matter() -> None:
    cloud = np.random.default_rng(0).normal(size=(100, 3))
    shuffled = cloud[np.random.default_rng(1).permutation(100)]
    one, two = (make_batch(each, each, 40, np.random.default_rng(2))[0] for each in (cloud, shuffled))
    assert torch.equal(one.source, two.source)


@pytest.mark.parametrize(
    ("clouds", "message"),
    [
        ((np.zeros((0, 3)), np.ones((2, 3))), "target: no points to choose 5 from"),
        ((np.ones((2, 3)), np.zeros((0, 3))), "source: no points"),
        ((np.zeros((2, 3)), np.zeros((3, 3))), "no extent"),
    ],
)
def test_clouds_without_points_or_extent_are_refused(
    clouds: tuple[np.ndarray, np.ndarray], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make_batch(*clouds, 5, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mask_delay": 0}, "first iteration has no mask"),
        ({"local_layer": 6}, "local_layer=6 must lie in 1 to 5"),
        ({"fusion": ()}, "0 layers of fusion"),
        ({"iterations": 1000}, "iterations=1000"),
        ({"encoder": (8, 10**6)}, "encoder="),
    ],
)
def test_impossible_plans_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        OmnetConfig(**change)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="give two"):
        OmnetLossConfig(class_weights=(1.0, 1.0, 1.0))


@pytest.mark.parametrize("device", DEVICES)
def test_devices_agree(device: str, four_shapes: Four) -> None:
    def run(where: str) -> list[torch.Tensor]:
        torch.manual_seed(0)
        network = OmnetNetwork(named_config("nano")).to(where).train()
        output = network(four_shapes[0].to(where))
        targets = compute_targets(four_shapes[1]).to(where)
        torch.stack(list(network.losses(output, targets).values())).sum().backward()
        gradient = network.encoder[0].layers[1].linear.weight.grad
        assert gradient is not None
        return [output.steps[0].pose.detach().cpu(), gradient.cpu()]

    for got, expected in zip(run(device), run("cpu"), strict=True):
        assert torch.allclose(got, expected, atol=1e-3)
