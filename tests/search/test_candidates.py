# SPDX-License-Identifier: MIT
from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import hybridreg as hr
import hybridreg.data
from hybridreg.data.loaders.folder import load_pair
from hybridreg.geometry import se3
from hybridreg.testing import check_stage, sample_scene
from hybridreg.verdict import weigh

pytest.importorskip("small_gicp")
NONE = hr.Correspondences.none()
SCENE, TRUTH = sample_scene()
WRONG = se3.yaw(180.0) @ TRUTH
CALLS: list[str] = []


@dataclass(frozen=True, kw_only=True)
class Offers:
    """Returns poses that the test chose, and leaves a trace."""

    name: str = "offers"
    poses: tuple[tuple[float, ...], ...] = ()

    def __call__(self, scene: hr.Scene, matches: hr.Correspondences, rng: np.random.Generator) -> hr.Pose:
        CALLS.append(self.name)
        if not self.poses:
            return hr.Pose.unknown()
        first, *others = (np.reshape(pose, (4, 4)) for pose in self.poses)
        return hr.Pose(first, rivals=np.array(others).reshape(-1, 4, 4))


@dataclass(frozen=True, kw_only=True)
class Breaks:
    """Fails as a stage does that lacks its weights."""

    needs: ClassVar[frozenset[str]] = frozenset()

    def __call__(self, scene: hr.Scene, matches: hr.Correspondences, rng: np.random.Generator) -> hr.Pose:
        raise ValueError("no weights here; download some")


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Turned by a random angle."""

    def __call__(self, scene: hr.Scene, matches: hr.Correspondences, rng: np.random.Generator) -> hr.Pose:
        return hr.Pose(se3.yaw(float(rng.uniform(0.0, 360.0))))


@dataclass(frozen=True, kw_only=True)
class NeedsImage(Draws):
    needs: ClassVar[frozenset[str]] = frozenset({"image"})


def offers(name: str, *poses: np.ndarray) -> dict[str, Any]:
    return {"estimate": Offers(name=name, poses=tuple(tuple(map(float, T.ravel())) for T in poses))}


def run(*entries: dict[str, Any], scene: hr.Scene | None = None, **fields: Any) -> hr.Pose:
    CALLS.clear()
    scene = scene or sample_scene()[0]
    return hr.Candidates(of=entries, **fields)(scene, NONE, np.random.default_rng(0))


def wrong_by(T: np.ndarray) -> tuple[float, float]:
    error = se3.inverse(TRUTH) @ T
    return se3.angle_deg(error[:3, :3]), float(np.linalg.norm(error[:3, 3]))


def is_right(T: np.ndarray) -> bool:
    degrees, metres = wrong_by(T)
    return degrees < 0.5 and metres < 0.1


def test_what_is_beyond_doubt_ends_the_search() -> None:
    near = TRUTH @ se3.from_rt(se3.rotation_about(np.array([0.0, 0.0, 0.03])), np.array([0.2, -0.2, 0.1]))
    assert weigh(sample_scene()[0], hr.Pose(TRUTH)).confidence > 0.95
    assert is_right(run(offers("one", near), offers("two", WRONG)).T)
    assert CALLS == ["one"]


def test_doubt_goes_on_to_the_next() -> None:
    pose = run(offers("one", WRONG), offers("two", TRUTH), offers("three", TRUTH))
    assert CALLS == ["one", "two"]
    assert is_right(pose.T)
    assert len(pose.rivals) == 1
    assert wrong_by(pose.rivals[0])[0] > 90.0


def test_the_best_by_evidence_wins_whatever_the_order() -> None:
    for entries in ((WRONG, TRUTH), (TRUTH, WRONG)):
        pose = run(*(offers(str(i), T) for i, T in enumerate(entries)), enough=1.0)
        assert CALLS == ["0", "1"]
        assert is_right(pose.T)


def test_a_rival_that_an_entry_offers_can_win() -> None:
    pose = run(offers("one", WRONG, TRUTH))
    assert is_right(pose.T)
    assert len(pose.rivals) == 1


def test_poses_that_meet_are_one() -> None:
    assert run(offers("one", TRUTH, TRUTH), offers("two", TRUTH), enough=1.0).rivals.shape == (0, 4, 4)


def test_a_pose_that_several_entries_came_to_counts_as_found_by_as_many() -> None:
    one = run(offers("one", TRUTH), enough=1.0)
    two = run(offers("one", TRUTH), offers("two", WRONG, TRUTH), enough=1.0)
    assert (one.found_by, two.found_by) == (1, 2)
    assert np.allclose(one.T, two.T, atol=1e-9)  # settled beside another pose, the last bits differ
    apart = run(offers("one", TRUTH), offers("two", WRONG), enough=1.0)
    assert apart.found_by == 1
    doubt, belief = (weigh(sample_scene()[0], pose) for pose in (one, two))
    # Recipes count in the confidence alone.
    assert belief.evidence.support == pytest.approx(doubt.evidence.support, abs=1e-6)
    assert belief.confidence >= doubt.confidence
    assert belief.evidence.found_by == 2.0


@dataclass(frozen=True, kw_only=True)
class Matches:
    """Matches that are right under the true pose, and some that are right under none."""

    right: int = 0
    gives: ClassVar[frozenset[str]] = frozenset()

    def __call__(self, scene: hr.Scene, overlap: hr.Overlap) -> hr.Correspondences:
        source = scene.source.points[:40]
        far = np.where(np.arange(40) < self.right, 0.0, 30.0)[:, None]
        return hr.Correspondences.of(source, se3.apply(TRUTH, source) + far)


def test_matches_that_agree_with_a_pose_speak_for_it() -> None:
    few, many = ({"match": Matches(right=n), **offers("one", TRUTH)} for n in (4, 32))
    supports = []
    for entry, share in ((few, 0.1), (many, 0.8)):
        scene = sample_scene()[0]
        found = weigh(scene, run(entry, scene=scene))
        assert found.evidence.matched == share
        supports.append(found.evidence.support)
    assert supports[0] < supports[1]


def test_a_result_has_the_matches_that_agree_with_it_best() -> None:
    entries = ({"match": Matches(right=n), **offers("one", TRUTH)} for n in (4, 32, 8))
    pipeline = hr.Pipeline(match="none", estimate=hr.Candidates(of=tuple(entries), enough=1.0), refine="none")
    result = pipeline.run(SCENE.pair)
    gap = np.linalg.norm(
        se3.apply(result.transformation, result.matches.source) - result.matches.target, axis=1
    )
    assert np.count_nonzero(gap < 1.0) == 32
    assert result.evidence["matches_agreeing"] == 32.0


def test_what_every_entry_found_can_be_followed() -> None:
    entries = (offers("one", WRONG), offers("nothing"), offers("two", TRUTH))
    stages = list(hr.Candidates(of=entries).stages(sample_scene()[0], NONE, np.random.default_rng(0)))
    assert [len(found) for found in stages[:-1]] == [1, 1, 2]
    assert is_right(stages[-1][0].T)
    supports = [one.log_odds for one in stages[-1]]
    assert supports == sorted(supports, reverse=True)


def test_a_refinement_that_leaves_the_surfaces_is_not_kept() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Slides:
        def __call__(self, scene: hr.Scene, pose: hr.Pose) -> hr.Pose:
            return hr.Pose(se3.from_rt(np.eye(3), np.array([4.0, 0.0, 0.0])) @ pose.T)

    degrees, metres = wrong_by(run(offers("one", TRUTH), refine=Slides()).T)
    assert degrees < 2.0
    assert metres < 0.5


@pytest.mark.parametrize(
    "failing",
    [
        {"estimate": Breaks()},
        offers("nothing"),
        offers("nan", np.full((4, 4), np.nan)),
        {"estimate": NeedsImage()},
    ],
)
def test_an_entry_that_fails_does_not_stop_the_others(failing: dict[str, Any]) -> None:
    scene = sample_scene()[0]
    pair = hr.Pair(source=scene.pair.source, target=scene.pair.target)
    scene = hr.Scene(pair=pair, source=scene.source, target=scene.target)
    pose = run(failing, offers("two", TRUTH), scene=scene)
    assert is_right(pose.T)
    if isinstance(failing["estimate"], Breaks):
        assert scene.notes == ["an entry (Breaks) was left out: no weights here; download some"]
    if isinstance(failing["estimate"], NeedsImage):
        assert "needs an image" in scene.notes[0]


def test_a_programming_error_is_not_hidden() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Mistaken:
        def __call__(self, scene: hr.Scene, matches: hr.Correspondences, rng: np.random.Generator) -> hr.Pose:
            return scene.nonsense  # type: ignore[attr-defined, no-any-return]

    with pytest.raises(AttributeError, match="nonsense"):
        run({"estimate": Mistaken()})


def test_nothing_found_is_an_unknown_pose() -> None:
    pose = run(offers("one"), {"estimate": Breaks()})
    assert not pose.found
    assert np.array_equal(pose.T, np.eye(4))


def test_an_entry_without_a_matcher_gets_the_matches_that_were_given() -> None:
    rows = np.random.default_rng(0).choice(len(SCENE.pair.source), 200, replace=False)
    source = SCENE.pair.source.points[rows]
    mine = hr.Correspondences.of(source, se3.apply(TRUTH, source))
    pipe = hr.Pipeline(
        match="none", estimate=hr.Candidates(of=({"estimate": "ransac"},)), refine="none", voxel=0.4
    )
    assert is_right(pipe.run(SCENE.pair, matches=mine).transformation)
    assert pipe.run(SCENE.pair).verdict == "failed"


def test_an_entrys_random_numbers_do_not_hang_on_those_before_it() -> None:
    def second(first: dict[str, Any]) -> np.ndarray:
        poses = []

        @dataclass(frozen=True, kw_only=True)
        class Keeps(Draws):
            def __call__(self, scene: hr.Scene, matches: hr.Correspondences, rng: Any) -> hr.Pose:
                poses.append(super().__call__(scene, matches, rng))
                return poses[-1]

        run(first, {"estimate": Keeps()})
        return poses[0].T

    assert np.array_equal(second({"estimate": Draws()}), second(offers("nothing")))
    assert not np.array_equal(second(offers("nothing")), Draws()(SCENE, NONE, np.random.default_rng(0)).T)


RECIPES = (
    {"estimate": "birdseye"},
    {"estimate": {"stage": "kiss", "scale": 2.5}},
    {"overlap": "visibility", "match": {"stage": "fpfh", "radius": 1.5}, "estimate": "ransac"},
)


def test_names_and_tables_become_stages() -> None:
    stage = hr.Candidates(of=RECIPES)
    assert stage.of[0] == {"estimate": hr.BirdsEye()}
    assert stage.of[1] == {"estimate": hr.KissMatcher(scale=2.5)}
    assert stage.of[2]["match"] == hr.Fpfh(radius=1.5)
    assert stage.refine == hr.Gicp()


def test_the_pipeline_comes_back_from_its_file(tmp_path: Path) -> None:
    stage = hr.Candidates(of=RECIPES, refine=hr.Icp(kind="plane"), enough=0.9)
    pipe = hr.Pipeline(match="none", estimate=stage, refine="none")
    pipe.save(tmp_path / "mine.toml")
    assert hr.Pipeline.load(tmp_path / "mine.toml") == pipe
    assert hr.Pipeline(**pipe.to_spec()) == pipe
    assert pickle.loads(pickle.dumps(pipe)) == pipe


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"of": ()}, "no entry at all"),
        ({"of": ({"match": "fpfh"},)}, "needs `estimate`"),
        ({"of": ({"overlap": "none", "estimate": "ransac"},)}, "with that, `overlap`"),
        ({"of": ({"estimate": "kiss", "refine": "gicp"},)}, "holds estimate, refine"),
        ({"of": ({"match": "none", "estimate": "ransac"},)}, "needs 'matches' from the match stage"),
        ({"enough": 1.5}, "enough=1.5"),
    ],
)
def test_a_recipe_that_makes_no_sense_is_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        hr.Candidates(**fields)


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(KeyError, match="did you mean 'birdseye'"):
        hr.Candidates(of=({"estimate": "birdeye"},))


def test_the_stage_passes_the_public_conformance_suite() -> None:
    check_stage(hr.Candidates(of=(offers("truth", WRONG, TRUTH), {"estimate": Draws()})), "estimate")


def test_the_default_preset_registers_the_courtyard_and_is_sure_of_it() -> None:
    one, two = (hr.Pipeline.preset("default").run(SCENE.pair) for _ in range(2))
    assert is_right(one.transformation)
    assert one.verdict == "ok"
    assert np.array_equal(one.transformation, two.transformation)
    assert one.evidence == two.evidence


def test_the_default_preset_refines_the_demo_pair_to_centimetres() -> None:
    # GICP's pose has fewer near points there than the settled one, which is 1.6 degrees off.
    labelled = load_pair(Path(hybridreg.data.__file__).parent / "demo")
    error = (
        se3.inverse(labelled.T_target_source)
        @ hr.Pipeline.preset("default").run(labelled.pair).transformation
    )
    assert se3.angle_deg(error[:3, :3]) < 0.2
    assert np.linalg.norm(error[:3, 3]) < 0.05


def test_the_result_says_which_entry_won_and_where_the_time_went() -> None:
    entries = (offers("one", WRONG), {"estimate": Breaks()}, offers("two", TRUTH))
    pipeline = hr.Pipeline(match="none", estimate=hr.Candidates(of=entries, enough=1.0), refine="none")
    result = pipeline.run(SCENE.pair)
    won = [each.entry for each in result.entries if each.won]
    assert len(won) == 1
    assert "two" in won[0] or won == ["second look"]
    assert [each.problem is None for each in result.entries[:3]] == [True, False, True]
    assert result.entries[0].log_odds < result.entries[2].log_odds
    assert result.seconds["refine"] > 0.0 < result.seconds["verdict"]
    assert sum(result.seconds.values()) >= sum(each.seconds for each in result.entries)
    assert "found by" in result.summary()


@pytest.mark.parametrize("index", [29, 35])
def test_a_guess_that_is_metres_off_on_a_field_is_settled(index: int) -> None:
    """Without partners from far away it comes to rest on the way: 3 m off, or 0.8 m off and "ok"."""
    labelled = hybridreg.data.open_dataset(f"sim:val/degenerate#{index + 1}")[index]
    result = hr.register(labelled.pair.source.points, labelled.pair.target.points)
    step = result.transformation @ np.linalg.inv(labelled.T_target_source)
    assert se3.angle_deg(step[:3, :3]) < 1.0
    assert np.linalg.norm(result.transformation[:3, 3] - labelled.T_target_source[:3, 3]) < 0.5
    assert result.verdict == "ok"
