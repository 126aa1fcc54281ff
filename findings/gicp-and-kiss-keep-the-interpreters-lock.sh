#!/usr/bin/env bash
# small_gicp 1.0.1 and kiss_matcher 1.0.2 are compiled, and keep Python's interpreter lock for the whole of a call: no
# other thread of the process runs until `estimate_covariances`, `align` or `estimate` is done. scipy's KD-tree, which
# is compiled too, lets others run.
#
# Guess before it was run: other threads go on meanwhile, and two registrations in two threads take as long as one.
# For whom it matters: whoever registers in a thread beside a window, a server or ROS callbacks, or several pairs in a
# pool of threads. Processes, or `num_threads=` within a call, do what threads do not.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "small_gicp==1.0.1" "kiss_matcher==1.0.2" "scipy==1.17.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import threading
import time
from importlib.metadata import version

import kiss_matcher
import numpy as np
import small_gicp
from scipy.spatial import cKDTree


def longest_pause(work):
    """The longest time that another thread, which wakes every millisecond, stood still during a call, over the
    call's."""
    looks, done = [], threading.Event()

    def look():
        while not done.is_set():
            looks.append(time.perf_counter())
            time.sleep(0.001)

    other = threading.Thread(target=look)
    other.start()
    time.sleep(0.05)
    begin = time.perf_counter()
    work()
    end = time.perf_counter()
    done.set()
    other.join()
    at = [begin, *(look for look in looks if begin < look < end), end]
    return max(b - a for a, b in zip(at, at[1:])) / (end - begin)


rng = np.random.default_rng(0)
points = rng.uniform(-30.0, 30.0, (60_000, 3))
few = points[:6_000]
target, source = small_gicp.PointCloud(points), small_gicp.PointCloud(points + 0.2)
tree = small_gicp.KdTree(target)
small_gicp.estimate_covariances(source, small_gicp.KdTree(source), 20, 1)
matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(1.0))
ours = cKDTree(points)
calls = {
    "small_gicp estimate_covariances": lambda: small_gicp.estimate_covariances(target, tree, 20, 1),
    "small_gicp align": lambda: small_gicp.align(target, source, tree, num_threads=1),
    "kiss_matcher estimate": lambda: matcher.estimate(few, few + 0.2),
    "scipy cKDTree.query": lambda: ours.query(points, k=20),
}
print(*(f"{name} {version(name)}" for name in ("small_gicp", "kiss_matcher", "scipy")))
stood = {name: longest_pause(call) for name, call in calls.items()}
for name, share in stood.items():
    print(f"  {name}: the other thread stood still for {share:.0%} of the call at a stretch")
assert all(share > 0.7 for name, share in stood.items() if "scipy" not in name), "a call lets others run now"
assert stood["scipy cKDTree.query"] < 0.5, "scipy keeps the lock now"
print("neither of the two lets another thread run; scipy does")
PYTHON
