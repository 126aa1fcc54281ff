# SPDX-License-Identifier: MIT
"""The command in a process of its own: stopped, beside another, on odd terminals, on a full disk, short of memory."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hybridreg.eval import read
from tools.hostile import killed_batch

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 90.0
PAIRS = 8
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals, /proc and /dev/full of Linux")

SLOW = """
title = "Slow"
protocols = ["cross3dreg"]
[[row]]
name = "icp"
match = "none"
estimate = "identity"
refine = "icp"
"""


@pytest.fixture
def batch(tmp_path: Path) -> Path:
    killed_batch.write_data(tmp_path / "data", PAIRS)
    (tmp_path / "table.toml").write_text(SLOW)
    return tmp_path


def start(root: Path, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    """The command, begun."""
    given = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", **environment}
    return subprocess.Popen(
        [sys.executable, "-m", "hybridreg", *arguments],
        cwd=root,
        env=given,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,
    )


TABLE = ("table", "table.toml", "--data", "data", "--out", "run")


def wait_for_rows(process: subprocess.Popen[str], file: Path, rows: int) -> None:
    deadline = time.monotonic() + LONGEST
    while not file.exists() or file.read_bytes().count(b"\n") <= rows:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


def children(pid: int) -> list[int]:
    """Processes below a process."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if parent == pid:
            found += [int(stat.parent.name), *children(int(stat.parent.name))]
    return found


def lives(pid: int) -> bool:
    """Is it there, and no zombie that only waits to be counted?"""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.mark.parametrize(
    ("number", "workers", "code"),
    [
        (signal.SIGINT, 1, 130),
        (signal.SIGTERM, 2, 143),
        (signal.SIGKILL, 2, -9),
    ],
)
def test_a_stopped_table_keeps_its_rows_says_how_to_go_on_and_leaves_no_worker(
    batch: Path, number: signal.Signals, workers: int, code: int
) -> None:
    process = start(batch, *TABLE, "--workers", str(workers))
    file = batch / "run" / "predictions" / "icp.jsonl"
    wait_for_rows(process, file, 2)
    below = children(process.pid)
    assert (len(below) >= 2) == (workers == 2)
    kept = len(read(file).rows)
    process.send_signal(number)
    _, told = process.communicate(timeout=LONGEST)
    assert process.returncode == code
    if code > 0:
        assert told == (
            f"hybridreg: stopped by {number.name}; finished rows are kept in run: "
            "the same command continues from there\n"
        )
    deadline = time.monotonic() + 10.0
    while any(lives(pid) for pid in below):
        assert time.monotonic() < deadline, "workers outlive their leader"
        time.sleep(0.02)
    assert kept <= len(read(file).rows) < PAIRS
    if number is signal.SIGKILL:  # its lock does not keep the next one out
        again = start(batch, *TABLE)
        _, told = again.communicate(timeout=LONGEST)
        assert (again.returncode, told) == (0, "")
        assert len(read(file).rows) == PAIRS
        assert not list((batch / "run").rglob(".*"))


def test_simulate_is_stopped_alike(tmp_path: Path) -> None:
    process = start(tmp_path, "simulate", "--out", "set", "--pairs", "20", "--voxel", "0.5")
    deadline = time.monotonic() + LONGEST
    while not list(tmp_path.glob("set/mid-*")):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    second = start(tmp_path, "simulate", "--out", "set", "--pairs", "1", "--voxel", "0.5")
    refused = second.communicate(timeout=LONGEST)[1]
    assert f"set is being written by process {process.pid} " in refused
    process.send_signal(signal.SIGTERM)
    _, told = process.communicate(timeout=LONGEST)
    assert process.returncode == 143
    assert told == (
        "hybridreg: stopped by SIGTERM; finished pairs are kept in set: the same command continues from there\n"
    )
    assert all(not folder.name.startswith(".") for folder in (tmp_path / "set").iterdir())


