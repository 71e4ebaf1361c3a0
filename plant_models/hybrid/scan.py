"""Loops over rows inside a system's own functions: plain NumPy, or a short function of its own in the generated C.

Traced element by element, a loop of two hundred rows would be written out two hundred times. Here its body is traced
once and called row by row. It knows no systems.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from plant_models.hybrid.system import Array

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
    symbols = [ca.MX.sym(f"a{i}", array.shape[0]) for i, array in enumerate(arrays)]
    results = function(*(ca.ArrayInterface.MX(s, shape=(s.numel(),)) for s in symbols))
    columns = [ca.densify(ca.MX(result)) for result in results]
    called = ca.Function("enclosed", symbols, columns, {"never_inline": True})
    values = called.call([ca.densify(ca.SX(array)) for array in arrays])
    return tuple(ca.ArrayInterface.SX(value, shape=(value.numel(),)) for value in values)


def scan(
    body: Body, carry: Arrays, rows: Sequence[Arrays], shared: Arrays = (), *, backwards: bool = False
) -> tuple[Arrays, list[Arrays]]:
    """A loop over rows that hands values on from row to row; inside `enclosed` its body is traced once.

    Args:
        body: plain NumPy without branching on values, of its three arguments alone: what the row before handed on, the
            row, and what all rows share. It returns what it hands on, and the result of the row.
        carry: what the first row gets. rows: each of arrays of the same shapes. shared: known to all.
        backwards: whether the last row comes first.

    Returns:
        What the last row of the loop hands on, and the results in the order of the rows.
    """
    step = _traced(body, carry, rows[0], shared) if _is_symbol("MX", (*carry, *rows[0], *shared)) else body
    results: list[Arrays] = []
    for row in reversed(rows) if backwards else rows:
        carry, result = step(carry, row, shared)
        results.append(result)
    return carry, results[::-1] if backwards else results


def _traced(body: Body, *groups: Arrays) -> Body:
    """The body as one function that is called in every row."""
    ca = sys.modules["casadi"]
    counts = [len(group) for group in groups]
    symbols = [ca.SX.sym(f"a{i}", array.shape[0]) for i, array in enumerate(a for group in groups for a in group)]
    handed, result = body(*_grouped([ca.ArrayInterface.SX(s, shape=(s.numel(),)) for s in symbols], counts))
    columns = ca.cse([ca.densify(ca.SX(array)) for array in (*handed, *result)])
    function = ca.Function("row", symbols, columns)
    symbolic: Any = ca.ArrayInterface.MX

    def called(*of_row: Arrays) -> tuple[Arrays, Arrays]:
        values = function.call([ca.MX(array) for group in of_row for array in group])
        first, second = _grouped([symbolic(v, shape=(v.numel(),)) for v in values], [len(handed), len(result)])
        return first, second

    return called


def _grouped(arrays: list[Array], counts: Sequence[int]) -> list[Arrays]:
    groups = []
    for count in counts:
        groups.append(tuple(arrays[:count]))
        arrays = arrays[count:]
    return groups


def _is_symbol(kind: str, arrays: Arrays) -> bool:
    """Whether one of the arrays is traced, as single elements (``SX``) or as a whole (``MX``)."""
    ca = sys.modules.get("casadi")
    if ca is None:
        return False
    symbolic = [array.to_casadi() for array in arrays if isinstance(array, ca.ArrayInterface)]
    return any(isinstance(array, getattr(ca, kind)) for array in symbolic)
