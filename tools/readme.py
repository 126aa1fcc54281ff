# SPDX-License-Identifier: MIT
"""Put measured tables into a page between their markers, so that no figure there is typed by hand.

    python -m tools.readme peers=runs/peers.md
    python -m tools.readme --page docs/results.md real=runs/real/table.md learned-mid=runs/learned-mid/table.md

replaces the text in README.md between `<!-- peers -->` and `<!-- /peers -->` by that file, and so on; of a file that
`hybridreg table` wrote, by its first protocol's caption, results and verdicts, or the given `--sections`, by the
beginnings of their titles. `--page` names another page.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

from hybridreg.io import write_text

ROOT = Path(__file__).resolve().parent.parent
_SHOWN = ("Results", "Verdict against success")


def insert(page: str, name: str, text: str) -> str:
    """The page with `text` between the markers of `name`.

    Raises
    ------
    ValueError
        The page does not hold the markers exactly once.
    """
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- /{re.escape(name)} -->)", flags=re.DOTALL)
    if len(pattern.findall(page)) != 1:
        raise ValueError(f"the page must hold <!-- {name} --> and <!-- /{name} --> exactly once")
    return pattern.sub(lambda found: f"{found[1]}\n{text.strip()}\n\n{found[2]}", page)


def shown(text: str, sections: Sequence[str] = _SHOWN) -> str:
    """Caption and some sections of a table's first protocol, by default results and verdicts; any other text
    unchanged."""
    protocols = re.split(r"^## .*$", text, flags=re.MULTILINE)
    if len(protocols) < 2:
        return text
    caption, *parts = re.split(r"^### (.*)$", protocols[1], flags=re.MULTILINE)
    bodies = dict(zip(parts[::2], parts[1::2], strict=True))
    chosen = [
        body.strip() for wanted in sections for title, body in bodies.items() if title.startswith(wanted)
    ]
    return "\n\n".join([caption.strip(), *chosen])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="+", metavar="name=file")
    parser.add_argument("--page", default="README.md")
    parser.add_argument("--sections", nargs="+", default=_SHOWN)
    given = parser.parse_args()
    file = ROOT / given.page
    page = file.read_text(encoding="utf-8")
    for part in given.parts:
        name, _, table = part.partition("=")
        page = insert(page, name, shown(Path(table).read_text(encoding="utf-8"), given.sections))
    write_text(file, page)


if __name__ == "__main__":
    main()
