# SPDX-License-Identifier: MIT
"""Many clouds into one frame: tours with a wrong link, shuffled scans, another place, real sequences."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.data.hard import box_world
from hybridreg.data.loaders.folder import load_pair
from hybridreg.geometry import se3
from hybridreg.many import link_search
from hybridreg.many.alignment_words import against_clouds
from hybridreg.many.links import Link, best_tree, groups, placed
from hybridreg.many.other_ways import elsewhere
from hybridreg.runtime.open3d import load_open3d


@pytest.fixture(autouse=True)
def open3d() -> None:
    try:
        load_open3d()
    except ImportError as error:
        pytest.skip(str(error))


def tour(n: int, seed: int = 11, length: float = 48.0) -> tuple[list[np.ndarray], np.ndarray]:
    """Scans along a made street by three kinds of sensors in turn, and their poses in the first one's frame."""
    rng = np.random.default_rng(seed)
    world = box_world.street(rng, crossing=True)
    poses = [
        box_world.sensor_pose(x, rng.uniform(-2, 2), 1.8, rng.uniform(-180, 180), rng.normal(0, 1))
        for x in np.linspace(-length, length, n)
    ]
    sensors = ("rings32", "rings64", "rings16")
    scans = [box_world.scan(world, sensors[k % 3], T, rng, density=0.8) for k, T in enumerate(poses)]
    return scans, np.array([se3.inverse(poses[0]) @ T for T in poses])


def off(found: hr.Alignment, truth: np.ndarray) -> float:
    """Metres between the placed sensors and the true ones, at most."""
    return float(np.linalg.norm(found.poses[:, :3, 3] - truth[:, :3, 3], axis=1).max())


def test_a_tour_of_eight_scans_survives_a_wrong_link() -> None:
    scans, truth = tour(8, length=20.0)
    wrong = se3.inverse(truth[5]) @ truth[6] @ se3.from_rt(np.eye(3), np.array([4.0, 2.0, 0.0]))
    found = hr.register_all(scans, known={(6, 5): wrong})
    assert found.verdict == "ok", found.summary()
    assert off(found, truth) < 0.1
    assert any("cloud 6 -> cloud 5 was given 4.5 m and 0.0 deg away" in reason for reason in found.reasons)
    assert "cloud 6 -> cloud 5" in found.summary()
    told = json.loads(json.dumps(found.to_dict()))
    np.testing.assert_allclose(told["poses"]["cloud 7"], found.poses[7])


def known_poses(
    truth: np.ndarray, shift: float, rows: list[tuple[int, int]]
) -> dict[tuple[int, int], np.ndarray]:
    """True poses of some pairs, moved by so many metres."""
    off_by = se3.from_rt(np.eye(3), np.array([shift, -0.5 * shift, 0.0]))
    return {(a, b): off_by @ se3.inverse(truth[b]) @ truth[a] for a, b in rows}


@pytest.mark.parametrize(("shift", "apart"), [(0.1, 3), (1.2, 1), (3.0, 2)])
def test_given_poses_are_starts_and_the_clouds_decide(shift: float, apart: int) -> None:
    scans, truth = tour(4, length=12.0)
    rows = [(a, b) for a in range(4) for b in range(a) if a - b <= apart]
    found = hr.register_all(scans, known=known_poses(truth, shift, rows))
    assert found.verdict == "ok", found.summary()
    assert off(found, truth) < 0.1
    assert any("was given" in reason for reason in found.reasons) == (shift > 1.0)


def test_two_given_poses_of_one_source_do_not_place_a_cloud_of_another_place() -> None:
    scans, truth = tour(3, length=9.0)
    wood = box_world.wood(np.random.default_rng(3))
    scans[2] = box_world.scan(wood, "rings32", box_world.sensor_pose(0, 0, 1.8, 0), np.random.default_rng(4))
    found = hr.register_all(scans, known=known_poses(truth, 0.0, [(2, 0), (2, 1)]))
    assert found.placed.tolist() == [True, True, False], found.summary()


