# SPDX-License-Identifier: MIT
"""Registration of point clouds from different sensors: every stage a slot, classical or learned."""

from pathlib import Path as _Path

# In a checkout `classical/`, `learned/` and `eval/` lie beside this package; a wheel carries them inside it.
_root = _Path(__file__).resolve().parent.parent
if (_root / "pyproject.toml").is_file() and (_root / "classical").is_dir():
    __path__.append(str(_root))
