# SPDX-License-Identifier: MIT
"""Several entries for one pose, the cheapest first, until one answer is beyond doubt."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting, registry, spec
from hybridreg.candidates import input_mistakes, shut_out
from hybridreg.evidence.log_odds import OK, OK_LOG_ODDS
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.io.shipped_weights import MissingWeights
from hybridreg.matches import Correspondences, EntryTrace, Overlap, Pose
from hybridreg.resolution import comparable, size_ratio
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis, as_hypotheses, as_pose
from hybridreg.search.ranking import HOPELESS, best, counted, distinct, with_matches
from hybridreg.search.settle import best_first, second_look
from hybridreg.stage import Stage
from hybridreg.verdict import weigh
from hybridreg.verdict.confidence import DOUBTED

Array = NDArray[np.float64]
Entry = Mapping[str, Any]

_SLOTS = ("overlap", "match", "estimate")
# Confidence from which the user is believed to have made no mistake: by hand.
_SURE = 0.99
# Poses of each entry that are looked at, its own and the best of its rivals: by hand.
_LOOKED_AT = 8
# How many of these are refined at most: by hand.
_REFINED = 2
# Log-odds below which a settled pose is not refined: by hand.
_UNREFINED = -3.0
# Log-odds by which a pose may fall when it is refined: by hand.
_NOISE = 1.0
# Log-odds by which a rival is likelier than the pose that it was looked for beside: by hand.
_BETTER = 0.5
# Log-odds above which a pose is weighed: by hand.
_LIKELY = 0.0


@dataclass(frozen=True, kw_only=True)
class Candidates(Stage):
    """Try several entries in turn and return the likeliest pose.

    Every pose that an entry offers is settled and ranked by its log-odds (`hybridreg.evidence.log_odds`), the best are
    refined, and the best of these is weighed with the others as its rivals. A pose that several entries found is more
    credible; a rival that turns out likelier takes its place. Later entries are not run once the confidence is
    `enough`, or would be if the source were not deformed: no pose is right then. Where none brings it, all starts are
    examined a second time. What was not chosen is returned as `rivals`, what each entry did as `entries`.

    Parameters
    ----------
    of : tuple of mappings
        The entries: each holds an estimate stage, perhaps a match stage, and perhaps an overlap stage for that. One
        without `match` gets the matches that this stage was given. One that raises ValueError, ImportError or OSError,
        or lacks its image, is left out with a note; where every one lacks a package or its weights, that is an
        ImportError.
    refine : stage of the refine slot
        For the best poses of an entry. The pose returned needs no further refinement, unless it is hopeless: then none
        is tried, as it would converge to nothing.
    enough : float in [0, 1]
        Confidence at which the search stops (the verdict's "ok"); 1 tries every entry.
    """

    # Mappings have no hash; equal stages still have equal ones.
    of: tuple[Entry, ...] = field(default=({"estimate": "birdseye"}, {"estimate": "kiss"}), hash=False)
    refine: Any = "gicp"
    enough: float = OK

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.refine, (str, Mapping)):
            object.__setattr__(self, "refine", spec.from_table(self.refine, "refine"))
        if any(isinstance(stage, (str, Mapping)) for entry in self.of for stage in entry.values()):
            object.__setattr__(self, "of", tuple(_built(entry) for entry in self.of))
        fitting.check_stage("refine", self.refine)
        if not self.of:
            raise ValueError("of: no entry at all; give one at least, such as {'estimate': 'birdseye'}")
        for entry in self.of:
            _check(entry)
        if not 0.0 <= self.enough <= 1.0:
            raise ValueError(f"enough={self.enough} must lie between 0 and 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        found: list[Hypothesis] = []
        likelier: list[Hypothesis] = []
        traces: list[EntryTrace] = []
        beyond: list[Hypothesis | Array] = []
        pose = Pose.unknown(len(matches))
        for every in self._worth_trying(scene).stages(scene, matches, rng, traces, beyond):
            found = distinct(scene, [*(one for one in every if scene.pair.allows(one.T)), *likelier])
            if not found:
                continue
            pose = as_pose(found)
            # To weigh a pose takes as long as to find some, and one that is rather wrong is not "ok".
            if found[0].log_odds > _LIKELY:
                found, pose = self._weighed(scene, found, likelier)
            if _believed(pose)[1] >= self.enough:
                break
        confidence, undeformed = _believed(pose)
        with scene.clock.phase("verdict"):
            told = shut_out.explanations(scene, beyond, found, sure=confidence >= self.enough)
            # One that is deformed has its explanation.
            if not told and confidence < _SURE and confidence == undeformed:
                told = input_mistakes.explanations(scene, thorough=confidence >= DOUBTED)
            scene.explanations.extend(told)
        won = found[0].came_from if found else None
        return replace(pose, entries=tuple(trace._replace(won=trace.entry == won) for trace in traces))

    def _weighed(
        self, scene: Scene, found: list[Hypothesis], likelier: list[Hypothesis]
    ) -> tuple[list[Hypothesis], Pose]:
        # A rival that was looked for beside the best pose may turn out likelier; then that is the best, once refined.
        for last in (False, True):
            with scene.clock.phase("verdict"):
                weighed = weigh(scene, as_pose(found))
            better = [one for one in weighed.rivals if one.log_odds > weighed.evidence.support + _BETTER]
            if last or not better:
                break
            likelier.append(self._refined(scene, better[0]).but(came_from=found[0].came_from))
            found = [likelier[-1], *found]
        return found, replace(as_pose(found), weighed=weighed)

    def _worth_trying(self, scene: Scene) -> Candidates:
        source, target = scene.pair.source, scene.pair.target
        if comparable(source, target):
            return self
        ratio = size_ratio(source, target)
        times = max(ratio, 1.0 / ratio)
        scene.note(f"one cloud reaches {times:.0f} times as far as the other: only one search was run")
        return replace(self, of=self.of[:1])

    def stages(
        self,
        scene: Scene,
        matches: Correspondences,
        rng: np.random.Generator,
        traces: list[EntryTrace] | None = None,
        beyond: list[Hypothesis | Array] | None = None,
    ) -> Iterator[list[Hypothesis]]:
        """What is found after each entry, and after a second look at the end, the likeliest first.

        What each entry did is appended to `traces`, what it found outside the pair's bounds to `beyond`.
        """
        traces = [] if traces is None else traces
        beyond = [] if beyond is None else beyond
        found: list[Hypothesis] = []
        offered: list[list[Hypothesis]] = []
        missing: list[str] = []
        # A generator each, so that an entry's answer does not hang on those before it.
        for entry, own in zip(self.of, rng.spawn(len(self.of)), strict=True):
            name, start = _name(entry), time.perf_counter()
            here: list[Hypothesis] = []
            problem = None
            try:
                pose = _pose(entry, scene, matches, own)
            except (ImportError, MissingWeights) as error:
                pose, problem = Pose.unknown(), _left_out(entry, scene, error)
                missing.append(problem)
            except (ValueError, OSError) as error:
                pose, problem = Pose.unknown(), _left_out(entry, scene, error)
            if pose.found and np.isfinite(pose.T).all():
                beyond.extend(shut_out.beyond(scene, pose))
                here = [one.but(came_from=name) for one in best_first(scene, _starts(scene, pose))]
                offered.append(here)
                found = counted(scene, self._joined(scene, found, here), offered)
            if len(missing) == len(self.of):
                raise ImportError(f"none of its {len(missing)} entries can be run here: {missing[0]}")
            traces.append(_traced(name, start, here, problem))
            yield found
        if not found or found[0].log_odds < HOPELESS:
            return
        start = time.perf_counter()
        here = [one.but(came_from=_AGAIN) for one in second_look(scene)]
        if here:
            found = counted(scene, self._joined(scene, found, here), offered)
            traces.append(_traced(_AGAIN, start, here, None))
            yield found

    def _joined(self, scene: Scene, found: list[Hypothesis], offered: list[Hypothesis]) -> list[Hypothesis]:
        # Likeliest by the same measure: those before have their matches, but also a closeness beside one another.
        found = [one.but(closeness=0.0) for one in found]
        offered = best(with_matches(scene, one) for one in offered)
        highest = max(one.log_odds for one in [*found, *offered])
        # Refining a wrong pose costs most: nothing there lets it rest, and what is nearest is far away.
        near = [one for one in offered if one.log_odds > max(highest - OK_LOG_ODDS, _UNREFINED)][:_REFINED]
        refined = [self._refined(scene, one) for one in near]
        return distinct(scene, [*found, *refined, *offered[len(near) :]])

    def _refined(self, scene: Scene, settled: Hypothesis) -> Hypothesis:
        with scene.clock.phase("refine"):
            moved = PoseEvidence(settled.at.views, self.refine(scene, Pose(settled.T)).T)
        # Along a corridor a refinement may slide away; else it is nearer than what settled, however likely that is.
        if moved.by_surfaces <= settled.by_surfaces - _NOISE or np.array_equal(moved.T, settled.T):
            return settled
        refined = Hypothesis(at=moved, by_surfaces=moved.by_surfaces, came_from=settled.came_from)
        return with_matches(scene, refined)


# What the second look at all that was tried is called among the entries.
_AGAIN = "second look"


def _believed(pose: Pose) -> tuple[float, float]:
    # The confidence, and what it would be if the source were not deformed; nothing before the pose is weighed.
    weighed = pose.weighed
    return (weighed.confidence, weighed.undeformed) if weighed else (0.0, 0.0)


def _starts(scene: Scene, pose: Pose) -> list[Hypothesis | Array]:
    # What an entry offers, within the pair's bounds; its best beyond them, where nothing else is left.
    starts = as_hypotheses(pose)
    allowed = [one for one, T in zip(starts, [pose.T, *pose.rivals], strict=True) if scene.pair.allows(T)]
    return (allowed or starts[:1])[:_LOOKED_AT]


def _name(entry: Entry) -> str:
    return " + ".join(_called(stage) for stage in entry.values())


def _called(stage: Any) -> str:
    # The short name, with what differs from the stage's defaults.
    name = (registry.name_of(stage) or type(stage).__name__).rpartition(".")[2]
    if not is_dataclass(stage):
        return name
    changed = [
        f"{field.name}={value}"
        for field in fields(stage)
        if isinstance(value := getattr(stage, field.name), (str, int, float)) and value != field.default
    ]
    return f"{name} ({', '.join(changed)})" if changed else name


def _traced(name: str, start: float, offered: Sequence[Hypothesis], problem: str | None) -> EntryTrace:
    highest = max((one.log_odds for one in offered), default=None)
    return EntryTrace(name, time.perf_counter() - start, len(offered), highest, problem)


def _built(entry: Entry) -> Entry:
    return {
        slot: spec.from_table(stage, slot) if isinstance(stage, (str, Mapping)) else stage
        for slot, stage in entry.items()
    }


def _check(entry: Entry) -> None:
    unknown = set(entry) - set(_SLOTS)
    if unknown or "estimate" not in entry or ("overlap" in entry and "match" not in entry):
        raise ValueError(
            f"of: an entry holds {', '.join(entry) or 'nothing'}; it needs `estimate`, and may have `match` and, "
            "with that, `overlap`"
        )
    for slot, stage in entry.items():
        fitting.check_stage(f"of: {slot}", stage)
    if "match" in entry:
        fitting.check_match(entry["match"], entry["estimate"])


def _pose(entry: Entry, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
    for stage in entry.values():
        fitting.check_stage_image(stage, scene.pair)
    if "match" in entry:
        overlap = _overlap(entry, scene)
        with scene.clock.phase("match"):
            matches = scene.matched(entry["match"](scene, overlap))
    found: Pose = entry["estimate"](scene, matches, rng)
    return found


def _overlap(entry: Entry, scene: Scene) -> Overlap:
    if "overlap" not in entry:
        return Overlap.full(len(scene.source), len(scene.target))
    with scene.clock.phase("overlap"):
        found: Overlap = entry["overlap"](scene)
    return found


def _left_out(entry: Entry, scene: Scene, error: Exception) -> str:
    scene.note(f"an entry ({' + '.join(type(s).__name__ for s in entry.values())}) was left out: {error}")
    return str(error)
