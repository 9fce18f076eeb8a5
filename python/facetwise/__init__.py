# SPDX-License-Identifier: Apache-2.0
"""facetwise for Python: microfacet normals and reflections, sampled in bulk, here or on servers, with the same bits.

    import facetwise, numpy as np
    engine = facetwise.local()                                  # or facetwise.connect("unix:/tmp/facetwise.sock")
    got = engine.sample_reflection(incident=(x, y, z), alpha_x=0.3, alpha_y=0.3, seed=1)
    got.outgoing, got.pdf, got.weight, got.status               # arrays; got.statistics counts the lanes

Every operation is a method, and takes the library's fields by name (facetwise/batch.h says what they mean, their units and
ranges): `incident` and `outgoing` as three columns or one array (N, 3), `alpha_x`, `alpha_y`, `eta`, `f0`, `u1`, `u2`, `u3`,
`mean_slope_x` ... A column is an array of N values or one number for all lanes. float32 arrays are read where they lie, strided
ones too; what else NumPy can turn into them is copied. Of dask arrays the outputs are dask arrays with the same chunks, whose
bits do not depend on the chunks; engines, models and tables can be sent to dask's workers. `model` has the parts of a model (facetwise/model.h) by name.

It speaks to libfacetwise.so (facetwise.h): of FACETWISE_LIBRARY if that is set, beside this file, or installed.
"""
from __future__ import annotations

import ctypes
import ctypes.util
import os
import pathlib
import sys
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from typing import Callable, Iterable, Mapping, Optional, Sequence, Union

import numpy as np

__all__ = ["Engine", "Error", "Model", "Result", "SlopeTable", "Statistics", "connect", "local", "version"]

Array = np.ndarray
Values = Union[float, Sequence[float], Array]


class Error(Exception):
    """A call that failed: the library's text, which begins with the field's name."""


class Statistics(ctypes.Structure):
    """What became of the lanes of a call."""

    _fields_ = [(name, ctypes.c_uint64) for name in ("accepted", "occluded", "smooth", "invalid")]
    accepted: int
    occluded: int
    smooth: int
    invalid: int

    def __repr__(self) -> str:
        return "Statistics(" + ", ".join(f"{name}={getattr(self, name)}" for name, _ in self._fields_) + ")"


class _Connection(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_char_p) for name in ("tls_ca", "tls_certificate", "tls_key", "tls_name", "token_file")),
                ("compact_answers", ctypes.c_int)]


_DENSITY = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_double, ctypes.c_void_p)


def _load() -> ctypes.CDLL:
    beside = pathlib.Path(__file__).with_name("libfacetwise.so")
    path = os.environ.get("FACETWISE_LIBRARY") or (str(beside) if beside.exists() else ctypes.util.find_library("facetwise"))
    if not path:
        raise ImportError("libfacetwise.so is not installed; FACETWISE_LIBRARY may say where it is")
    library = ctypes.CDLL(path)
    handle, size, text, status = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_int
    for name, result, *arguments in (
            ("fw_version", text), ("fw_error", text),
            ("fw_batch_create", handle, size), ("fw_batch_destroy", None, handle),
            ("fw_set_model", status, handle, text, text), ("fw_set_table", status, handle, handle),
            ("fw_set_input", status, handle, text, handle, size, size), ("fw_set_value", status, handle, text, ctypes.c_float),
            ("fw_set_output", status, handle, text, handle, size), ("fw_set_byte_output", status, handle, text, handle, size),
            ("fw_set_active", status, handle, handle, size),
            ("fw_set_generator", status, handle, ctypes.c_uint64, ctypes.c_uint32, handle, ctypes.c_uint64),
            ("fw_local", handle, text), ("fw_connect", handle, ctypes.POINTER(text), size, ctypes.POINTER(_Connection)),
            ("fw_engine_destroy", None, handle),
            ("fw_run", status, handle, text, handle, ctypes.POINTER(Statistics)),
            ("fw_table_build", handle, _DENSITY, handle, ctypes.c_int), ("fw_table_load", handle, text),
            ("fw_table_save", status, handle, text), ("fw_table_destroy", None, handle),
            ("fw_keep_albedo_table", status, handle, text)):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


