# SPDX-License-Identifier: MIT
"""Run a method over a data set, once: rows go to disk as they are done, a broken run goes on from there."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from hybridreg import __version__
from hybridreg.data.dataset import fingerprint_of, ids_of
from hybridreg.eval import truth
from hybridreg.eval.attempt import Method, attempt, one_line
from hybridreg.eval.controls import Control
from hybridreg.eval.own_workers import own_workers
from hybridreg.eval.row import Row
from hybridreg.eval.store import Appender
from hybridreg.pair import LabelledPair
from hybridreg.threads import one_thread


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
    """Rows of every pair, from the file where it has them, else computed and appended to it.

    Parameters
    ----------
    method : Pipeline, or a function of (pair, seed) that returns a 4x4 pose, a RegistrationResult or None; or a
        control of an ablation, which alone is told the truth
    pairs : sequence of LabelledPair
        With more than one worker it travels to them pickled, so it should read its pairs lazily.
    path : file to write
    seed : int
        With a pair's id it fixes all randomness, so that neither order nor workers change a row.
    workers : int or None
        Processes, each with one thread; pairs at a time where another backend runs them. None takes what
        `joblib.parallel_config` says, else 1: under `joblib.parallel_config(backend="dask")` the pairs spread
        over a cluster, and those of a lost machine are done by the others. A pair that kills its process is a
        failed row with two or more workers; with one it takes this process along, and on dask joblib (1.6)
        waits for it for ever.
    overwrite : bool
        Begin anew, whatever the file holds.
    data : str
        The data set's name, for reports.
    on_row : called with each row, old ones included

    Raises
    ------
    ValueError
        The file was made by another configuration or version; or two pairs share an id.
    """
    ids = ids_of(pairs)
    config = {
        "version": __version__,
        "method": describe(method),
        "data": {"name": data, "pairs": len(ids), "fingerprint": fingerprint_of(pairs)},
        "seed": seed,
    }
    rows: dict[str, Row] = {}
    with Appender(path, config, overwrite=overwrite) as file:
        for row in file.done:
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


def describe(method: Any) -> dict[str, Any]:
    """What identifies a method in a configuration: a pipeline's spec, or a callable's name and fields."""
    if hasattr(method, "to_spec"):
        spec: dict[str, Any] = method.to_spec()
        return spec
    fields = (
        dataclasses.asdict(method)
        if dataclasses.is_dataclass(method) and not isinstance(method, type)
        else {}
    )
    named = method if hasattr(method, "__qualname__") else type(method)
    return {"callable": f"{named.__module__}:{named.__qualname__}", **fields}


def predict_pair(
    method: Method | Control, pairs: Sequence[LabelledPair], index: int, name: str, seed: int
) -> Row:
    """The row of one pair; an error anywhere becomes a failed row."""
    with one_thread():
        try:
            labelled = pairs[index]
        except Exception as error:
            return Row(index=index, id=name, error=one_line(error))
        told, pair = method.told(labelled) if isinstance(method, Control) else (method, labelled.pair)
        tried = attempt(told, pair, seed)
        try:
            return truth.row(index, labelled, tried)
        except Exception as error:
            return Row(index=index, id=name, error=f"the answer could not be measured: {one_line(error)}")


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
        with own_workers():
            for row in _parallel(method, pairs, ids, missing, seed, workers):
                left.discard(row.index)
                yield row
    except TerminatedWorkerError:
        # Some pair killed its process and took others along. Alone in a process each, the others go through.
        yield from _one_by_one(method, pairs, ids, sorted(left), seed)


def _parallel(
    method: Method | Control,
    pairs: Sequence[LabelledPair],
    ids: Sequence[str],
    indices: list[int],
    seed: int,
    workers: int | None,
) -> Iterator[Row]:
    from joblib import Parallel, delayed
    from joblib.parallel import get_active_backend

    # One pair a task, so that a row is on the disk as soon as it is done. On dask joblib (1.6) takes all cores whatever
    # `n_jobs` says; but no more than `pre_dispatch` tasks wait or run, there and elsewhere.
    wanted = get_active_backend()[1] if workers is None else workers
    ahead = wanted if wanted is not None and wanted > 0 else "2*n_jobs"
    run = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, pre_dispatch=ahead)
    rows: Iterator[Row] = run(delayed(predict_pair)(method, pairs, i, ids[i], seed) for i in indices)
    return rows


def _one_by_one(
    method: Method | Control, pairs: Sequence[LabelledPair], ids: Sequence[str], indices: list[int], seed: int
) -> Iterator[Row]:
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    for index in indices:
        with ProcessPoolExecutor(max_workers=1) as pool:
            try:
                yield pool.submit(predict_pair, method, pairs, index, ids[index], seed).result()
            except TerminatedWorkerError as error:
                yield Row(index=index, id=ids[index], error=f"the process died: {one_line(error)}")
