#!/usr/bin/env bash
# laspy 2.7.0's `convert` from an old point format to one of LAS 1.4, or back, sets every scan angle to zero. The angle is
# called `scan_angle_rank` and counts degrees in one, `scan_angle` and steps of 0.006 degrees in the other, and what has no
# field of its name is left out without a warning. Withheld flags, which also lie elsewhere in a record, come through.
#
# Guess before it was run: the angles, in the other unit.
# For whom it matters: whoever brings airborne strips to one format before they are registered: filters by the scan angle
# then keep everything, and the edges of the strips, where they are worst, count like the middle. Set
# `converted.scan_angle = numpy.round(original.scan_angle_rank / 0.006)`; `laspy.lost_dimensions(3, 6)` tells what is lost.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy==2.7.0" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import laspy
import numpy as np

old = laspy.create(point_format=3, file_version="1.2")
old.x = old.y = old.z = np.arange(5.0)
old.scan_angle_rank = np.array([-20, -10, 0, 10, 20], np.int8)
old.withheld = np.array([0, 1, 0, 1, 0], np.uint8)
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    new = laspy.convert(old, point_format_id=6)
    new.scan_angle = np.round(np.asarray(old.scan_angle_rank) / 0.006).astype(np.int16)
    set_by_hand = np.asarray(new.scan_angle) * 0.006
    back = laspy.convert(new, point_format_id=3)
    again = laspy.convert(old, point_format_id=6)
print("laspy", version("laspy"), "numpy", np.__version__)
print("  before:", np.asarray(old.scan_angle_rank), "degrees, withheld", np.asarray(old.withheld))
print("  format 3 to 6:", np.asarray(again.scan_angle) * 0.006, "degrees, withheld", np.asarray(again.withheld))
print("  set by hand:", set_by_hand, "; format 6 to 3:", np.asarray(back.scan_angle_rank))
print("  warnings:", [str(each.message) for each in told], "; lost by its own words:", laspy.lost_dimensions(3, 6))
assert np.array_equal(again.withheld, old.withheld) and np.allclose(set_by_hand, old.scan_angle_rank, atol=0.01)
assert not np.any(again.scan_angle) and not np.any(back.scan_angle_rank) and not told, "laspy no longer does this"
print("every pulse goes straight down")
PYTHON
