# SPDX-License-Identifier: MIT
"""The site's page of findings, made of the comments at the head of the scripts in findings/.

python -m tools.findings_page > page.md
"""

from __future__ import annotations

import re
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "findings"
_GUESS, _WHOM = "Guess before it was run:", "For whom it matters:"
_HEAD = """# Findings

What surprised us in other people's software while this library was built. Each entry is a script in `findings/` that
installs the version named, shows the behaviour and fails once it is gone: `bash findings/NAME.sh`. Before a script was
run, we wrote down what we expected.
"""


def page(folder: Path = FOLDER) -> str:
    """The Markdown of the page: one entry for each script, by name.

    Raises
    ------
    ValueError
        A script whose head does not say what was found, what was guessed, and for whom it matters.
    """
    scripts = sorted(path for path in folder.iterdir() if path.suffix in (".py", ".sh"))
    return "\n".join([_HEAD, *(entry(script) for script in scripts)])


def entry(script: Path) -> str:
    """A heading, what was found, what was guessed, and for whom it matters."""
    found, guess, whom = _parts(head(script.read_text(encoding="utf-8")), script.name)
    lines = [
        f"## {_title(script.stem, found)}",
        found,
        f"**What we expected:** {_sentence(guess)}",
        f"**For whom it matters:** {_sentence(whom)}",
        f"Script: `findings/{script.name}`",
    ]
    return "\n\n".join(lines) + "\n"


def head(text: str) -> str:
    """The comment that a script begins with, its paragraphs kept apart, without `#!` and the licence."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith(("#!", "# SPDX")):
            lines.append(line.removeprefix("#").strip())
    return "\n".join(lines).strip()


def _parts(text: str, name: str) -> tuple[str, str, str]:
    found, guessed, rest = text.partition(_GUESS)
    guess, told, whom = rest.partition(_WHOM)
    parts = tuple(" ".join(part.split()) for part in (found, guess, whom))
    if not (guessed and told and all(parts)):
        raise ValueError(
            f"findings/{name}: its first comment must say what was found, then "
            f"'{_GUESS} ...', then '{_WHOM} ...'"
        )
    return parts[0], parts[1], parts[2]


def _title(stem: str, found: str) -> str:
    # "kiss-icp 1.3.0 takes ..." in kiss-icp-partners-one-voxel-away.sh: the package, its version, and the rest.
    package = re.match(r"([\w.-]+) (\d[\w.]*\w)", found)
    if package is None or not stem.startswith(f"{package[1]}-"):
        return stem.replace("-", " ")
    return f"{package[1]} {package[2]}: {stem.removeprefix(f'{package[1]}-').replace('-', ' ')}"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


if __name__ == "__main__":
    print(page(), end="")
