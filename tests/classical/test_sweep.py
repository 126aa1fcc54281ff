# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np

from hybridreg.classical.overhead.overhead_columns import Columns, FromAbove
from hybridreg.classical.overhead.sweep import Planar, sweep

# Along a corridor: walls on both sides without an end in sight, and a few short things at odd places.
THINGS = np.array([-21.0 + 2.6j, -12.5 - 2.4j, -3.0 + 1.0j, 6.5 - 2.6j, 9.0 + 2.5j, 20.0 + 0.5j])
SLID = 7.0


def corridor(eye: float, reach: float) -> FromAbove:
    """What a sensor at (eye, 0) sees of it, in the sensor's frame."""
    x = np.arange(eye - reach, eye + reach, 0.5)
    places = np.concatenate([x + 3.0j, x - 3.0j, THINGS[np.abs(THINGS.real - eye) < reach]]) - eye
    nothing = Columns(np.zeros(0, dtype=np.complex128), np.zeros(0, dtype=np.int64))
    return FromAbove(Columns(places, np.zeros(len(places), dtype=np.int64)), nothing, 1)


def best(whiten: float) -> Planar:
    source, target = corridor(SLID, 18.0), corridor(0.0, 30.0)
    return sweep(source, target, cell=0.5, yaws=np.zeros(1), farthest=60.0, most=20, share=0.0, whiten=whiten)


def test_levelled_spectra_tell_one_place_of_a_corridor_from_another() -> None:
    found = best(whiten=0.75)
    assert found.yaw[0] == 0.0
    assert abs(found.shift[0] - SLID) < 0.8


def test_the_true_place_scores_higher_above_the_next_one_than_without() -> None:
    def lead(found: Planar) -> float:
        here = (np.abs(found.shift - SLID) < 0.8) & (found.yaw == 0.0)
        return float(found.score[here].max() / found.score[~here].max())

    assert lead(best(0.75)) > lead(best(0.0))


def test_peaks_come_best_first_and_no_more_than_asked() -> None:
    found = best(whiten=0.0)
    assert len(found.score) <= 20
    assert (np.diff(found.score) <= 0.0).all()