def test_a_given_pose_of_clouds_that_show_nothing_of_one_another_is_taken_and_told() -> None:
    scans, _ = tour(2, length=20.0)
    ahead = [scan[np.abs(np.arctan2(scan[:, 1], scan[:, 0])) < 0.4] for scan in scans]
    apart = se3.from_rt(np.eye(3), np.array([-300.0, 0.0, 0.0]))
    found = hr.register_all(ahead, known={(1, 0): apart})
    assert found.verdict == "doubtful"
    np.testing.assert_allclose(found.poses[1], apart)
    assert "given ones that the clouds do not confirm" in " ".join(found.reasons)


def test_shuffled_scans_and_another_reference() -> None:
    scans, truth = tour(4, length=12.0)
    order = [3, 0, 1, 2]
    shuffled = [scans[k] for k in order]
    found = hr.register_all(shuffled, ordered=False, reference=2, names=[f"s{k}" for k in order])
    wanted = se3.inverse(truth[1]) @ truth[order]
    assert found.placed.all(), found.summary()
    assert off(found, wanted) < 0.1
    np.testing.assert_array_equal(found.poses[2], np.eye(4))


def test_a_cloud_of_another_place_is_left_out_by_name() -> None:
    scans, truth = tour(3, length=9.0)
    elsewhere = box_world.scan(
        box_world.wood(np.random.default_rng(3)),
        "rings32",
        box_world.sensor_pose(0, 0, 1.8, 0),
        np.random.default_rng(4),
    )
    found = hr.register_all([*scans[:2], elsewhere, scans[2]], names=["a", "b", "lost", "c"])
    assert found.placed.tolist() == [True, True, False, True], found.summary()
    assert found.verdict == "doubtful"
    assert any(reason.startswith("lost is not placed") for reason in found.reasons)
    assert off_of(found, [0, 1, 3], truth) < 0.1


def off_of(found: hr.Alignment, rows: list[int], truth: np.ndarray) -> float:
    return float(np.linalg.norm(found.poses[rows][:, :3, 3] - truth[:, :3, 3], axis=1).max())


def test_a_real_sequence(real_data: Path) -> None:
    pairs = {
        name: load_pair(real_data / f"sustech-{name}") for name in ("965-to-950", "970-to-965", "975-to-965")
    }
    to_950 = pairs["965-to-950"].T_target_source
    truth = np.array([
        np.eye(4), to_950, to_950 @ pairs["970-to-965"].T_target_source, to_950 @ pairs["975-to-965"].T_target_source
    ])  # fmt: skip
    clouds = [pairs["965-to-950"].pair.target, *(pairs[name].pair.source for name in pairs)]
    found = hr.register_all(clouds)
    assert found.placed.all()
    assert off(found, truth) < 0.2  # the ground truth is good to 5 cm a pair
    assert all(link.role in ("tree", "loop") for link in found.links), found.summary()


def test_the_work_may_be_spread_over_dask() -> None:
    distributed = pytest.importorskip("distributed")
    import joblib

    scans, _ = tour(3, length=6.0)
    here = hr.register_all(scans, preset="birdseye-gicp")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster),
        joblib.parallel_config(backend="dask"),
    ):
        there = hr.register_all(scans, preset="birdseye-gicp")
    np.testing.assert_array_equal(here.poses, there.poses)


@pytest.mark.parametrize("wrong, word", [
    ({"clouds": [np.zeros((30, 3))]}, "1 given, two or more"),
    ({"reference": 9}, "reference=9"),
    ({"reference": True}, "reference=True must be a row of the 3 clouds, 0 to 2"),
    ({"reference": "cloud 1"}, "reference='cloud 1' must be a row"),
    ({"known": {(0, "b"): np.eye(4)}}, "no two rows"),
    ({"workers": 0}, "workers=0 must be 1 or more processes"),
    ({"names": ["a", "a", "b"]}, "each needs one of its own"),
    ({"names": ["a"]}, "names: 1 given for 3"),
    ({"known": {(0, 3): np.eye(4)}}, r"known: \(0, 3\) are no two rows"),
    ({"known": {(1, 1): np.eye(4)}}, r"known: \(1, 1\)"),
    ({"known": {(0, 1): np.zeros((4, 4))}}, r"known\[0, 1\]"),
    ({"seed": -1}, "seed=-1"),
    ({"pipeline": hr.Pipeline.preset("birdseye-gicp"), "voxel": 0.5}, "voxel=0.5 is a preset's"),
])  # fmt: skip
def test_what_cannot_be_is_refused(wrong: dict[str, Any], word: str) -> None:
    rng = np.random.default_rng(0)
    arguments: dict[str, Any] = {"clouds": [rng.normal(size=(100, 3)) for _ in range(3)], **wrong}
    with pytest.raises(ValueError, match=word):
        hr.register_all(arguments.pop("clouds"), **arguments)


