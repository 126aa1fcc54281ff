# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses
import json
import pickle
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridreg as hr
from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.prior.prior import Prior
from hybridreg.scene import Scene


@dataclass(frozen=True, kw_only=True)
class TrueMatches:
    """A third party's matcher that imports nothing of ours but the types it returns."""

    n: int = 100
    gives = frozenset({"matches"})

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        return testing.true_matches(scene, testing.sample_scene()[1], n=self.n)


class Prophet:
    """A stage that notes what it was given."""

    def __init__(self) -> None:
        self.seen: list[Any] = []

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        self.seen.append((len(scene.source), len(matches), rng.integers(1 << 30)))
        return Pose(np.eye(4))


def identity(**stages: Any) -> hr.Pipeline:
    return hr.Pipeline(**{"match": "none", "estimate": "identity", "refine": "none", **stages})


def test_aligns_the_courtyard(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    result = hr.Pipeline(voxel=0.4, match=TrueMatches()).run(pair)
    error = se3.inverse(truth) @ result.transformation
    assert se3.angle_deg(error[:3, :3]) < 0.3
    assert np.linalg.norm(result.transformation[:3, 3] - truth[:3, 3]) < 0.05
    assert result.T_target_source is result.transformation
    assert set(result.seconds) == {"downsample", "overlap", "match", "estimate", "refine", "verdict"}
    assert result.spec["match"]["stage"].endswith(":TrueMatches")


def test_call_takes_what_run_takes(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, _ = courtyard
    result = identity(voxel=0.5)(pair.source.points, pair.target.points.tolist())
    assert np.array_equal(result.transformation, np.eye(4))


def test_rotation_is_made_proper(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    drifted = se3.yaw(30.0).astype(np.float32) * np.float32(1.001)

    def estimate(scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        return Pose(drifted)  # type: ignore[arg-type]

    T = identity(estimate=estimate, voxel=0.5).run(courtyard[0]).transformation
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    assert T.dtype == np.float64


@pytest.mark.parametrize("bad", [np.full((4, 4), np.nan), np.eye(3)])
def test_a_pose_that_is_none_is_a_failure_not_a_crash(
    courtyard: tuple[hr.Pair, np.ndarray], bad: np.ndarray
) -> None:
    result = identity(estimate=lambda scene, matches, rng: Pose(bad), voxel=0.5).run(courtyard[0])
    assert result.verdict == "failed"
    assert np.array_equal(result.transformation, np.eye(4))


def match_by_hand(scene: Scene, overlap: Overlap) -> Correspondences:
    """A plain function as a stage."""
    return testing.true_matches(scene, testing.sample_scene()[1], n=50)


def test_plain_functions_are_stages_in_every_slot(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    pipe = hr.Pipeline(
        downsample=lambda pair: Scene.on_cells(pair, 0.5),
        overlap=lambda scene: Overlap.full(len(scene.source), len(scene.target)),
        match=match_by_hand,
        estimate=hr.Ransac().__call__,
        refine=lambda scene, pose: pose,
    )
    result = pipe.run(pair)
    assert se3.angle_deg(result.transformation[:3, :3].T @ truth[:3, :3]) < 1.0
    assert result.spec["match"]["stage"] == f"{__name__}:match_by_hand"


@pytest.mark.parametrize(
    ("slot", "answer", "words"),
    [
        ("downsample", None, "downsample: .* returned nothing where Scene is due"),
        ("overlap", np.ones(3), r"overlap: .* returned ndarray of shape \(3,\) where Overlap is due"),
        (
            "overlap",
            Overlap(np.ones(3), np.ones(3)),
            r"overlap of shape \(3,\) for the \d+ points of the source",
        ),
        ("match", (np.eye(3), np.eye(3)), "match: .* returned tuple where Correspondences is due"),
        ("estimate", np.eye(4), r"estimate: .* returned ndarray of shape \(4, 4\) where Pose is due"),
        ("refine", None, "refine: .* returned nothing where Pose is due; hybridreg.Pose"),
    ],
)
def test_a_wrong_return_is_told_in_words(
    courtyard: tuple[hr.Pair, np.ndarray], slot: str, answer: Any, words: str
) -> None:
    def wrong(*_: Any) -> Any:
        return answer

    with pytest.raises(ValueError, match=words):
        identity(**{"voxel": None if slot == "downsample" else 0.5, slot: wrong}).run(courtyard[0])


def test_a_stage_that_hands_on_other_clouds_is_refused(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    # What is judged is the pair of the scene, and a pose for clouds that were moved is none for those that were given.
    pair = courtyard[0]

    def centred(pair: hr.Pair) -> Scene:
        source = hr.PointCloud.of(pair.source.points - pair.source.points.mean(axis=0), viewpoint="none")
        return hr.Scene.on_cells(pair.with_clouds(source, pair.target), 0.5)

    def swapped(pair: hr.Pair) -> Scene:
        return hr.Scene.on_cells(pair.with_clouds(pair.target, pair.source), 0.5)

    for stage in (centred, swapped):
        with pytest.raises(ValueError, match="downsample: .* another source than the one that it was given"):
            identity(voxel=None, downsample=stage).run(pair)

    def same(pair: hr.Pair) -> Scene:
        return hr.Scene.on_cells(pair, 0.5)

    identity(voxel=None, downsample=same).run(pair)


def test_a_probability_out_of_range_is_told(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    def wild(scene: Scene) -> Overlap:
        return Overlap(np.full(len(scene.source), 2.0), np.ones(len(scene.target)))

    with pytest.raises(ValueError, match=r"overlap: wild .* source that leaves \[0, 1\]"):
        hr.Pipeline(voxel=0.5, overlap=wild).run(courtyard[0])


def test_a_mask_that_nothing_looks_at_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing looks at the mask of Visibility"):
        identity(overlap="visibility")
    with pytest.raises(ValueError, match="choose a matcher"):
        hr.Pipeline.preset("kiss-gicp").swap(overlap="visibility")


def test_random_numbers_depend_on_seed_and_pair_alone(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, prophet = courtyard[0], Prophet()
    pipe = identity(estimate=prophet, voxel=0.5)
    other = dataclasses.replace(pair, id="another")
    for seed, p in ((0, pair), (0, other), (0, pair), (1, pair)):
        pipe.trace(p, seed=seed)
    draws = [seen[2] for seen in prophet.seen]
    assert draws[0] == draws[2]
    assert len({draws[0], draws[1], draws[3]}) == 3


def test_swap_changes_one_slot_and_only_that() -> None:
    pipe = hr.Pipeline(voxel=0.3)
    swapped = pipe.swap(refine="none")
    assert type(swapped.refine).__name__ == "NoRefinement"
    assert type(pipe.refine).__name__ == "Gicp"
    assert swapped.match is pipe.match
    assert pipe.swap(voxel=0.5).downsample.voxel == 0.5
    assert pipe.swap(downsample=hr.VoxelGrid(voxel=1.0)).downsample.voxel == 1.0
    with pytest.raises(TypeError, match="estimator"):
        pipe.swap(estimator="svd")


@pytest.mark.parametrize(
    "pipe",
    [
        hr.Pipeline(voxel=0.5, downsample=hr.VoxelGrid(density="match")),
        hr.Pipeline(downsample=hr.VoxelGrid(voxel=0.5, density="match")),
    ],
)
def test_a_voxel_can_be_changed_in_every_way(pipe: hr.Pipeline) -> None:
    wanted = hr.VoxelGrid(voxel=0.3, density="match")
    assert pipe.swap(voxel=0.3).downsample == wanted
    assert pipe.replace(voxel=0.3).downsample == wanted
    assert pipe.replace(downsample__voxel=0.3).downsample == wanted
    assert pipe.replace(voxel=0.3).replace(voxel=0.2).swap(voxel=0.3).swap(refine="none").downsample == wanted
    assert pipe.swap(voxel=None).downsample == hr.VoxelGrid(density="match")
    assert pipe.replace(refine__iterations=3).downsample.voxel == 0.5
    if pipe.voxel is not None:
        params = pipe.get_params(deep=False)
        assert hr.Pipeline(**params) == pipe
        assert hr.Pipeline(**{**params, "voxel": 0.3}).downsample == wanted
    assert hr.Pipeline(downsample="random").swap(voxel=0.3).downsample == hr.VoxelGrid(voxel=0.3)
    assert hr.Pipeline(downsample="random").swap(voxel=None).downsample == hr.RandomSample()


def test_pipelines_have_a_hash_and_are_compared_whatever_their_stages_hold() -> None:
    crop = (-10.0, -10.0, -10.0, 10.0, 10.0, 10.0)
    pipe = hr.Pipeline.preset("default", voxel=0.5).swap(prior={"crop": crop})
    again = hr.Pipeline(**pipe.to_spec())
    assert len({pipe, again}) == 1
    assert pipe != pipe.swap(voxel=0.4)
    assert pipe != "default"

    @dataclass(frozen=True)
    class Table:
        rows: np.ndarray

        def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
            return Pose(np.eye(4))

    one, same, other = (hr.Pipeline(estimate=Table(np.array(rows))) for rows in ([1, 2], [1, 2], [1, 3]))
    assert one == same
    assert one != other
    entries = [hr.Candidates(of=({"estimate": each.estimate},)) for each in (one, same, other)]
    assert hr.Pipeline(estimate=entries[0]) == hr.Pipeline(estimate=entries[1])
    assert hr.Pipeline(estimate=entries[0]) != hr.Pipeline(estimate=entries[2])


def test_what_is_frozen_names_replace() -> None:
    with pytest.raises(AttributeError, match=r"Ransac is frozen, .* replace\(iterations=5\)"):
        hr.Ransac().set_params(iterations=5)
    with pytest.raises(AttributeError, match=r"Pipeline is frozen, .* replace\(refine__iterations=5\)"):
        hr.Pipeline().set_params(refine__iterations=5)


def test_a_field_of_a_stage_that_is_named_in_the_same_breath() -> None:
    assert hr.Pipeline().replace(match="fpfh", match__radius=2.0).match == hr.Fpfh(radius=2.0)
    assert hr.Pipeline().replace(match="fcgf", match__size="nano", match__untrained=True).match.size == "nano"
    candidates = hr.Candidates().replace(refine={"stage": "icp"}, refine__iterations=2)
    assert candidates.refine == hr.Icp(iterations=2)
    inside = hr.Pipeline(estimate=candidates).replace(estimate__refine__iterations=3)
    assert inside.estimate.refine == hr.Icp(iterations=3)
    bounded = hr.Pipeline().replace(prior__max_rotation=30.0)
    assert bounded.prior == hr.Pipeline().swap(prior={"max_rotation": 30.0}).prior
    with pytest.raises(TypeError, match="estimate__tries: <function .* has no fields"):
        hr.Pipeline().replace(estimate=lambda *_: None, estimate__tries=3)


@pytest.mark.parametrize("changes, words", [
    ({"refin__iterations": 7}, "no slot is called refin; the slots are downsample"),
    ({"refin": "icp"}, "no slot is called refin; the slots are downsample"),
    ({"refine__max_distnces": [1.0]}, "Gicp has no field 'max_distnces'; did you mean 'max_distances'? (its fields"),
    ({"match__k": 7}, "Fpfh has no field 'k' (its fields are radius, "),
    ({"overlap__k": 7}, "NoOverlap has no field 'k' (it has none)"),
])  # fmt: skip
def test_a_field_that_is_misspelt_is_told_with_those_there_are(changes: dict[str, Any], words: str) -> None:
    pipe = hr.Pipeline.preset("fpfh-ransac-gicp")
    with pytest.raises(TypeError, match=re.escape(words)):
        pipe.replace(**changes)


def test_a_file_name_promises_no_other_format(tmp_path: Path) -> None:
    with pytest.raises(
        ValueError, match=r"mine\.json: a pipeline is written as TOML; end the name in \.toml"
    ):
        hr.Pipeline().save(tmp_path / "mine.json")
    assert list(tmp_path.iterdir()) == []


def test_seconds_are_told_in_the_order_of_the_slots() -> None:
    from hybridreg.slots import in_order

    ran = ["verdict", "total", "match", "downsample", "refine", "overlap", "estimate"]
    assert sorted(ran, key=in_order) == [
        "downsample",
        "overlap",
        "match",
        "estimate",
        "refine",
        "verdict",
        "total",
    ]


def test_mistyped_keyword_is_refused_at_once() -> None:
    with pytest.raises(TypeError, match="voxle"):
        hr.VoxelGrid(voxle=0.3)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="radious.*its fields are"):
        hr.Pipeline(match={"stage": "fpfh", "radious": 1.0})


def test_misfit_is_refused_when_built_and_names_what_would_fit() -> None:
    with pytest.raises(ValueError, match=r"Ransac.*needs 'matches'.*NoMatch.*fpfh.*kiss"):
        hr.Pipeline(match="none", estimate="ransac")
    with pytest.raises(ValueError, match="not a stage"):
        hr.Pipeline(refine=3)


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(KeyError, match="did you mean 'ransac'"):
        hr.Pipeline(estimate="ransak")
    with pytest.raises(KeyError, match=r"kiss-gicp"):
        hr.Pipeline.preset("no-such")


def test_voxel_shorthand() -> None:
    assert hr.Pipeline(voxel=0.3).downsample == hr.VoxelGrid(voxel=0.3)
    with pytest.raises(ValueError, match="contradicts"):
        hr.Pipeline(voxel=0.3, downsample=hr.VoxelGrid(voxel=0.4))
    with pytest.raises(ValueError, match="no voxel"):
        hr.Pipeline(voxel=0.3, downsample="random")
    with pytest.raises(ValueError, match="own voxel=0.5; .*change a pipeline by its own method replace"):
        dataclasses.replace(hr.Pipeline(voxel=0.5), voxel=0.3)
    with pytest.raises(ValueError, match="positive"):
        hr.Pipeline(voxel=-1.0)


def test_own_matches_replace_the_match_stage(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, truth = courtyard
    source = pair.source.points[::50]
    own = hr.Correspondences.of(source, se3.apply(truth, source))
    pipe = hr.Pipeline(match="given", estimate="svd", refine="none", voxel=0.4)
    result = pipe.run(pair, matches=own)
    assert np.allclose(result.transformation, truth, atol=1e-9)
    with pytest.raises(ValueError, match="own matches"):
        pipe.run(pair)


def test_own_matches_as_rows(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, _ = courtyard
    pipe = identity(voxel=0.5)
    rows = np.array([[0, 5], [7, 3]])
    trace = pipe.trace(pair, matches=rows)
    assert np.array_equal(trace.matches.source, pair.source.points[[0, 7]])
    assert np.array_equal(trace.matches.target, pair.target.points[[5, 3]])
    with pytest.raises(ValueError, match="the target has"):
        pipe.trace(pair, matches=np.array([[0, len(pair.target)]]))
    with pytest.raises(ValueError, match="integer rows"):
        pipe.trace(pair, matches=rows.astype(float))


def test_large_coordinates_give_the_same_pose(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, _ = courtyard
    pipe = hr.Pipeline(voxel=0.4, match="none", estimate="identity", refine="icp")
    plain = pipe.run(pair).transformation
    shift = np.eye(4)
    shift[:3, 3] = 5e6
    moved = pipe(pair.source.points + 5e6, pair.target.points + 5e6).transformation
    back = se3.inverse(shift) @ moved @ shift
    # Points of the cloud, not the matrix: at 5e6 m the ninth digit of a rotation is a centimetre.
    assert np.abs(se3.apply(back, pair.source.points) - se3.apply(plain, pair.source.points)).max() < 1e-3


def test_only_one_cloud_on_a_map_grid(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair, _ = courtyard
    pipe = identity(voxel=0.5)
    result = pipe(pair.source.points, pair.target.points + [4e5, 5e6, 0.0])
    assert np.allclose(result.transformation[:3, 3], [4e5, 5e6, 0.0])


def test_where_no_pose_is_found_the_clouds_stay_as_they_came_wherever_they_lie(
    courtyard: tuple[hr.Pair, np.ndarray],
) -> None:
    pair, truth = courtyard
    pipe = identity(estimate=lambda scene, matches, rng: Pose.unknown(), voxel=0.5)
    far = pair.target.points + [4e5, 5e6, 0.0]
    lost = pipe(pair.source.points, far)
    assert lost.verdict == "failed"
    assert not lost.found
    assert np.array_equal(lost.transformation, np.eye(4))
    start = se3.from_rt(truth[:3, :3], truth[:3, 3] + [4e5, 5e6, 0.0])
    begun = pipe.replace(prior=Prior(init=start))(pair.source.points, far)
    assert np.allclose(begun.transformation, start, atol=1e-6)


def test_image_is_asked_for_where_a_stage_needs_it(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    @dataclass(frozen=True)
    class Sees:
        needs = frozenset({"image"})

        def __call__(self, scene: Scene) -> Overlap:
            return Overlap.full(len(scene.source), len(scene.target))

    blind = dataclasses.replace(courtyard[0], image=None)
    with pytest.raises(ValueError, match="Sees needs an image"):
        identity(overlap=Sees(), voxel=0.5).run(blind)


def test_too_coarse_a_voxel_is_refused_with_the_cure(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    with pytest.raises(ValueError, match=r"source: \d+ of \d+ points.*smaller voxel"):
        identity(voxel=30.0).run(courtyard[0])


@pytest.mark.parametrize("scale, unit", [(1000.0, "millimetres"), (1e-3, "kilometres")])
def test_a_wrong_unit_is_a_warning_with_numbers(
    courtyard: tuple[hr.Pair, np.ndarray], scale: float, unit: str
) -> None:
    pair = courtyard[0]
    with pytest.warns(UserWarning, match=rf"source: half of the points .*{unit}"):
        identity()(pair.source.points * scale, pair.target.points * scale)


def test_a_degenerate_voxel_count_is_a_warning_with_numbers(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair = courtyard[0]
    with pytest.warns(UserWarning, match=r"voxels of 0.001 m along"):
        identity(voxel=1e-3)(pair.source.points * 100, pair.target.points * 100)


def test_a_stray_return_far_away_is_named_and_not_the_unit(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair = courtyard[0]
    source = pair.source.points.copy()
    source[7] = [1e5, 0.0, 0.0]
    with pytest.warns(
        UserWarning, match=rf"source: .* along x; 1 of {len(source)} points lie up to 1e\+05 m from the"
    ) as seen:
        identity(voxel=0.5)(source, pair.target.points)
    assert not any("in metres" in str(each.message) for each in seen)


def test_save_and_load(tmp_path: Path) -> None:
    pipe = hr.Pipeline(voxel=0.3, refine=hr.Gicp(max_distances=(2.0, 1.0), iterations=7))
    pipe.save(tmp_path / "mine.toml")
    assert hr.Pipeline.load(tmp_path / "mine.toml") == pipe
    assert [p.name for p in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize("make", [
    lambda: hr.Pipeline.preset("fpfh-ransac-gicp", voxel=0.3),
    lambda: hr.Pipeline.preset("fpfh-ransac-gicp").swap(voxel=0.3),
    lambda: hr.Pipeline(voxel=np.float32(0.5)),
    lambda: hr.Pipeline(voxel=1),
    lambda: hr.Pipeline.preset("default", voxel=0.4),
    lambda: hr.Pipeline.preset("default"),
    lambda: hr.Pipeline(voxel=0.3, prior={"init": np.eye(4), "gravity": (0, 1, 0), "crop": 30.0}),
    lambda: hr.Pipeline(match="none", estimate=hr.Candidates(of=[{"estimate": "birdseye"}]), refine="none"),
])  # fmt: skip
def test_a_saved_pipeline_is_the_one_that_was_saved(make: Any, tmp_path: Path) -> None:
    pipe = make()
    pipe.save(tmp_path / "mine.toml")
    again = hr.Pipeline.load(tmp_path / "mine.toml")
    assert again == pipe
    assert pipe == again
    assert again.to_spec() == pipe.to_spec()
    assert pipe != pipe.swap(voxel=0.77)
    assert again.swap(refine="none") == pipe.swap(refine="none")


def test_equal_pipelines_have_one_hash() -> None:
    assert hash(hr.Pipeline(voxel=0.3)) == hash(hr.Pipeline(downsample=hr.VoxelGrid(voxel=0.3)))


@pytest.mark.parametrize(
    "text, words",
    [
        ("match = ", "not a TOML file"),
        ("matcher = 'fpfh'", "matcher is not a slot"),
        ("match = 3", "match: 3 is not a stage"),
        ("[match]\nradius = 1.0", "expected a stage's name"),
        ("[match]\nstage = 'fpfh'\nradious = 1.0", "radious"),
    ],
)
def test_a_wrong_pipeline_file_is_refused_in_words(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(ValueError, match=words):
        hr.Pipeline.load(tmp_path / "p.toml")


@pytest.mark.parametrize("name", ["os:system", "subprocess.Popen", "match.os:system"])
def test_a_pipeline_file_cannot_name_a_class(tmp_path: Path, name: str) -> None:
    (tmp_path / "p.toml").write_text(f"[match]\nstage = {name!r}\n")
    with pytest.raises(KeyError):
        hr.Pipeline.load(tmp_path / "p.toml")


def test_an_unregistered_stage_is_not_written_to_a_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="entry-point"):
        hr.Pipeline(match=TrueMatches()).save(tmp_path / "p.toml")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "name",
    [
        "icp",
        "fpfh-ransac",
        "fpfh-ransac-gicp",
        "fpfh-fgr-gicp",
        "kiss-gicp",
        "birdseye-gicp",
        "verify",
        "default",
    ],
)
def test_presets_build_pickle_and_clone(name: str) -> None:
    pipe = hr.Pipeline.preset(name, voxel=0.5)
    assert pickle.loads(pickle.dumps(pipe)) == pipe
    assert pipe.downsample.voxel == 0.5
    sklearn = pytest.importorskip("sklearn.base")
    assert sklearn.clone(pipe) == pipe
    assert pipe.get_params()["downsample__voxel"] == 0.5
    assert hr.Pipeline(**pipe.to_spec()).to_spec() == pipe.to_spec()
    if isinstance(pipe.refine, hr.Gicp):
        assert pipe.replace(refine__iterations=3).refine.iterations == 3


def test_dropped_points_stand_in_the_result(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    source = courtyard[0].source.points.copy()
    source[5:8, 1] = np.nan
    result = hr.register(source, courtyard[0].target.points, preset="icp", voxel=0.5, nonfinite="drop")
    assert "3 points of the source were missing (not finite, or at 0, 0, 0) and were dropped" in result.notes
    with pytest.raises(ValueError, match="source: 3 of"):
        hr.register(source, courtyard[0].target.points, preset="icp", voxel=0.5)


def test_register_takes_any_mix(courtyard: tuple[hr.Pair, np.ndarray], tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    pair = courtyard[0]
    np.save(tmp_path / "source.npy", pair.source.points)
    expected = hr.register(pair.source.points, pair.target.points, preset="icp", voxel=0.5).transformation
    for source in (
        tmp_path / "source.npy",
        str(tmp_path / "source.npy"),
        pair.source,
        pair.source.points.tolist(),
    ):
        result = hr.register(source, torch.tensor(pair.target.points), preset="icp", voxel=0.5)
        assert np.array_equal(result.transformation, expected)


def test_result_is_written_whole(courtyard: tuple[hr.Pair, np.ndarray], tmp_path: Path) -> None:
    result = hr.register(courtyard[0].source, courtyard[0].target, preset="icp", voxel=0.5)
    result.save(tmp_path / "result.json")
    result.save(tmp_path / "T.txt")
    assert np.array_equal(np.loadtxt(tmp_path / "T.txt"), result.transformation)
    stored = json.loads((tmp_path / "result.json").read_text())
    assert stored["transformation"] == result.transformation.tolist()
    assert stored["n_correspondences"] == len(result.correspondence_set)
    assert stored["spec"]["refine"]["stage"] == "icp"
    with pytest.raises(ValueError, match=r"\.json \(everything\) or \.txt"):
        result.save(tmp_path / "result.pkl")


def _refining(change: Any) -> Any:
    return lambda scene, pose: change(pose)


def _not_finite(pose: Pose) -> Pose:
    return Pose(np.full((4, 4), np.nan))


def test_a_pose_that_is_not_finite_is_told_by_its_stage() -> None:
    result = hr.Pipeline(match="none", estimate="identity", refine=_refining(_not_finite)).run(
        testing.sample_pair()[0]
    )
    assert (result.verdict, result.found) == ("failed", False)
    assert result.reasons[0].endswith("returned a pose that is not finite")


@pytest.mark.parametrize("factors", [[2.0, 2.0, 2.0, 1.0], [1.0, 1.0, -1.0, 1.0]])
def test_a_pose_that_is_no_rigid_motion_is_noted(factors: list[float]) -> None:
    bent = _refining(lambda pose: dataclasses.replace(pose, T=pose.T @ np.diag(factors)))
    result = hr.Pipeline(match="none", estimate="identity", refine=bent).run(testing.sample_pair()[0])
    assert any("no rotation; the nearest one was taken" in note for note in result.notes)


@pytest.mark.parametrize(
    ("row", "weight", "told"),
    [
        (np.nan, 1.0, r"returned matches whose target is not finite in 1 of 3 rows \(the first is row 1\)"),
        (0.0, -2.0, r"returned matches with a weight of -2"),
        (0.0, np.inf, r"whose weight is not finite in 1 of 3 rows"),
    ],
)
def test_matches_that_are_not_finite_or_weigh_less_than_nothing_are_refused(
    row: float, weight: float, told: str
) -> None:
    def match(scene: Scene, overlap: Overlap) -> Correspondences:
        points = np.zeros((3, 3))
        return Correspondences.of(points, points + [[0.0], [row], [0.0]], [1.0, weight, 1.0])

    with pytest.raises(ValueError, match=told):
        hr.Pipeline(match=match, estimate="svd", refine="none").run(testing.sample_pair()[0])


class Silent:
    """A matcher that does not say what it gives."""

    def __call__(self, scene: Any, overlap: Any) -> hr.Correspondences:
        return hr.Correspondences.none()


def test_a_matcher_that_does_not_tell_is_trusted() -> None:
    hr.Pipeline(match=Silent(), estimate="ransac")


@dataclass(frozen=True, kw_only=True)
class Holds:
    """A refinement that holds what no file can."""

    network: Any

    def __call__(self, scene: Any, pose: Pose) -> Pose:
        return pose


@pytest.mark.parametrize("held", [object(), {1, 2}, Path("weights"), len])
def test_a_stage_may_hold_what_no_file_can(tmp_path: Path, held: Any) -> None:
    pipe = hr.Pipeline(match="none", estimate="identity", refine=Holds(network=held))
    assert type(held).__name__ in pipe.run(testing.sample_pair()[0]).spec["refine"]["network"]
    with pytest.raises(ValueError, match=r"Holds: network is a .*, which no file holds"):
        pipe.save(tmp_path / "p.toml")


@pytest.mark.parametrize("side", ["source", "target"])
def test_too_many_cells_name_the_cloud(side: str) -> None:
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (1000, 3))
    far = np.vstack([points, [3e6, 2e6, 1e6]])
    clouds = {"source": points, "target": points, side: far}
    with pytest.raises(
        ValueError, match=rf"^{side}: a voxel of .* cells; 1 of 1001 points lie up to 3.74e\+06 m"
    ):
        hr.register(**clouds, preset="icp")
