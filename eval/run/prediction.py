# SPDX-License-Identifier: MIT
"""Run a method over a data set once: rows are stored as they finish, an interrupted run continues from there."""

from __future__ import annotations

import dataclasses
import inspect
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hybridreg import __version__
from hybridreg.data import content
from hybridreg.data.dataset import fingerprint_of, ids_of, looks_of, vouch
from hybridreg.eval.run import truth
from hybridreg.eval.run.attempt import Method, Traceable, attempt, one_line
from hybridreg.eval.run.controls import Control, after
from hybridreg.eval.run.header import fingerprint_under
from hybridreg.eval.run.own_content import own_content
from hybridreg.eval.run.row import Row
from hybridreg.eval.run.store import Appender
from hybridreg.fitting import check_seed
from hybridreg.io.shipped_weights import CONFIG_FILE, WEIGHTS_FILE
from hybridreg.pair import LabelledPair
from hybridreg.runtime.threads import one_thread
from hybridreg.runtime.workers import led, spread


def predict(
    method: Method | Control,
    pairs: Sequence[LabelledPair],
    path: str | os.PathLike[str],
    *,
    seed: int = 0,
    workers: int | None = None,
    overwrite: bool = False,
    data: str = "",
    on_row: Callable[[Row], None] | None = None,
) -> list[Row]:
    """Rows of every pair, from the file where it has them, otherwise computed and appended to it.

    Parameters
    ----------
    method : Pipeline, or a function of (pair, seed) that returns a 4x4 pose, a RegistrationResult or None; or a
        control of an ablation, which alone is given the true pose
    pairs : sequence of LabelledPair
        With more than one worker it is sent to them pickled, so it should read its pairs lazily.
    path : file to write
    seed : int
        With a pair's id it fixes all randomness, so that neither order nor workers change a row.
    workers : int or None
        Processes, each with one thread; pairs at a time where another backend runs them. None takes what
        `joblib.parallel_config` says, else 1: under `joblib.parallel_config(backend="dask")` the pairs spread over a
        cluster, and those of a lost machine are done by the others. A pair that kills its process is a failed row with
        two or more workers; with one it ends this process too, and with dask joblib (1.6) waits for it forever.
    overwrite : bool
        Start over, whatever the file holds.
    data : str
        The data set's name, for reports.
    on_row : called with each row, old ones included

    Raises
    ------
    TypeError
        The method is neither a pipeline nor a function of two arguments.
    ValueError
        The file was made by another configuration or version, of data or weights with another content; it is being
        written by another process; two pairs share an id; the poses map target to source; or the seed is negative.
    ImportError
        A package that the method or the data need is not here; what was never run is not a failed row.
    OSError
        The file cannot be written.
    """
    _check(method)
    check_seed(seed)
    ids = ids_of(pairs)
    vouch(pairs)
    seen = looks_of(pairs)
    described = describe(method)
    weights = weights_of(described)
    config = {
        "version": __version__,
        "method": described,
        "data": {
            "name": data,
            "pairs": len(ids),
            "fingerprint": fingerprint_under(path, seen) or fingerprint_of(pairs),
        },
        "seed": seed,
        **({"weights": weights} if weights else {}),
    }
    rows: dict[str, Row] = {}
    with Appender(path, config, ids=ids, overwrite=overwrite, seen=seen) as file:
        for row in tuple(file.done):
            rows[row.id] = row
            if on_row is not None:
                on_row(row)
        missing = [index for index, name in enumerate(ids) if name not in rows]
        for row in _rows(method, pairs, ids, missing, seed, workers):
            file.add(row)
            rows[row.id] = row
            if on_row is not None:
                on_row(row)
    return sorted(rows.values(), key=lambda row: row.index)


def _check(method: Any) -> None:
    # A mistake of the caller's, which every pair would repeat.
    if isinstance(method, (Traceable, Control)) and not isinstance(method, type):
        return
    if isinstance(method, str):
        raise TypeError(f"method {method!r}: expected a pipeline, such as Pipeline.preset({method!r})")
    if not callable(method) or isinstance(method, type):
        raise TypeError(f"method {method!r}: expected a pipeline or a function of (pair, seed)")
    try:
        signature = inspect.signature(method)
    except ValueError:  # of some functions that are compiled
        return
    try:
        signature.bind("pair", 0)
    except TypeError as error:
        raise TypeError(f"method {method!r}: a function is called with (pair, seed), but: {error}") from None