def test_a_pipeline_of_ones_own_and_open3d_is_asked_for_before_the_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scans, _ = tour(3, length=6.0)
    own = hr.register_all(scans, pipeline=hr.Pipeline.preset("birdseye-gicp"))
    np.testing.assert_array_equal(own.poses, hr.register_all(scans, preset="birdseye-gicp").poses)
    monkeypatch.setitem(sys.modules, "open3d", None)
    monkeypatch.setattr(link_search, "_linked", lambda *job: pytest.fail("nothing was to be registered"))
    with pytest.raises(ImportError, match="open3d"):
        hr.register_all(scans)


def test_a_bad_cloud_is_told_by_its_name() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="cloud 1: .*points"):
        hr.register_all([rng.normal(size=(100, 3)), np.zeros((5, 3))])


# --- without clouds: which tree is taken


def graph(n: int, wrong: int, seed: int) -> tuple[np.ndarray, list[Link], set[tuple[int, int]]]:
    """A ring of poses with chords; `wrong` links are metres off. Links, and which are wrong."""
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * np.arange(n) / n
    places = 20.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])
    poses = np.array(
        [se3.from_rt(se3.yaw(np.degrees(a))[:3, :3], place) for a, place in zip(angles, places, strict=True)]
    )
    rows = [(k, (k + step) % n) for step in (1, 2, 3) for k in range(n)]
    bad = {rows[k] for k in rng.permutation(len(rows))[:wrong]}
    links = []
    for a, b in rows:
        T = se3.inverse(poses[b]) @ poses[a]
        T[:3, 3] += rng.normal(0, 0.02, 3) + ([5.0, rng.uniform(-5, 5), 0.0] if (a, b) in bad else [0, 0, 0])
        links.append(Link(source=a, target=b, T_target_source=T, verdict="ok", confidence=1.0, metres=0.5))
    return se3.inverse(poses[0]) @ poses, links, bad


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("wrong", [0, 1, 4, 8])
def test_the_tree_with_which_most_links_agree(wrong: int, seed: int) -> None:
    truth, links, bad = graph(20, wrong, seed)
    tree, fit = best_tree(20, links, np.zeros((20, 3)), np.random.default_rng(0))
    left_out = {(link.source, link.target) for link in links if link not in fit}
    assert left_out == bad
    poses = placed(20, tree, 0)
    step = se3.inverse(poses[0]) @ poses
    assert np.linalg.norm(step[:, :3, 3] - truth[:, :3, 3], axis=1).max() < 0.4


def test_groups_that_nothing_joins() -> None:
    _, links, _ = graph(8, 0, 0)
    some = [link for link in links if (link.source < 5) == (link.target < 5)]
    assert groups(8, some) == [[0, 1, 2, 3, 4], [5, 6, 7]]
    assert np.isnan(placed(8, some[:1], 0)[7]).all()
    # Each group has a tree of its own, and no link contradicts those of the other.
    tree, fit = best_tree(8, some, np.zeros((8, 3)), np.random.default_rng(0))
    assert len(tree) == 6
    assert fit == some


def turned(links: list[Link], cloud: int) -> list[Link]:
    """Each link of a cloud with a rival at which that cloud is turned by half a turn about its own vertical."""
    half = se3.yaw(180.0)
    return [
        replace(link, verdict="doubtful", rivals=(link.T_target_source @ half)[None])
        if link.source == cloud
        else replace(link, verdict="doubtful", rivals=(half @ link.T_target_source)[None])
        if link.target == cloud
        else link
        for link in links
    ]


