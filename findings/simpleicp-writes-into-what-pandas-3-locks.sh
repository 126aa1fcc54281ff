#!/usr/bin/env bash
# simpleicp 2.0.15 asks for any pandas, and marks selected points by writing into `DataFrame.values`. Since pandas 3 that
# array is read-only: with what pip installs today the documented first example raises "assignment destination is
# read-only" from inside `run`, before the first iteration. With pandas below 3 the same lines give the pose.
#
# Guess before it was run: a pure Python package without upper bounds runs with the pandas of the day.
# For whom it matters: whoever compares with simpleicp, or builds on it; `pip install simpleicp "pandas<3"` helps.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
cat >"$folder/try.py" <<'PYTHON'
import contextlib
import io
from importlib.metadata import version

import numpy as np
from simpleicp import PointCloud, SimpleICP

rng = np.random.default_rng(0)
flat = rng.uniform(-5.0, 5.0, (3000, 2))
fixed = np.c_[flat, np.sin(flat[:, 0]) + np.cos(flat[:, 1])]
icp = SimpleICP()
icp.add_point_clouds(*(PointCloud(p, columns=["x", "y", "z"]) for p in (fixed, fixed + [0.1, 0.05, 0.02])))
print("simpleicp", version("simpleicp"), "with pandas", version("pandas"), end=": ")
try:
    with contextlib.redirect_stdout(io.StringIO()):
        T = icp.run(max_overlap_distance=1.0)[0]
    print("shift", np.round(T[:3, 3], 2))
except ValueError as error:
    print("ValueError:", error)
PYTHON
said=""
for pandas in 2.3.3 3.0.3; do
    "$folder/env/bin/python" -m pip install --quiet "simpleicp==2.0.15" "pandas==$pandas" "numpy<2.5" "scipy<1.18"
    said+=$("$folder/env/bin/python" "$folder/try.py")$'\n'
done
printf '%s' "$said"
grep -q "pandas 2.3.3: shift \[-0.1 *-0.05 -0.02\]" <<<"$said" || { echo "pandas 2.3.3 no longer works"; exit 1; }
grep -q "pandas 3.0.3: ValueError: assignment destination is read-only" <<<"$said" || { echo "pandas 3 works now"; exit 1; }
