# SPDX-License-Identifier: MIT
"""Loading plug-ins of other packages: a broken one is an `ImportError` that names it, whatever its import does."""

from __future__ import annotations

from importlib import import_module
from operator import attrgetter
from typing import Any


def load(target: str, what: str, group: str) -> Any:
    """The object of an entry point.

    Parameters
    ----------
    target : "module:attribute"
    what : what messages call it
    group : the entry points' group

    Raises
    ------
    ImportError
        Its import raised an exception or tried to end the process, or there is no such attribute.
    """
    module, _, attribute = target.partition(":")
    try:
        return attrgetter(attribute)(import_module(module))
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        # SystemExit too: a plug-in must not end the process that loads it.
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ImportError(
            f"{what} ({target}) of a plug-in cannot be loaded: {reason}; repair or uninstall the package that "
            f"registers it in {group!r}"
        ) from error
