"""Loops over rows inside a system's own functions: plain NumPy, or a short function of its own in the generated C.

Traced element by element, a loop of two hundred rows would be written out two hundred times. Here its body is traced
once and called row by row. It knows no systems.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from plant_models.hybrid.arrays import Array

CHUNK = 16  # rows in one function: a longer loop is one of chunks, which a compiler takes in its stride
KEPT = 32  # traced functions, for the other events and functions of the same system
Arrays = tuple[Array, ...]  # each of shape (k,)
Body = Callable[[Arrays, Arrays, Arrays], tuple[Arrays, Arrays]]  # (carry, row, shared) -> carry, result


def enclosed(function: Callable[..., Arrays], *arrays: Array) -> Arrays:
    """A call that stays a call where it is traced: the function becomes one of its own in the generated C.

    On numbers it is ``function(*arrays)``. Traced, the function sees symbols of whole arrays, for which slices,
    arithmetic and `scan` are one operation each; what is done with single elements belongs into the body of a scan.

    Args:
        function: plain NumPy of the arrays alone. arrays: shape (n,) each.

    Returns:
        What the function returns, arrays of shape (k,).
    """
    if not _is_symbol("SX", arrays):
        return function(*arrays)
    ca = sys.modules["casadi"]
    called = _enclosed(function, tuple(array.shape[0] for array in arrays))
    values = called.call([ca.densify(ca.SX(array)) for array in arrays])
    return tuple(ca.ArrayInterface.SX(value, shape=(value.numel(),)) for value in values)


@lru_cache(maxsize=KEPT)
def _enclosed(function: Callable[..., Arrays], sizes: tuple[int, ...]) -> Any:
    """The function among symbols of whole arrays; the same object for the same function, so that C has it once."""
    ca = sys.modules["casadi"]
    symbols = [ca.MX.sym(f"a{i}", size) for i, size in enumerate(sizes)]
    results = function(*(ca.ArrayInterface.MX(s, shape=(s.numel(),)) for s in symbols))
    columns = [ca.densify(ca.MX(result)) for result in results]
    return ca.Function("enclosed", symbols, columns, {"never_inline": True})


def scan(
    body: Body, carry: Arrays, rows: Sequence[Arrays], shared: Arrays = (), *, backwards: bool = False
) -> tuple[Arrays, list[Arrays]]:
    """A loop over rows that hands values on from row to row; inside `enclosed` its body is traced once.

    Args:
        body: plain NumPy without branching on values, of its three arguments alone: what the row before handed on,
            shape (c,) each; the row, shape (m,) each; and what all rows share. It returns what it hands on, and the
            results of the row, shape (l,) each.
        carry: what the first row gets. rows: each of arrays of the same shapes. shared: known to all rows.
        backwards: whether the last row comes first.

    Returns:
        What the last row of the loop hands on, and the results in the order of the rows.
    """
    tables = tuple(np.stack(column) for column in zip(*rows, strict=True))
    last, found = scan_table(body, carry, tables, shared, backwards=backwards)
    return last, [tuple(table[i] for table in found) for i in range(len(rows))]


def scan_table(
    body: Body, carry: Arrays, tables: Arrays, shared: Arrays = (), *, backwards: bool = False
) -> tuple[Arrays, Arrays]:
    """`scan` over the rows of tables, with tables as results.

    Args:
        body, carry, shared, backwards: see `scan`. tables: shape (N, m) each, a row is one of each.

    Returns:
        What the last row of the loop hands on, and the results in the order of the rows, shape (N, l) each.
    """
    if _is_symbol("MX", (*carry, *tables, *shared)):
        return _called(body, carry, tables, shared, backwards)
    results: list[Arrays] = []
    places = range(tables[0].shape[0])
    for i in reversed(places) if backwards else places:
        carry, result = body(carry, tuple(table[i] for table in tables), shared)
        results.append(result)
    ordered = results[::-1] if backwards else results
    return carry, tuple(np.stack(column) for column in zip(*ordered, strict=True))


def _called(body: Body, carry: Arrays, rows: Arrays, shared: Arrays, backwards: bool) -> tuple[Arrays, Arrays]:
    """The loop among symbols of whole arrays."""
    ca = sys.modules["casadi"]
    widths = tuple(tuple(array.shape[-1] for array in group) for group in (carry, rows, shared))
    loop = _loop(body, widths, rows[0].shape[0], backwards)
    tables = [ca.MX(table).T for table in rows]
    values = loop.call([*map(ca.MX, carry), *tables, *map(ca.MX, shared)])
    symbolic: Any = ca.ArrayInterface.MX
    last = tuple(symbolic(value, shape=(value.numel(),)) for value in values[: len(carry)])
    return last, tuple(symbolic(value.T, shape=value.T.shape) for value in values[len(carry) :])


@lru_cache(maxsize=KEPT)
def _row(body: Body, widths: tuple[tuple[int, ...], ...]) -> Any:
    """The body as one function of single elements, the same object for the same body."""
    ca = sys.modules["casadi"]
    symbols = [[ca.SX.sym(f"a{i}", width) for i, width in enumerate(group)] for group in widths]
    arrays = [tuple(ca.ArrayInterface.SX(s, shape=(s.numel(),)) for s in group) for group in symbols]
    handed, result = body(arrays[0], arrays[1], arrays[2])
    columns = ca.cse([ca.densify(ca.SX(array)) for array in (*handed, *result)])
    return ca.Function("row", [s for group in symbols for s in group], columns)


@lru_cache(maxsize=KEPT)
def _loop(body: Body, widths: tuple[tuple[int, ...], ...], count: int, backwards: bool) -> Any:
    """A function of `count` rows, one a column: of calls of `CHUNK` rows where there are more."""
    ca = sys.modules["casadi"]
    row, chunk = _row(body, widths), CHUNK if count > CHUNK else 1
    whole, rest = divmod(count, chunk)
    inner = row if chunk == 1 else _loop(body, widths, chunk, backwards)
    calls = [inner] * whole + ([_loop(body, widths, rest, backwards)] if rest else [])
    carried, tables = len(widths[0]), slice(len(widths[0]), len(widths[0]) + len(widths[1]))
    sizes = [row.size1_in(i) for i in range(row.n_in())]
    columns = [count if tables.start <= i < tables.stop else 1 for i in range(row.n_in())]
    symbols = [ca.MX.sym(f"a{i}", *shape) for i, shape in enumerate(zip(sizes, columns, strict=True))]
    ends = [*range(0, whole * chunk + 1, chunk), *([count] if rest else [])]
    pieces = [ca.horzsplit(table, ends) for table in symbols[tables]]
    carry, shared, found = symbols[:carried], symbols[tables.stop :], []
    for i in reversed(range(len(calls))) if backwards else range(len(calls)):
        values = calls[i].call([*carry, *(piece[i] for piece in pieces), *shared])
        carry = values[:carried]
        found.append(values[carried:])
    ordered = found[::-1] if backwards else found
    results = [ca.horzcat(*column) for column in zip(*ordered, strict=True)]
    return ca.Function(f"rows_{count}", symbols, [*carry, *results])


def _is_symbol(kind: str, arrays: Arrays) -> bool:
    """Whether one of the arrays is traced, as single elements (``SX``) or as a whole (``MX``)."""
    ca = sys.modules.get("casadi")
    if ca is None:
        return False
    symbolic = [array.to_casadi() for array in arrays if isinstance(array, ca.ArrayInterface)]
    return any(isinstance(array, getattr(ca, kind)) for array in symbolic)
