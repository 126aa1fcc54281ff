# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import stat
import threading

import pytest

from hybridreg.io import atomic_path, write_bytes, write_text

posix = pytest.mark.skipif(os.name != "posix", reason="POSIX file modes and devices")


def test_new_file_and_replaced_file(tmp_path):
    path = tmp_path / "result.json"
    for content in (b"first", b"second, longer"):
        write_bytes(path, content)
        assert path.read_bytes() == content
        assert os.listdir(tmp_path) == ["result.json"]


def test_text_is_utf8_with_its_own_line_ends(tmp_path):
    write_text(str(tmp_path / "a.txt"), "Straße\n9°\n")
    assert (tmp_path / "a.txt").read_bytes() == "Straße\n9°\n".encode()


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_old_content_stays_when_the_block_fails(tmp_path, error):
    path = tmp_path / "result.json"
    path.write_text("old")

    def half_written():
        with atomic_path(path) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        half_written()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["result.json"]


def test_nothing_stays_when_the_disk_is_full(tmp_path, monkeypatch):
    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_bytes(tmp_path / "a.bin", b"data")
    assert os.listdir(tmp_path) == []


def test_content_reaches_the_disk_before_the_name(tmp_path, monkeypatch):
    steps = []
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (steps.append("fsync"), fsync(handle))[1])
    monkeypatch.setattr(os, "replace", lambda a, b: (steps.append("replace"), replace(a, b))[1])
    write_bytes(tmp_path / "a.bin", b"data")
    assert steps[:2] == ["fsync", "replace"]


def test_temporary_lies_beside_and_has_the_suffix(tmp_path):
    with atomic_path(tmp_path / "figure.png") as temporary:
        assert temporary.parent == tmp_path.resolve()
        assert temporary.suffix == ".png"
        assert not (tmp_path / "figure.png").exists()


def test_a_writer_may_replace_the_temporary(tmp_path):
    with atomic_path(tmp_path / "a.txt") as temporary:
        temporary.unlink()
        temporary.write_text("anew")
    assert (tmp_path / "a.txt").read_text() == "anew"


@posix
def test_mode_follows_the_umask_or_the_old_file(tmp_path):
    path, umask = tmp_path / "a.txt", os.umask(0o027)
    try:
        write_text(path, "new")
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
        path.chmod(0o604)
        write_text(path, "again")
        assert stat.S_IMODE(path.stat().st_mode) == 0o604
    finally:
        os.umask(umask)


@posix
def test_a_link_is_followed(tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "latest.txt").symlink_to(tmp_path / "runs" / "7.txt")
    write_text(tmp_path / "latest.txt", "seven")
    assert (tmp_path / "latest.txt").is_symlink()
    assert (tmp_path / "runs" / "7.txt").read_text() == "seven"


@posix
def test_devices_and_pipes_are_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in ("/dev/null", tmp_path / "pipe"):
        with pytest.raises(ValueError, match="device or a pipe"):
            write_text(path, "data")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_missing_folder_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.txt.*none does not exist; create it"):
        write_text(tmp_path / "none" / "a.txt", "data")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        write_text(tmp_path, "data")


def test_readers_never_see_a_half(tmp_path):
    path = tmp_path / "a.bin"
    contents = [bytes([value]) * 50_000 for value in (1, 2)]
    write_bytes(path, contents[0])
    done = threading.Event()
    seen = set()

    def watch():
        while not done.is_set():
            seen.add(path.read_bytes())

    watcher = threading.Thread(target=watch)
    watcher.start()
    for turn in range(40):
        write_bytes(path, contents[turn % 2])
    done.set()
    watcher.join()
    assert seen <= set(contents)