_library = _load()


def version() -> str:
    """The library's version, "major.minor.patch"."""
    return _library.fw_version().decode()


def _check(status: int) -> None:
    if status:
        raise Error(_library.fw_error().decode())


def _handle(made: Optional[int]) -> int:
    if not made:
        raise Error(_library.fw_error().decode())
    return made


class SlopeTable:
    """A tabulated distribution of normals, by the density of their slopes."""

    def __init__(self, handle: int):
        self._handle = handle

    @classmethod
    def build(cls, density: Callable[[float, float], float], radial: bool = False) -> "SlopeTable":
        """Of density(x, y) >= 0, of any scale; radial: it depends on x^2 + y^2 only."""
        raised = []

        def guarded(x, y, _):
            try:
                return density(x, y)
            except Exception as error:  # does not cross C
                raised.append(error)
                return 0.0

        made = _library.fw_table_build(_DENSITY(guarded), None, int(radial))
        if raised:
            if made:
                _library.fw_table_destroy(made)
            raise raised[0]
        return cls(_handle(made))

    @classmethod
    def load(cls, path: Union[str, os.PathLike]) -> "SlopeTable":
        """Of a saved table, or of a text of densities."""
        return cls(_handle(_library.fw_table_load(os.fsencode(path))))

    def save(self, path: Union[str, os.PathLike]) -> None:
        _check(_library.fw_table_save(self._handle, os.fsencode(path)))

    def __reduce__(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "table")
            self.save(path)
            return _table_of, (path.read_bytes(),)

    def __del__(self):
        _library.fw_table_destroy(self._handle)


def _table_of(saved: bytes) -> SlopeTable:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "table")
        path.write_bytes(saved)
        return SlopeTable.load(path)


@dataclass(frozen=True)
class Model:
    """What is sampled: the parts of facetwise/model.h by their names. With a table the distribution is the table's."""

    distribution: str = "ggx"
    masking: str = "smith"
    shadowing: str = "correlated"
    normalisation: str = "unbiased"
    interface: str = "conductor"
    transport: str = "radiance"
    compensation: str = "none"
    retro: bool = False
    table: Optional[SlopeTable] = None


class Result:
    """The outputs of a call: arrays by name, directions as (N, 3); and `statistics`."""

    def __init__(self, outputs: Mapping[str, Array], statistics: Statistics):
        self.statistics = statistics
        self._outputs = dict(outputs)

    def __getattr__(self, name: str) -> Array:
        try:
            return self._outputs[name]
        except KeyError:
            raise AttributeError(f"no output {name}; there are {', '.join(self._outputs)}") from None

    def keys(self) -> Iterable[str]:
        return self._outputs.keys()

    def __getitem__(self, name: str) -> Array:
        return self._outputs[name]

    def __repr__(self) -> str:
        return f"Result({', '.join(self._outputs)}; {self.statistics})"


_DIRECTIONS = ("incident", "outgoing", "normal")
# What each operation gives unless `outputs` says otherwise.
_OUTPUTS = {
    "sample_normal": ("normal", "incident_dot_normal", "pdf", "status"),
    "sample_reflection": ("outgoing", "pdf", "weight", "status"),
    "pdf_reflection": ("pdf", "status"),
    "evaluate_reflection": ("value", "status"),
    "masking": ("projected_area", "status"),
    "sample_transmission": ("outgoing", "pdf", "weight", "eta_scale", "status"),
    "evaluate_transmission": ("value", "status"),
    "sample_scattering": ("outgoing", "pdf", "weight", "event", "eta_scale", "status"),
    "evaluate_scattering": ("value", "status"),
    "albedo": ("albedo", "mean_albedo", "status"),
}
_BYTES = ("status", "event")


