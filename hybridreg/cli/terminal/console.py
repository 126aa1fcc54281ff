# SPDX-License-Identifier: MIT
"""Text on terminals of any encoding: characters that one cannot show are spelled in ASCII and never an error."""

from __future__ import annotations

import codecs
import os
import sys
from typing import TextIO

_SPELLED = {
    "°": " deg",
    "–": "-",
    "—": "-",
    "†": "+",
    "…": "...",
    "×": "x",
    "±": "+-",
    "≥": ">=",
    "≤": "<=",
    "·": "-",
}
_FALLBACK = "hybridreg.spelled"


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    plain = "".join(_SPELLED.get(each, each) for each in text)
    return plain.encode("ascii", "backslashreplace").decode("ascii"), error.end


codecs.register_error(_FALLBACK, _spell)


def make_ready() -> None:
    """Make sure that stdout and stderr exist and can show any text.

    The number of a closed stream (`2>&-`) goes to the next file that is opened, so that output of a library would end
    up in our results.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_FALLBACK)


def shown(text: str, stream: TextIO | None = None) -> str:
    """The text as a stream (stdout) will show it, for columns that depend on its width."""
    encoding = getattr(stream or sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, _FALLBACK).decode(encoding)
