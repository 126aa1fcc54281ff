# SPDX-License-Identifier: MIT
"""What a method of the user's own consists of, as one number: the same name may stand for other code and other values.

A function, a plain class and a network have no fields that could be written down. So their code is taken in, with what
they hold: attributes, closures, defaults, the globals that they name, and of a network its weights. Attributes that
begin with an underscore are taken for caches, and left out.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import types
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_OURS = "hybridreg."
_PLAIN = (bool, int, float, complex, str, bytes, type(None))


def own_content(method: Any) -> str | None:
    """Sixteen hexadecimal digits of all that is not this library's in a method, or None where there is nothing."""
    own = list(_own(method))
    return _digest(own, {}).hex()[:16] if own else None


def _own(value: Any) -> Iterator[Any]:
    # What does not come with the library, in its own stages too; the fields of those are written down.
    if isinstance(value, (*_PLAIN, np.ndarray, np.generic)):
        return
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, (tuple, list)):
        for item in value:
            yield from _own(item)
    elif is_dataclass(value) and type(value).__module__.startswith(_OURS):
        yield from _own([getattr(value, field.name) for field in fields(value)])
    else:
        yield value


def _digest(value: Any, seen: dict[int, Any]) -> bytes:
    # `seen` keeps what was met, so that a cycle ends and no number is given out twice.
    if isinstance(value, _PLAIN):
        return _of(type(value).__name__, repr(value))
    if id(value) in seen:
        return _of("again")
    seen[id(value)] = value
    return _of(type(value).__qualname__, *(_digest(part, seen) for part in _parts(value, seen)))


def _parts(value: Any, seen: dict[int, Any]) -> Iterable[Any]:
    if hasattr(value, "detach") and hasattr(value, "numpy"):  # a tensor
        value = np.asarray(value.detach().cpu().float().numpy())
    if isinstance(value, (np.ndarray, np.generic)):
        plain = value.dtype.hasobject
        return (str(value.dtype), repr(np.shape(value)), value.tolist() if plain else value.tobytes())
    if isinstance(value, Mapping):
        return [part for key in sorted(value, key=repr) for part in (key, value[key])]
    if isinstance(value, (set, frozenset)):
        return sorted(_digest(item, seen) for item in value)
    if isinstance(value, (tuple, list)):
        return value
    if isinstance(value, types.CodeType):
        return (value.co_code, value.co_names, value.co_consts)
    if isinstance(value, types.FunctionType):
        return _of_function(value)
    if isinstance(value, types.MethodType):
        return (value.__func__, value.__self__)
    if isinstance(value, functools.partial):
        return (value.func, value.args, value.keywords)
    if isinstance(value, type):
        return (value.__module__, value.__qualname__, *_code(value))
    if isinstance(value, (types.ModuleType, types.BuiltinFunctionType)):
        return (value.__name__,)
    return (type(value).__module__, *_code(type(value)), *_state(value))


def _of_function(function: types.FunctionType) -> Iterator[Any]:
    yield from (function.__code__, function.__defaults__, function.__kwdefaults__)
    for cell in function.__closure__ or ():
        with contextlib.suppress(ValueError):  # not filled yet
            yield cell.cell_contents
    for name in function.__code__.co_names:
        used = function.__globals__.get(name)
        elsewhere = getattr(used, "__module__", function.__module__) != function.__module__
        # Code of other modules is named only: theirs would lead through half of what is installed.
        yield getattr(used, "__qualname__", type(used).__qualname__) if elsewhere else used


def _code(cls: type) -> list[Any]:
    # Of its bases too, as far as they stand beside it.
    bases = (base for base in cls.__mro__ if base.__module__ == cls.__module__)
    held = (getattr(value, "__func__", value) for base in bases for _, value in sorted(vars(base).items()))
    return [value for value in held if isinstance(value, (types.FunctionType, *_PLAIN))]


def _state(value: Any) -> Iterator[Any]:
    if callable(weights := getattr(value, "state_dict", None)):
        yield dict(weights())
    public = {name: held for name, held in getattr(value, "__dict__", {}).items() if not name.startswith("_")}
    slots = [name for cls in type(value).__mro__ for name in getattr(cls, "__slots__", ())]
    yield public | {name: getattr(value, name, None) for name in slots if not name.startswith("_")}


def _of(*parts: str | bytes) -> bytes:
    whole = hashlib.sha256()
    for part in parts:
        text = part.encode() if isinstance(part, str) else part
        whole.update(len(text).to_bytes(8, "little") + text)
    return whole.digest()
