# SPDX-License-Identifier: MIT
"""What the site needs beyond its theme: the package laid out as in a wheel, notebooks as pages, names as links.

mkdocs loads this file by its path (`hooks` in mkdocs.yml), in an environment that holds none of our dependencies.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

from findings_page import page as findings_page  # mkdocs puts the folder of its hooks on the path
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
# `hybridreg.classical` and its like lie beside the package in a checkout; names are read where a wheel has them.
_API = ROOT / "build" / "api"
_BESIDE = ("classical", "eval", "learned")
_CODE = re.compile(
    r"<code>((?:hr\.|hybridreg\.)?([A-Za-z_]\w*)((?:\.\w+)*)(?:\([^<]*\))?)</code>(?!</a>|</autoref>)"
)


def on_startup(**_: Any) -> None:
    """Lay the package out for the reference, as links to the sources."""
    shutil.rmtree(_API, ignore_errors=True)
    package = _API / "hybridreg"
    package.mkdir(parents=True)
    for path in [*(ROOT / "hybridreg").iterdir(), *(ROOT / name for name in _BESIDE)]:
        if path.name != "__pycache__":
            (package / path.name).symlink_to(path)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The findings, and a page for each notebook beside the notebook itself."""
    files.append(File.generated(config, "findings.md", content=findings_page()))
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        notebook = json.loads(Path(str(file.abs_src_path)).read_text(encoding="utf-8"))
        page = page_of(notebook, file.name + ".ipynb")
        files.append(File.generated(config, file.src_uri.removesuffix(".ipynb") + ".md", content=page))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """In a checkout the index names the notebooks themselves; on the site each has a page."""
    return markdown.replace(".ipynb)", ".md)") if page.file.src_uri == "notebooks/index.md" else markdown


def on_page_content(html: str, **_: Any) -> str:
    """Names of the public classes and functions in running text lead to the reference."""
    return _CODE.sub(_link, html)


def page_of(notebook: dict[str, Any], name: str) -> str:
    """The Markdown of a notebook's cells, code in fences, under a link to the file."""
    parts = []
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        parts.append(f"```python\n{text}\n```" if cell["cell_type"] == "code" else text)
    return "\n\n".join([parts[0], f"[Download this notebook]({name})", *parts[1:]]) + "\n"


def _public() -> frozenset[str]:
    text = (ROOT / "hybridreg" / "__init__.py").read_text(encoding="utf-8")
    return frozenset(
        name for names in re.findall(r'": \[(.*?)\]', text) for name in re.findall(r'"(\w+)"', names)
    )


_PUBLIC = _public()


def _link(found: re.Match[str]) -> str:
    if found[2] not in _PUBLIC:
        return found[0]
    # Left as it is where the reference has no such name: a method that is private, say.
    return f'<autoref identifier="hybridreg.{found[2]}{found[3]}" optional>{found[0]}</autoref>'