def describe(method: Any) -> dict[str, Any]:
    """What identifies a method in a configuration: a pipeline's spec, or a callable's name and fields; and the content
    of what is the user's own in it."""
    own = own_content(method)
    content = {} if own is None else {"own_content": own}
    if hasattr(method, "to_spec"):
        spec: dict[str, Any] = method.to_spec()
        return {**spec, **content}
    fields = (
        dataclasses.asdict(method)
        if dataclasses.is_dataclass(method) and not isinstance(method, type)
        else {}
    )
    named = method if hasattr(method, "__qualname__") else type(method)
    return {"callable": f"{named.__module__}:{named.__qualname__}", **fields, **content}


def weights_of(described: Any) -> dict[str, str]:
    """A hash of the user's own weights that a method names, by folder or file; those in the wheel are identified by
    the version."""
    if not isinstance(described, Mapping):
        return {}
    found: dict[str, str] = {}
    for key, value in described.items():
        if key == "weights" and isinstance(value, str) and Path(value).exists():
            folder = Path(value)
            files = [folder / CONFIG_FILE, folder / WEIGHTS_FILE] if folder.is_dir() else [folder]
            found[value] = " ".join(content.digest(file) for file in files if file.is_file())
        for part in value if isinstance(value, (list, tuple)) else (value,):
            found.update(weights_of(part))
    return found


def predict_pair(
    method: Method | Control, pairs: Sequence[LabelledPair], index: int, name: str, seed: int
) -> Row:
    """The row of one pair; an error anywhere becomes a failed row."""
    with one_thread():
        try:
            labelled = pairs[index]
        except ImportError:  # of a reader: no fault of the pair
            raise
        except Exception as error:
            return Row(index=index, id=name, error=one_line(error))
        try:
            told, pair = (
                method.told(labelled, after(pairs, index))
                if isinstance(method, Control)
                else (method, labelled.pair)
            )
        except Exception as error:  # the other pair's image may be what cannot be read
            return Row(index=index, id=name, error=one_line(error))
        tried = attempt(told, pair, seed)
        try:
            return truth.row(index, labelled, tried, match=getattr(told, "match", None))
        except Exception as error:
            return Row(index=index, id=name, error=f"the answer could not be measured: {one_line(error)}")
        finally:
            if tried.trace is not None:
                tried.trace.scene.release()


def _rows(
    method: Method | Control,
    pairs: Sequence[LabelledPair],
    ids: Sequence[str],
    missing: list[int],
    seed: int,
    workers: int | None,
) -> Iterator[Row]:
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = set(missing)
    try:
        for row in _parallel(method, pairs, ids, missing, seed, workers):
            left.discard(row.index)
            yield row
    except TerminatedWorkerError:
        # Some pair killed its process and others with it. Each alone in a process, the others succeed.
        yield from _one_by_one(method, pairs, ids, sorted(left), seed)


def _parallel(
    method: Method | Control,
    pairs: Sequence[LabelledPair],
    ids: Sequence[str],
    indices: list[int],
    seed: int,
    workers: int | None,
) -> Iterator[Row]:
    # One pair a task, so that a row is on disk as soon as it is done.
    jobs = ((method, pairs, index, ids[index], seed) for index in indices)
    return spread(predict_pair, jobs, workers, singly=True)


def _one_by_one(
    method: Method | Control, pairs: Sequence[LabelledPair], ids: Sequence[str], indices: list[int], seed: int
) -> Iterator[Row]:
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    for index in indices:
        with ProcessPoolExecutor(max_workers=1) as pool:
            try:
                yield pool.submit(
                    led, os.getpid(), predict_pair, (method, pairs, index, ids[index], seed)
                ).result()
            except TerminatedWorkerError as error:
                yield Row(index=index, id=ids[index], error=f"the process died: {one_line(error)}")
