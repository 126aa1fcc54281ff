# SPDX-License-Identifier: MIT
"""The unit that an object says its values have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from hybridreg.io.faults import fault
from hybridreg.io.meaning.unit_words import metres_of, tell_cells

# Where objects say it: astropy, pint and trimesh; in dictionaries, as those of xarray, pandas, h5py and pyarrow.
_ATTRIBUTES = ("unit", "units")
_DICTIONARIES = ("attrs", "metadata")
_KEYS = ("unit", "units", "length_unit")


def unit_given(x: Any, name: str) -> float | None:
    """Metres of the unit that an object says its values have; None where it says none that is known.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    words = list(_words(x))
    tell_cells(words, name)
    for word in words:
        metres = metres_of(word, name)
        if metres is not None:
            return metres
    return None


def one_unit(units: Iterable[float | None], name: str) -> float | None:
    """The unit of x, y and z from that of each; without one it is the metre.

    Raises
    ------
    ValueError
        They differ.
    """
    each = list(units)
    if len({1.0 if metres is None else metres for metres in each}) > 1:
        told = ", ".join("none" if metres is None else f"{metres:g} m" for metres in each)
        raise fault(name, f"the units of its x, y and z differ: {told}", "give all three in one unit")
    return next((metres for metres in each if metres is not None), None)


def _words(x: Any) -> Iterator[str]:
    for attribute in _ATTRIBUTES:
        yield from _word(getattr(x, attribute, None))
    for held in (x if isinstance(x, Mapping) else None, *(getattr(x, each, None) for each in _DICTIONARIES)):
        if isinstance(held, Mapping) or hasattr(held, "keys"):
            for key in _KEYS:
                yield from _word(_of(held, key))


def _of(held: Any, key: str) -> Any:
    # pyarrow's keys are bytes.
    return next((held[each] for each in (key, key.encode()) if each in list(held.keys())), None)


def _word(said: Any) -> Iterator[str]:
    # A column that is called so is no unit.
    if said is None or callable(said) or bool(getattr(said, "shape", ())) or isinstance(said, (int, float)):
        return
    yield said.decode("latin-1") if isinstance(said, bytes) else str(said)
