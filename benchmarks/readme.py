# SPDX-License-Identifier: MIT
"""Put measured tables into README.md, between their markers, so that no figure there is typed by hand.

    python -m benchmarks.readme real=runs/real/table.md peers=runs/peers.md

replaces what stands between `<!-- real -->` and `<!-- /real -->` by that file, and so on.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from hybridreg.io import write_text

README = Path(__file__).resolve().parent.parent / "README.md"


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


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="+", metavar="name=file")
    page = README.read_text(encoding="utf-8")
    for part in parser.parse_args().parts:
        name, _, file = part.partition("=")
        page = insert(page, name, Path(file).read_text(encoding="utf-8"))
    write_text(README, page)


if __name__ == "__main__":
    main()
