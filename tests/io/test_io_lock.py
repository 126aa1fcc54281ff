# SPDX-License-Identifier: MIT
"""One writer at a time: who holds a lock is told, a killed owner's lock is free."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hybridreg.io import lock
from hybridreg.io.lock import InUse, file_lock, folder_lock
from hybridreg.io.owner import Owner

ROOT = Path(__file__).resolve().parents[2]
posix = pytest.mark.skipif(os.name != "posix", reason="flock and signals")

_HOLD = """
import sys, time
from hybridreg.io.lock import folder_lock
with folder_lock(sys.argv[1]):
    print("held", flush=True)
    time.sleep(60)
"""


def holder(folder: Path) -> subprocess.Popen[str]:
    """A process that holds the folder's lock."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(folder)], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_the_second_is_told_who_writes_and_since_when(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(InUse) as refused, folder_lock(tmp_path):
        pytest.fail("held twice")
    for part in (str(tmp_path), f"process {os.getpid()} on ", " since 20", "write to another path"):
        assert part in str(refused.value)
    assert list(tmp_path.iterdir()) == []
    with folder_lock(tmp_path):  # and it is free again
        pass


@posix
def test_a_killed_owner_holds_nothing(tmp_path: Path) -> None:
    process = holder(tmp_path)
    try:
        with pytest.raises(InUse, match=f"process {process.pid} "), folder_lock(tmp_path):
            pytest.fail("held twice")
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert len(list(tmp_path.iterdir())) == 1, "its file is still there"
    with folder_lock(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_forked_child_is_not_the_owner(tmp_path: Path) -> None:
    with folder_lock(tmp_path):
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(write)
            os.read(read, 1)
            os._exit(0)
        os.close(read)
    try:
        with folder_lock(tmp_path):
            pass
    finally:
        os.close(write)
        os.waitpid(child, 0)


def test_a_file_and_parts_of_a_folder_have_locks_of_their_own(tmp_path: Path) -> None:
    with (
        folder_lock(tmp_path),
        file_lock(tmp_path / "a"),
        file_lock(tmp_path / "b"),
        folder_lock(tmp_path, "p"),
    ):
        assert len(list(tmp_path.iterdir())) == 4
    assert list(tmp_path.iterdir()) == []


def test_a_deleted_lock_is_taken_anew_or_told_to_be_lost(tmp_path: Path) -> None:
    held = folder_lock(tmp_path)
    with held:
        next(tmp_path.iterdir()).unlink()
        held.renew()
        with pytest.raises(InUse), folder_lock(tmp_path):
            pytest.fail("held twice")
        next(tmp_path.iterdir()).unlink()
        with folder_lock(tmp_path), pytest.raises(InUse):
            held.renew()


@pytest.fixture
def without_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock, "_flock", lambda _: False)


def note(folder: Path, **changes: object) -> Path:
    file = folder_lock(folder).path
    file.write_text(json.dumps({**vars(Owner.here()), **changes}))
    return file


@posix
@pytest.mark.usefixtures("without_locks")
@pytest.mark.parametrize(("pid", "start"), [(2**22 + 1, ""), (os.getpid(), "1")], ids=["gone", "reused"])
def test_where_there_are_no_locks_a_process_that_is_gone_is_taken_over(
    tmp_path: Path, pid: int, start: str
) -> None:
    note(tmp_path, pid=pid, start=start)
    with (
        pytest.warns(UserWarning, match="knows no locks"),
        folder_lock(tmp_path),
        pytest.raises(InUse),
        folder_lock(tmp_path),
    ):
        pytest.fail("held twice")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("without_locks")
@pytest.mark.parametrize("changes", [{}, {"host": "elsewhere", "pid": 2**22 + 1}, {"pid": 1}])
def test_where_there_are_no_locks_others_are_believed(tmp_path: Path, changes: dict[str, object]) -> None:
    file = note(tmp_path, **changes)
    if changes.get("pid") == 1:
        file.write_text("")  # half a note
    told = pytest.raises(InUse, match=f"delete {file}")
    with pytest.warns(UserWarning, match="knows no locks"), told, folder_lock(tmp_path):
        pytest.fail("taken from its owner")


def test_a_clock_that_jumps_changes_nothing(tmp_path: Path) -> None:
    for since in ("1970-01-01T00:00:00+00:00", "2999-01-01T00:00:00+00:00"):
        note(tmp_path, since=since)
        with folder_lock(tmp_path):
            pass


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as told, folder_lock(tmp_path / "none"):
        pytest.fail("locked nothing")
    assert told.value.filename == str(tmp_path / "none")


_WRITES = """
import os, signal, sys
from hybridreg.io.atomic import atomic_path
with atomic_path(sys.argv[1]) as temporary:
    temporary.write_text("half")
    if sys.argv[2] == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    print("writing", flush=True)
    sys.stdin.read()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals and flock")
def test_what_a_killed_writer_left_is_swept_and_what_is_being_written_stays(tmp_path: Path) -> None:
    command = [sys.executable, "-c", _WRITES, str(tmp_path / "report.html")]
    subprocess.run([*command, "killed"], check=False)
    (left,) = tmp_path.glob(".*.html")
    mine = tmp_path / ".gitignore"
    mine.write_text("runs")
    with subprocess.Popen(
        [*command, "goes on"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "writing\n"
        with folder_lock(tmp_path):
            assert not left.exists()
        writer.communicate("")
    assert (tmp_path / "report.html").read_text() == "half"
    assert sorted(path.name for path in tmp_path.iterdir()) == [".gitignore", "report.html"]
