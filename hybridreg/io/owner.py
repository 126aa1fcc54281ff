# SPDX-License-Identifier: MIT
"""Who is writing: a process identified by its number, host and start."""

from __future__ import annotations

import json
import os
import socket
import sys
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Owner:
    """A process that writes; `start` distinguishes it from a later one with the same number."""

    pid: int
    host: str
    since: str
    start: str = ""

    @classmethod
    def here(cls) -> Owner:
        """This process, now."""
        now = datetime.now(timezone.utc).isoformat(timespec="seconds")
        return cls(pid=os.getpid(), host=socket.gethostname(), since=now, start=start_of(os.getpid()))

    @classmethod
    def parse(cls, note: bytes) -> Owner | None:
        """The owner that a note names; None where it is empty or incomplete: its writer is just starting or ending."""
        try:
            return cls(**json.loads(note))
        except (ValueError, TypeError):
            return None

    def note(self) -> bytes:
        """What `parse` reads."""
        return (json.dumps(asdict(self)) + "\n").encode()

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host} since {self.since}"

    def is_gone(self) -> bool:
        """Has it ended? Only known for processes of this host, and where the system reports it."""
        if self.host != socket.gethostname() or os.name != "posix":
            return False
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return True
        except OSError:  # another user's process
            return False
        return bool(self.start) and start_of(self.pid) != self.start


def start_of(pid: int) -> str:
    """When a process began, in ticks since boot; empty where the system does not report it (not Linux)."""
    if sys.platform != "linux":
        return ""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return stat.rpartition(")")[2].split()[19]
