#!/usr/bin/env bash
# evo 1.38.1's `associate_trajectories` looks for the nearest stamp in the longer trajectory, for each pose of the shorter one,
# within `max_diff` (0.01 s by default), and may give the same pose to several: what comes back holds it as many times. Where
# the shorter one is the denser in time, ten of its poses are scored against one of the other's.
#
# Guess before it was run: each pose has at most one partner, as in the script of TUM's benchmark.
# For whom it matters: whoever scores a trajectory of many poses a second against one of few, with a `max_diff` that fits the
# few. The counts look right, as the result is as long as the shorter trajectory; stamps that repeat tell.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "evo==1.38.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D


def drive(stamps):
    """Along x at 10 m/s, without an error."""
    place = np.column_stack([10.0 * stamps, np.zeros((len(stamps), 2))])
    return PoseTrajectory3D(place, np.tile([1.0, 0.0, 0.0, 0.0], (len(stamps), 1)), stamps)


reference = drive(np.arange(0.0, 10.0, 0.1))  # ten seconds, ten poses a second
estimate = drive(np.arange(0.0, 0.5, 0.01))  # half a second, a hundred poses a second
print("evo", version("evo"), "numpy", np.__version__)
ours, theirs = sync.associate_trajectories(reference, estimate, max_diff=0.05)
unique = len(np.unique(ours.timestamps))
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((ours, theirs))
mean = ape.get_statistic(metrics.StatisticsType.mean)
print(f"  {len(reference.timestamps)} and {len(estimate.timestamps)} poses: {len(ours.timestamps)} pairs of {unique} poses of the reference")
print(f"  APE of a drive without an error: {mean:.2f} m on average")
assert len(ours.timestamps) == 50 and unique <= 6 and mean > 0.2, "evo no longer does this"
print("one pose has several partners")
PYTHON