def test_a_second_table_in_the_folder_is_refused(batch: Path) -> None:
    first = start(batch, *TABLE)
    wait_for_rows(first, batch / "run" / "predictions" / "icp.jsonl", 0)
    for more in ((), ("--overwrite",)):
        second = start(batch, *TABLE, *more)
        _, told = second.communicate(timeout=LONGEST)
        if second.returncode == 0:
            pytest.fail("the second table ran beside the first, or after it on a very fast machine")
        assert second.returncode == 2
        assert told.startswith(f"hybridreg: run is being written by process {first.pid} on ")
        assert told.count("\n") == 1
        if first.poll() is not None:
            break
    _, told = first.communicate(timeout=LONGEST)
    assert (first.returncode, told) == (0, "")
    assert len(read(batch / "run" / "predictions" / "icp.jsonl").rows) == PAIRS


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("finished")
    killed_batch.write_data(root / "data", 2)
    (root / "table.toml").write_text(SLOW, encoding="utf-8")
    process = start(root, *TABLE)
    _, told = process.communicate(timeout=LONGEST)
    assert process.returncode == 0, told
    return root


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"PYTHONIOENCODING": "latin-1"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    ],
)
def test_any_terminal_shows_the_table_and_reports_are_utf8(
    finished: Path, environment: dict[str, str]
) -> None:
    for report in (finished / "run").glob("*.*"):
        report.unlink()
    process = start(finished, *TABLE, **environment)
    shown, told = process.communicate(timeout=LONGEST)
    assert (process.returncode, told) == (0, "")
    assert "identity" in shown
    assert ("RRE deg all" in shown) == (environment != {"PYTHONIOENCODING": "latin-1"})
    assert "RRE° all" in (finished / "run" / "table.md").read_text(encoding="utf-8")
    assert (finished / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("closing", ["> /dev/full", ">&- 2>&-", "2> /dev/full | head -c 10"])
def test_reports_are_written_whatever_becomes_of_the_output(finished: Path, closing: str) -> None:
    for report in (finished / "run").glob("*.*"):
        report.unlink()
    command = f"{sys.executable} -m hybridreg {' '.join(TABLE)} {closing}"
    given = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""}
    done = subprocess.run(
        command,
        shell=True,
        cwd=finished,
        env=given,
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    assert {file.name for file in (finished / "run").glob("*.*")} >= {"table.md", "table.csv", "report.html"}
    if closing == "> /dev/full":
        assert done.returncode == 2
        assert done.stderr.startswith("hybridreg: standard output: No space left on device")
    assert done.stderr.count("\n") <= 1


def test_little_memory_is_one_sentence(finished: Path) -> None:
    for arguments in (
        "list",
        "table table.toml --data data --out run",
        "train smoke --out t",
        "simulate --out s",
    ):
        command = f"ulimit -v 600000; exec {sys.executable} -m hybridreg {arguments}"
        given = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            command,
            shell=True,
            cwd=finished,
            env=given,
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=False,
        )
        assert done.returncode == 2, done.stderr
        assert done.stderr.count("\n") == 1
        assert "this shell allows 586 MB of addresses" in done.stderr


def mounted(root: Path, mounts: str, command: str) -> subprocess.CompletedProcess[str]:
    """A command under mounts of its own."""
    if os.geteuid() or shutil.which("unshare") is None:
        pytest.skip("needs the right to mount")
    if subprocess.run(["unshare", "-m", "mount", "-t", "tmpfs", "none", "/mnt"], check=False).returncode:
        pytest.skip("needs the right to mount")
    given = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    script = f"set -e\n{mounts}\nset +e\nexec {sys.executable} -m hybridreg {command}"
    return subprocess.run(
        ["unshare", "-m", "sh", "-c", script],
        cwd=root,
        env=given,
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )


def test_a_tiny_shared_memory_means_one_process(batch: Path) -> None:
    mounts = "mount -t tmpfs -o size=4k,nr_inodes=2 none /dev/shm; head -c 4096 /dev/zero > /dev/shm/full"
    done = mounted(batch, mounts, " ".join([*TABLE, "--workers", "2"]))
    assert done.returncode == 0, done.stderr
    assert "No space left on device" in done.stderr
    assert len(read(batch / "run" / "predictions" / "icp.jsonl").rows) == PAIRS


def test_without_a_folder_for_temporary_files(finished: Path) -> None:
    if Path("/tmp") in Path(__file__).resolve().parents or sys.prefix.startswith("/tmp/"):
        pytest.skip("this checkout lies in /tmp, which is to be taken away")
    here = shutil.copytree(finished, Path("/var/tmp") / f"hybridreg-{os.getpid()}")
    try:
        mounts = (
            "export TMPDIR=/nonexistent; mount -t tmpfs -o ro none /tmp; mount -t tmpfs -o ro none /dev/shm"
        )
        done = mounted(here, mounts, " ".join([*TABLE, "--workers", "2", "--overwrite"]))
        assert done.returncode == 0, done.stderr
    finally:
        shutil.rmtree(here)


@pytest.mark.parametrize(
    ("kilobytes", "named"), [(12, "run/predictions/icp.jsonl"), (200, "run/report.html")]
)
def test_a_full_disk_is_named_and_what_fits_is_there(batch: Path, kilobytes: int, named: str) -> None:
    mounts = (
        f"mkdir run; mount -t tmpfs -o size={kilobytes}k none run; trap 'cp -r run kept' EXIT\n"
        f"{sys.executable} -m hybridreg {' '.join(TABLE)}; code=$?; exit $code"
    )
    done = mounted(batch, f"set +e; {mounts}", "list")
    assert done.returncode == 2
    assert done.stderr == (
        f"hybridreg: {named}: No space left on device; make room, then run the same command again\n"
    )
    rows = read(batch / "kept" / "predictions" / "icp.jsonl").rows
    if kilobytes == 12:
        assert 0 < len(rows) < PAIRS
    else:
        assert len(rows) == PAIRS
        assert (batch / "kept" / "table.md").is_file()
        assert "identity" in done.stdout


def test_a_folder_that_cannot_be_written_is_named_before_any_pair_is_run(finished: Path) -> None:
    done = mounted(
        finished, "mkdir -p ro; mount -t tmpfs -o ro none ro", "table table.toml --data data --out ro/run"
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "hybridreg: ro/run/predictions: Read-only file system; name another folder\n" or (
        done.stderr == "hybridreg: ro/run: Read-only file system; name another folder\n"
    )
