# SPDX-License-Identifier: MIT
"""How often is a pose called "ok" that lies just beyond the tolerance, as one that nobody refined may?

    python -m hybridreg.verdict.training.near_misses

The true pose of every pair, turned and shifted at the middle of the source: about the vertical or any axis, in any
direction, mostly a level one. A table: how far beside the true pose, how many poses, how many of them "ok".
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data import open_dataset
from hybridreg.evidence import views
from hybridreg.evidence.log_odds import OK
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.verdict.weighing import weigh

Array = NDArray[np.float64]
# Degrees and metres, for vehicles' sensors; the first is the true pose.
ASIDE = ((0.0, 0.0), (2.6, 0.0), (4.0, 0.0), (0.0, 0.6), (0.0, 0.8), (0.0, 1.1), (0.0, 1.6), (1.5, 0.7))
_LEVEL = (1.0, 1.0, 0.15)
_DATA = ("../shared/data/real", "sim:val/near#10", "sim:val/far#10", "sim:val/degenerate#12")


def aside(truth: Array, middle: Array, degrees: float, metres: float, rng: np.random.Generator) -> Array:
    """A pose beside the true one (4, 4), turned and shifted at `middle` (3,) of the source."""
    axis = rng.normal(size=3) if rng.random() < 0.5 else np.array([0.0, 0.0, 1.0])
    direction = rng.normal(size=3) * _LEVEL
    at = se3.apply(truth, middle[None])
    turn = se3.rotation_about(np.radians(degrees) * axis / np.linalg.norm(axis))
    there = at[0] + metres * direction / np.linalg.norm(direction)
    moved: Array = se3.from_rt(turn, there - turn @ at[0]) @ truth
    return moved


def judged(data: str) -> Iterator[tuple[tuple[float, float], bool]]:
    """How far each pose lies beside the true one, and whether it is "ok"."""
    for number, labelled in enumerate(open_dataset(data)):
        scene, rng = VoxelGrid()(labelled.pair), np.random.default_rng(number)
        truth, middle = lower_pose(labelled.T_target_source, labelled.pair), views.of(scene).middle[0]
        for far in ASIDE:
            yield far, weigh(scene, Pose(aside(truth, middle, *far, rng))).confidence >= OK


def table(found: Sequence[tuple[tuple[float, float], bool]]) -> str:
    """Markdown: a line for each distance."""
    lines = ['| degrees | metres | poses | "ok" |', "|---|---|---|---|"]
    for far in ASIDE:
        ok = [each for where, each in found if where == far]
        lines.append(f"| {far[0]:g} | {far[1]:g} | {len(ok)} | {sum(ok)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", nargs="+", default=_DATA)
    print(table([each for data in parser.parse_args().data for each in judged(data)]))


if __name__ == "__main__":
    main()
