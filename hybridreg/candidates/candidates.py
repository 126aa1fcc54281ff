# SPDX-License-Identifier: MIT
"""Several recipes for one pose, the cheapest first, until one answer is beyond doubt."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting, spec
from hybridreg.candidates import input_mistakes
from hybridreg.evidence import match_agreement, support
from hybridreg.evidence.support import NEARLY, OK
from hybridreg.io.shipped_weights import MissingWeights
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.resolution import comparable, size_ratio
from hybridreg.scene import Scene
from hybridreg.search import rivals
from hybridreg.search.basin_hopping import hop
from hybridreg.search.pattern_search import climb
from hybridreg.search.rivals import Rival
from hybridreg.stage import Stage
from hybridreg.verdict import weigh

Array = NDArray[np.float64]
Entry = Mapping[str, Any]

_SLOTS = ("overlap", "match", "estimate")
# Confidence from which the user is believed to have made no mistake.
_SURE = 0.99
# Poses looked at of each entry: its own and the best of its rivals; how many of these are refined at most.
_LOOKED_AT, _REFINED = 8, 2
# The best poses of all, which are looked around when no entry brought certainty, unless their log-odds lie below this
# (half a metre beside the right pose they may well be there) or so much below those of the best.
_LOOKED_AROUND, _LOST, _BEHIND = 4, -7.0, 6.0
# Log-odds below which a settled pose is not refined, and by which its support may fall when it is refined.
_HOPELESS, _NOISE = -3.0, 1.0
# Log-odds above which a pose is weighed, and moved to where more speaks for it, unless surfaces hold it by themselves:
# the least information per point along any direction that they need for that.
_LIKELY, _WEAK = 0.0, 0.01


@dataclass(frozen=True, kw_only=True)
class Candidates(Stage):
    """Try recipes in turn and return the pose that both clouds support best.

    Every pose that an entry offers is settled and ranked by the verdict's own support (`hybridreg.evidence.support`),
    the best ones are refined, and the best of these is weighed with the others as its rivals. A pose to which
    several entries came is believed the more; one that surfaces hardly hold is moved to where it has more support.
    Later entries are not run once the confidence is `enough`; when none brings it, all that was tried is looked at a
    second time, and better supported poses are looked for around the best ones. What was not chosen comes back as
    `rivals`.

    Parameters
    ----------
    of : tuple of mappings
        Recipes: each holds an estimate stage, perhaps a match stage, and perhaps an overlap stage for that. An entry
        without `match` gets the matches that this stage was given. One that raises ValueError, ImportError or OSError,
        or lacks its image, is left out with a note; where every one lacks a package or its weights, that is an
        ImportError.
    refine : stage of the refine slot
        For the best poses of an entry. The pose returned needs no other refinement, unless nothing speaks for it: no
        refinement is tried then, as nothing would let it rest.
    enough : float in [0, 1]
        Confidence at which the search stops (the verdict's "ok"); 1 tries every entry.
    """

    of: tuple[Entry, ...] = ({"estimate": "birdseye"}, {"estimate": "kiss"})
    refine: Any = "gicp"
    enough: float = OK

    def __post_init__(self) -> None:
        if isinstance(self.refine, (str, Mapping)):
            object.__setattr__(self, "refine", spec.from_table(self.refine, "refine"))
        if any(isinstance(stage, (str, Mapping)) for entry in self.of for stage in entry.values()):
            object.__setattr__(self, "of", tuple(_built(entry) for entry in self.of))
        if not self.of:
            raise ValueError("of: no recipe at all; give one at least, such as {'estimate': 'birdseye'}")
        for entry in self.of:
            _check(entry)
        if not 0.0 <= self.enough <= 1.0:
            raise ValueError(f"enough={self.enough} must lie between 0 and 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        found: list[Rival] = []
        confidence = 0.0
        for every in self._worth_trying(scene).stages(scene, matches, rng):
            found = [one for one in every if scene.pair.allows(one.T)]
            # To weigh a pose takes as long as to find some, and one that is rather wrong is not "ok".
            likely = bool(found) and found[0].support > _LIKELY
            confidence = weigh(scene, rivals.as_pose(found)).confidence if likely else 0.0
            if confidence >= self.enough:
                break
        if confidence < _SURE:
            scene.explanations.extend(input_mistakes.explanations(scene))
        return rivals.as_pose(found) if found else Pose.unknown(len(matches))

    def _worth_trying(self, scene: Scene) -> Candidates:
        source, target = scene.pair.source, scene.pair.target
        if comparable(source, target):
            return self
        ratio = size_ratio(source, target)
        times = max(ratio, 1.0 / ratio)
        scene.note(f"one cloud reaches {times:.0f} times as far as the other: only one search was run")
        return replace(self, of=self.of[:1])

    def stages(
        self, scene: Scene, matches: Correspondences, rng: np.random.Generator
    ) -> Iterator[list[Rival]]:
        """What is found after each entry, and after a second look at the end, the best supported first."""
        found: list[Rival] = []
        answers: list[list[Rival]] = []
        missing: list[str] = []
        # A generator each, so that an entry's answer does not hang on those before it.
        *generators, last = rng.spawn(len(self.of) + 1)
        for entry, own in zip(self.of, generators, strict=True):
            try:
                pose = _pose(entry, scene, matches, own)
            except (ImportError, MissingWeights) as error:
                missing.append(_left_out(entry, scene, error))
                pose = Pose.unknown()
            if pose.found and np.isfinite(pose.T).all():
                poses = [T for T in (pose.T, *pose.rivals) if scene.pair.allows(T)] or [pose.T]
                offered = rivals.best_first(scene, poses[:_LOOKED_AT])
                answers.append(offered)
                found = _polished(scene, rivals.counted(scene, self._joined(scene, found, offered), answers))
            if len(missing) == len(self.of):
                raise ImportError(f"none of its {len(missing)} recipes can be run here: {missing[0]}")
            yield found
        if not found or found[0].support < rivals.HOPELESS:
            return
        found = rivals.counted(scene, rivals.distinct(scene, [*found, *rivals.second_look(scene)]), answers)
        least = max(_LOST, found[0].support - _BEHIND)
        hopeful = [one for one in found[:_LOOKED_AROUND] if one.support > least]
        if hopeful:
            near = rivals.distinct(scene, hop(scene, np.array([one.T for one in hopeful]), last))
            yield _polished(scene, rivals.counted(scene, self._joined(scene, found, near), answers))

    def _joined(self, scene: Scene, found: list[Rival], offered: list[Rival]) -> list[Rival]:
        best = max(one.support for one in [*found, *offered])
        # Refining a wrong pose costs most: nothing there lets it rest, and what is nearest is far away.
        near = [one for one in offered if one.support > max(best - NEARLY, _HOPELESS)][:_REFINED]
        refined = [self._refined(scene, one) for one in near]
        return rivals.distinct(scene, [*found, *refined, *offered[len(near) :]])

    def _refined(self, scene: Scene, settled: Rival) -> Rival:
        T = self.refine(scene, Pose(settled.T)).T
        value = support.support(support.numbers(*support.seen(scene, T)))
        # Along a corridor a refinement may slide away; else it is nearer than what settled, whatever its support.
        return Rival(T, value) if value > settled.by_surfaces - _NOISE else settled


def _polished(scene: Scene, found: list[Rival]) -> list[Rival]:
    # Along a direction that surfaces hardly hold, a refinement follows their noise; what else speaks holds it better.
    first, *others = found
    if first.support <= _LIKELY or support.seen(scene, first.T)[1].weakest >= _WEAK:
        return found
    climbed = scene.shared(("polished", first.T.tobytes()), lambda: climb(scene, first.T))
    if climbed.by_surfaces < first.by_surfaces + _NOISE:
        return found
    scene.shared(("polished", climbed.T.tobytes()), lambda: climbed)
    agree = match_agreement.share(scene, climbed.T)
    return [first._replace(T=climbed.T, by_surfaces=climbed.by_surfaces, matched=agree), *others]


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
    if "match" in entry:
        fitting.check_match(entry["match"], entry["estimate"])


def _pose(entry: Entry, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
    try:
        for stage in entry.values():
            fitting.check_stage_image(stage, scene.pair)
        if "match" in entry:
            matches = scene.matched(entry["match"](scene, _overlap(entry, scene)))
        return entry["estimate"](scene, matches, rng)
    except MissingWeights:
        raise
    except (ValueError, OSError) as error:
        _left_out(entry, scene, error)
        return Pose.unknown()


def _overlap(entry: Entry, scene: Scene) -> Overlap:
    if "overlap" not in entry:
        return Overlap.full(len(scene.source), len(scene.target))
    found: Overlap = entry["overlap"](scene)
    return found


def _left_out(entry: Entry, scene: Scene, error: Exception) -> str:
    scene.note(f"a candidate ({' + '.join(type(s).__name__ for s in entry.values())}) was left out: {error}")
    return str(error)
