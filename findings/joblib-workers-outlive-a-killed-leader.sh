#!/usr/bin/env bash
# joblib 1.6.0: where the process that called Parallel is ended by SIGTERM or SIGKILL (a batch system's time limit, the
# kernel short of memory), its workers stay. They finish the tasks that they have, and then wait for more, idle, with all
# their memory.
#
# Guess before it was run: workers whose leader is gone notice it within a second or two and end.
# For whom it matters: whoever runs many batches on one machine; hybridreg's workers look for their leader themselves.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "joblib==1.6.0"
cd "$folder"
cat > leader.py <<'PYTHON'
import os
import time

from joblib import Parallel, delayed


def work(number):
    with open("workers", "a") as file:
        file.write(f"{os.getpid()}\n")
    time.sleep(0.5)


if __name__ == "__main__":
    Parallel(n_jobs=2)(delayed(work)(number) for number in range(100))
PYTHON
cat > watch.py <<'PYTHON'
import os
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path


def lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


print("joblib", version("joblib"))
for number in (signal.SIGTERM, signal.SIGKILL):
    Path("workers").unlink(missing_ok=True)
    leader = subprocess.Popen([sys.executable, "leader.py"], stderr=subprocess.DEVNULL)
    while not Path("workers").exists() or len(Path("workers").read_text().split()) < 4:
        time.sleep(0.1)
    leader.send_signal(number)
    leader.wait()
    time.sleep(10.0)
    workers = sorted(set(map(int, Path("workers").read_text().split())))
    left = [pid for pid in workers if lives(pid)]
    print(f"  {number.name} to the leader: 10 s later {len(left)} of {len(workers)} workers live")
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert left, "joblib no longer does this"
print("workers outlive the process that started them")
PYTHON
"$folder/env/bin/python" watch.py