def test_circles_that_close_in_another_way_too_confirm_nothing() -> None:
    _, links, _ = graph(6, 0, 0)
    middles = np.zeros((6, 3))

    def unsure(some: list[Link]) -> list[int]:
        tree, fit = best_tree(6, some, middles, np.random.default_rng(0))
        return elsewhere(6, tree, fit, middles, 0)

    assert unsure(links) == []
    assert unsure(turned(links, 3)) == [3]
    settled = [
        replace(link, rivals=np.zeros((0, 4, 4))) if {link.source, link.target} == {3, 4} else link
        for link in turned(links, 3)
    ]
    assert unsure(settled) == []  # one link without a rival decides


def test_a_pair_is_as_sure_as_its_link() -> None:
    _, links, _ = graph(8, 0, 0)
    link = replace(next(link for link in links if {link.source, link.target} == {0, 1}), role="tree")

    def verdict(word: str) -> str:
        pair = (replace(link, verdict=word),)
        return hr.Alignment(
            names=("a", "b"),
            poses=np.tile(np.eye(4), (2, 1, 1)),
            reference=0,
            links=pair,
            reasons=(),
            seconds=0.0,
        ).verdict

    assert [verdict(word) for word in ("ok", "given", "doubtful")] == ["ok", "doubtful", "doubtful"]


def test_what_is_said_of_a_cloud_is_not_said_of_one_whose_name_begins_alike() -> None:
    truth, links, _ = graph(3, 0, 0)
    both = [next(link for link in links if {link.source, link.target} == {0, k}) for k in (1, 2)]
    found = hr.Alignment(
        names=("map", "scan", "scan (2)"),
        poses=truth,
        reference=0,
        links=tuple(replace(link, role="tree", verdict="ok") for link in both),
        reasons=(),
        seconds=0.0,
    )
    assert found.n_links.tolist() == [2, 1, 1]
    assert against_clouds(found) == [
        [],
        ["scan hangs on one link, which nothing confirms"],
        ["scan (2) hangs on one link, which nothing confirms"],
    ]


def test_a_preset_beside_a_pipeline_is_refused() -> None:
    clouds = [np.eye(3), np.eye(3)]
    with pytest.raises(ValueError, match="preset='verify' and a pipeline: give one of them"):
        hr.register_all(clouds, preset="verify", pipeline=hr.Pipeline())


@pytest.mark.parametrize(("reference", "doubted"), [(0, [5, 6, 7]), (6, [0, 1, 2, 3, 4])])
def test_doubtful_links_between_two_groups_confirm_nothing_however_many(
    reference: int, doubted: list[int]
) -> None:
    # Two storeys of one plan lie on one another in each of the links between them.
    truth, links, _ = graph(8, 0, 0)
    links = [
        replace(link, role="tree", verdict="ok" if (link.source < 5) == (link.target < 5) else "doubtful")
        for link in links
    ]
    found = hr.Alignment(
        names=tuple("abcdefgh"),
        poses=truth,
        reference=reference,
        links=tuple(links),
        reasons=(),
        seconds=0.0,
    )
    assert found.doubted == doubted
    assert found.verdict == "doubtful"
    for row in range(8):
        told = " ".join(against_clouds(found)[row])
        assert ("only doubtful links" in told) == (row in doubted)
    one_ok = [replace(link, verdict="ok") if {link.source, link.target} == {4, 5} else link for link in links]
    assert replace(found, links=tuple(one_ok)).verdict == "ok"


def test_the_reference_may_lie_in_the_smaller_group() -> None:
    here, truth = tour(2, length=4.0)
    world = box_world.wood(np.random.default_rng(3))
    there = [
        box_world.scan(world, "rings32", box_world.sensor_pose(x, 0, 1.8, 0), np.random.default_rng(4))
        for x in (0.0, 2.0, 4.0)
    ]
    found = hr.register_all([*here, *there], preset="birdseye-gicp")
    assert found.placed.tolist() == [True, True, False, False, False], found.summary()
    assert found.verdict == "doubtful"
    assert off_of(found, [0, 1], truth) < 0.1
    assert not any("contradicts" in reason for reason in found.reasons)