def _column(values: Values, name: str) -> Union[float, Array]:
    if np.isscalar(values):
        return float(values)  # type: ignore[arg-type]
    array = np.asarray(values, dtype=np.float32)
    if array.ndim == 0:
        return float(array)
    if array.ndim != 1:
        raise ValueError(f"{name}: an array of {array.ndim} dimensions, not of one")
    # The library's strides are not negative, and values lie at multiples of four bytes.
    return array if array.strides[0] > 0 and array.strides[0] % 4 == 0 and array.flags.aligned else array.copy()


def _writes(array: Array) -> bool:
    return array.flags.writeable and (array.size == 0 or array.strides[0] > 0)


def _has_dask_arrays(ids: object, fields: Mapping[str, object]) -> bool:
    module = sys.modules.get("dask.array")
    if module is None:
        return False
    parts = [part for values in fields.values() for part in (values if isinstance(values, (tuple, list)) else (values,))]
    return any(isinstance(part, module.Array) for part in [ids, *parts])


class Engine:
    """The library's calls, on this machine or on servers. Any number of threads may use one: calls let others run."""

    def __init__(self, handle: int, recipe: tuple):
        self._handle = handle
        self._recipe = recipe  # how another process makes its own

    def __reduce__(self):
        return _engine_of, self._recipe

    def __del__(self):
        _library.fw_engine_destroy(self._handle)

    def run(self, operation: str, *, model: Model = Model(), sampler: str = "exact", seed: Optional[int] = None,
            dimension: int = 0, ids: Optional[Array] = None, first_id: int = 0, active: Optional[Array] = None,
            lanes: Optional[int] = None, outputs: Optional[Sequence[str]] = None,
            out: Optional[Mapping[str, Array]] = None, **fields: Values) -> Result:
        """Runs one operation on a batch.

        fields: the columns (see the module). seed, dimension, ids, first_id: random numbers made by the library instead of
        u1, u2, u3; a lane's depend on its id only. active: indices of the lanes that are run; others' outputs stay 0. lanes: how
        many, where all columns are numbers. outputs: names without "out."; out: arrays that are written instead of new ones.
        Raises Error with the field's name where the call makes no sense; bad lanes get a status, no error.
        """
        outputs = _OUTPUTS.get(operation, ()) if outputs is None else outputs
        if _has_dask_arrays(ids, fields):
            from . import dask_arrays
            if active is not None or out is not None:
                raise ValueError("active, out: not with dask arrays")
            return dask_arrays.run(self, operation, fields, model=model, sampler=sampler, seed=seed, dimension=dimension, ids=ids,
                                   first_id=first_id, lanes=lanes, outputs=outputs)
        columns: dict[str, Union[float, Array]] = {}
        for name, values in fields.items():
            if name not in _DIRECTIONS:
                columns[name] = _column(values, name)
                continue
            if isinstance(values, np.ndarray) and values.ndim == 2:
                values = values.T
            if len(values) != 3:  # type: ignore[arg-type]
                raise ValueError(f"{name}: three columns, or an array (N, 3)")
            for axis, part in zip("xyz", values):  # type: ignore[arg-type]
                columns[f"{name}.{axis}"] = _column(part, f"{name}.{axis}")
        lengths = [array.size for array in columns.values() if isinstance(array, np.ndarray)]
        count = lanes if lanes is not None else max(lengths, default=1)

        batch = _handle(_library.fw_batch_create(count))
        try:
            for part in ("masking", "shadowing", "normalisation", "interface", "transport", "compensation"):
                _check(_library.fw_set_model(batch, part.encode(), getattr(model, part).encode()))
            _check(_library.fw_set_model(batch, b"retro", b"true" if model.retro else b"false"))
            _check(_library.fw_set_model(batch, b"sampler", sampler.encode()))
            if model.table is not None:
                _check(_library.fw_set_table(batch, model.table._handle))
            else:
                _check(_library.fw_set_model(batch, b"distribution", model.distribution.encode()))
            for name, column in columns.items():
                if isinstance(column, float):
                    _check(_library.fw_set_value(batch, name.encode(), column))
                else:
                    _check(_library.fw_set_input(batch, name.encode(), column.ctypes.data, column.size, column.strides[0]))
            if seed is not None:
                if ids is not None:
                    ids = np.ascontiguousarray(ids, dtype=np.uint64)
                    if ids.shape != (count,):
                        raise ValueError(f"ids: {ids.shape} for {count} lanes")
                _check(_library.fw_set_generator(batch, seed, dimension, None if ids is None else ids.ctypes.data, first_id))
            if active is not None:
                active = np.ascontiguousarray(active, dtype=np.uint32)
                _check(_library.fw_set_active(batch, active.ctypes.data, active.size))
            made: dict[str, Array] = {}
            for name in outputs:
                made[name] = self._output(batch, name, count, (out or {}).get(name))
            statistics = Statistics()
            _check(_library.fw_run(self._handle, operation.encode(), batch, ctypes.byref(statistics)))
        finally:
            _library.fw_batch_destroy(batch)
        return Result(made, statistics)

    @staticmethod
    def _output(batch: int, name: str, count: int, given: Optional[Array]) -> Array:
        kind = np.uint8 if name in _BYTES else np.float32
        if name in _DIRECTIONS:
            # Columns side by side, seen as (N, 3).
            array = given if given is not None else np.zeros((3, count), np.float32).T
            if array.shape != (count, 3) or array.dtype != np.float32 or not _writes(array):
                raise ValueError(f"{name}: an array ({count}, 3) of float32 is needed")
            for k, axis in enumerate("xyz"):
                part = array[:, k]
                _check(_library.fw_set_output(batch, f"out.{name}.{axis}".encode(), part.ctypes.data, part.strides[0]))
            return array
        array = given if given is not None else np.zeros(count, kind)
        if array.shape != (count,) or array.dtype != kind or not _writes(array):
            raise ValueError(f"{name}: {count} values of {np.dtype(kind)} are needed, which may be written")
        setter = _library.fw_set_byte_output if name in _BYTES else _library.fw_set_output
        _check(setter(batch, f"out.{name}".encode(), array.ctypes.data, array.strides[0]))
        return array


