# SPDX-License-Identifier: Apache-2.0
"""Batches of dask arrays: each chunk of lanes is a call of its own, made wherever dask runs it.

Engine.run() comes here when a column is a dask array. A lane's random numbers depend on its id, which is its place in the whole
array unless `ids` says otherwise, so chunks of any length give the same bits.
"""
from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence

import dask
import dask.array as da
import numpy as np

import facetwise


class ChunkedResult(facetwise.Result):
    """A Result whose arrays and statistics are made when dask is asked for them."""

    def compute(self, **options: Any) -> facetwise.Result:
        """All of it, in one run of dask; options as of dask.compute()."""
        statistics, *arrays = dask.compute(self.statistics, *self._outputs.values(), **options)
        return facetwise.Result(dict(zip(self._outputs, arrays)), statistics)


def _of_lanes(values: Any, name: str, parts: bool) -> da.Array:
    """As a dask array of N lanes, or, of directions, (N, 3) in chunks of lanes."""
    array = values if isinstance(values, da.Array) else da.asarray(values)
    if array.ndim == 2 and parts:
        array = array.rechunk({1: -1})
    elif array.ndim != 1:
        raise ValueError(f"{name}: an array of {array.ndim} dimensions")
    if any(np.isnan(length) for length in array.chunks[0]):
        raise ValueError(f"{name}: chunks of unknown length; its compute_chunk_sizes() finds them")
    return array


def _run_chunk(engine: facetwise.Engine, operation: str, numbers: Mapping[str, Any], names: Sequence[tuple], outputs, *blocks):
    columns: dict[str, Any] = dict(numbers)
    for (name, part), block in zip(names, blocks):
        if part is None:
            columns[name] = block
        else:
            columns.setdefault(name, [None] * 3)
            columns[name] = [block if k == part else column for k, column in enumerate(columns[name])]
    got = engine.run(operation, outputs=outputs, **columns)
    counts = tuple(getattr(got.statistics, name) for name, _ in facetwise.Statistics._fields_)
    return {**{name: got[name] for name in outputs}, "statistics": counts}


def _total(counts: Sequence[tuple]) -> facetwise.Statistics:
    return facetwise.Statistics(*(sum(column) for column in zip(*counts)))


def run(engine: facetwise.Engine, operation: str, fields: Mapping[str, Any], *, model: facetwise.Model, outputs: Sequence[str],
        ids: Optional[Any], first_id: int, lanes: Optional[int], **options: Any) -> ChunkedResult:
    """What Engine.run() says, lazily."""
    # Names of the arrays among the fields, with the part of a direction that is given as three columns.
    names: list[tuple] = []
    arrays: list[da.Array] = []
    numbers: dict[str, Any] = dict(options)
    for name, values in {**fields, **({} if ids is None else {"ids": ids})}.items():
        if name in facetwise._DIRECTIONS and getattr(values, "ndim", 1) != 2:
            for part, column in enumerate(values):
                if np.ndim(column) == 0:
                    numbers.setdefault(name, [None] * 3)[part] = column
                else:
                    names.append((name, part))
                    arrays.append(_of_lanes(column, f"{name}.{'xyz'[part]}", False))
        elif np.ndim(values) == 0:
            numbers[name] = values
        else:
            names.append((name, None))
            arrays.append(_of_lanes(values, name, name in facetwise._DIRECTIONS))
    count = arrays[0].shape[0] if lanes is None else lanes
    for (name, _), array in zip(names, arrays):
        if array.shape[0] != count:
            raise facetwise.Error(f"{name}: {array.shape[0]} values for {count} lanes")
    chunks, arrays = da.core.unify_chunks(*(item for array in arrays for item in (array, "ij"[:array.ndim])))
    blocks = [array.to_delayed().ravel() for array in arrays]

    call = dask.delayed(_run_chunk, name=f"facetwise.{operation}", pure=False)
    shared = dask.delayed(model) if model.table is not None else model
    begin, tasks = 0, []
    for k, length in enumerate(chunks["i"]):
        own = {**numbers, "lanes": length, "model": shared}
        if ids is None:
            own["first_id"] = first_id + begin
        tasks.append(call(engine, operation, own, names, tuple(outputs), *(block[k] for block in blocks)))
        begin += length

    def column(name: str) -> da.Array:
        kind = np.uint8 if name in facetwise._BYTES else np.float32
        rest = (3,) if name in facetwise._DIRECTIONS else ()
        return da.concatenate([da.from_delayed(task[name], (length, *rest), kind)
                               for task, length in zip(tasks, chunks["i"])])

    statistics = dask.delayed(_total)([task["statistics"] for task in tasks])
    return ChunkedResult({name: column(name) for name in outputs}, statistics)