def _method(operation: str):
    def call(self: Engine, **arguments) -> Result:
        return self.run(operation, **arguments)

    call.__name__ = operation
    call.__doc__ = f"run(\"{operation}\", ...); gives {', '.join(_OUTPUTS[operation])} unless `outputs` says otherwise."
    return call


for _operation in _OUTPUTS:
    setattr(Engine, _operation, _method(_operation))


def local(target: Optional[str] = None) -> Engine:
    """This machine's engine. target: an instruction set, "best", "scalar", "avx2", "avx3" or "neon"."""
    return Engine(_handle(_library.fw_local(target.encode() if target else None)), ("local", (), (("target", target),)))


def connect(*addresses: str, tls_ca: Optional[str] = None, tls_certificate: Optional[str] = None,
            tls_key: Optional[str] = None, tls_name: Optional[str] = None, token_file: Optional[str] = None,
            compact_answers: bool = False) -> Engine:
    """Servers', each "unix:PATH" or "HOST:PORT": a batch's lanes are spread over those that are there, and one is enough.
    compact_answers: directions (8e-5 rad off at most) and weights (2^-11) in half their bytes, for networks."""
    encoded = (ctypes.c_char_p * len(addresses))(*(address.encode() for address in addresses))
    options = _Connection(*(None if value is None else os.fsencode(value)
                            for value in (tls_ca, tls_certificate, tls_key, tls_name, token_file)), int(compact_answers))
    recipe = ("connect", addresses, (("tls_ca", tls_ca), ("tls_certificate", tls_certificate), ("tls_key", tls_key),
                                     ("tls_name", tls_name), ("token_file", token_file), ("compact_answers", compact_answers)))
    return Engine(_handle(_library.fw_connect(encoded, len(addresses), ctypes.byref(options))), recipe)


@lru_cache(maxsize=16)
def _engine_of(maker: str, arguments: tuple, options: tuple) -> Engine:
    """For a process that was sent an engine: its own of the same kind, made once."""
    return {"local": local, "connect": connect}[maker](*arguments, **dict(options))
