"""A linearisation: the matrices at a point with the names and units that belong to them, and what they show. Touches no
FMU.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from cosim.errors import OutputError, nearest
from cosim.fmu_model.sealed import FmuModelError
from fmu_observer.observability.measured_system import MeasuredSystem
from fmu_observer.observability.modes import Mode, unobservable_modes
from fmus.tables.numbers import number
from fmus.tables.table import Column, Parts, Readable, Table, name_column, text_column

Array = NDArray[np.float64]
Method = Literal["exact Jacobians", "directional derivatives", "central differences"]
_POLE_COLUMNS = (name_column("eigenvalue", "eigenvalue"), Column("time_constant", "time constant"))
_RANK_TOLERANCE = 1e-7
"""For modes that are not seen or not reached, relative: differences lose half of the digits."""


@dataclass(frozen=True, eq=False)
class Linearisation(Readable):
    """``d dx = A dx + B du``, ``dy = C dx + D du`` about a point, or the same from one step to the next.

    Attributes:
        name: of the model. A, B, C, D: matrices of shape (n, n), (n, m), (q, n), (q, m).
        states, inputs, outputs: names. units: by name.
        t: instant [s]. x: states there, shape (n,). u: inputs, shape (m,). y: outputs, shape (q,).
        rates: derivatives of the states there, shape (n,); of a sampled one the states a step later.
        step: length of the step [s]; 0 for a continuous one.
        method: how the derivatives were had. remarks: what to know of them.
    """

    name: str
    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    t: float
    x: Array
    u: Array
    y: Array
    rates: Array
    step: float
    method: Method
    remarks: tuple[str, ...] = ()

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A, the slowest first: [1/s], or factors by step."""
        found = np.linalg.eigvals(self.A).astype(complex)
        return found[np.argsort(-(np.abs(found) if self.step else found.real))]

    def part(self, inputs: Sequence[str] | None, outputs: Sequence[str] | None) -> Linearisation:
        """The same for some inputs and outputs.

        Args:
            inputs: names; None for all. outputs: names; None for all.

        Raises:
            FmuModelError: there is no such input or output.
        """
        u, y = _places(self, "inputs", inputs), _places(self, "outputs", outputs)
        return replace(
            self,
            B=self.B[:, u],
            C=self.C[y],
            D=self.D[np.ix_(y, u)],
            inputs=tuple(self.inputs[i] for i in u),
            outputs=tuple(self.outputs[i] for i in y),
            u=self.u[u],
            y=self.y[y],
        )

    def unobservable(self) -> list[Mode]:
        """Modes that no output shows."""
        return unobservable_modes(self._measured(self.A, self.C), _RANK_TOLERANCE)

    def uncontrollable(self) -> list[Mode]:
        """Modes that no input reaches: those that the mirrored system does not show."""
        return unobservable_modes(self._measured(self.A.T, self.B.T), _RANK_TOLERANCE)

    def _measured(self, A: Array, C: Array) -> MeasuredSystem:
        """The pair in coordinates of like size, with rows of C of length one."""
        balanced, (sizes, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
        rows = C * sizes
        lengths = np.linalg.norm(rows, axis=1)
        seen = rows[lengths > 0.0] / lengths[lengths > 0.0, None]
        nothing = np.zeros((1, len(A)))
        measured = seen if len(seen) else nothing
        return MeasuredSystem(balanced, measured, states=self.states, name=self.name, step=self.step)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data, eigenvalues as pairs of real and imaginary part."""
        matrices = {key: getattr(self, key).tolist() for key in "ABCD"}
        names = {key: list(getattr(self, key)) for key in ("states", "inputs", "outputs")}
        point = {key: getattr(self, key).tolist() for key in ("x", "u", "y", "rates")}
        rest = {"name": self.name, "t": self.t, "step": self.step, "method": self.method}
        pairs = [[float(v.real), float(v.imag)] for v in self.eigenvalues]
        more = {"units": dict(self.units), "eigenvalues": pairs, "remarks": list(self.remarks)}
        return rest | names | matrices | point | more

    def save(self, path: str | Path) -> Path:
        """Write the matrices with names, units and the point.

        Args:
            path: of the file; its ending says how: ``.json``, ``.npz`` or ``.mat``.

        Returns:
            The path.

        Raises:
            OutputError: another ending, or the file cannot be written.
        """
        path = Path(path)
        if path.suffix not in _WRITERS:
            raise OutputError(f"{path}: unknown ending {path.suffix!r}; expected one of: {', '.join(_WRITERS)}.")
        try:
            _WRITERS[path.suffix](self, path)
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error
        return path

    def parts(self) -> Parts:
        """The linearisation for people: the point, the matrices, eigenvalues with time constants, and modes that are
        not seen or not reached.
        """
        kind = f"from one step of {number(self.step)} s to the next" if self.step else "in continuous time"
        modes = [
            *self._sentence("no output shows", self.unobservable(), "Observable"),
            *self._sentence("no input reaches", self.uncontrollable(), "Controllable"),
        ]
        return [
            f"{self.name} at t = {number(self.t, 6)} s, {kind}, by {self.method}",
            self._point(),
            *self._matrices(),
            Table("poles", _POLE_COLUMNS, [self._pole(value) for value in self.eigenvalues]),
            "\n".join([*modes, *(f"- {remark}" for remark in self.remarks)]),
        ]

    def _matrices(self) -> list[Table]:
        """Those that have rows and columns, with the names of these."""
        shapes = {"A": (self.states, self.states), "B": (self.states, self.inputs)}
        shapes |= {"C": (self.outputs, self.states), "D": (self.outputs, self.inputs)}
        return [
            Table(
                f"matrix {key}",
                [name_column("name", key), *(Column(name, name, digits=5) for name in columns)],
                [[name, *map(float, row)] for name, row in zip(rows, getattr(self, key), strict=True)],
            )
            for key, (rows, columns) in shapes.items()
            if rows and columns
        ]

    def _point(self) -> Table:
        """States with their rates, inputs and outputs."""
        after = Column("rate", "a step later" if self.step else "rate", write=_or_nothing)
        columns = [name_column("point", "point"), name_column("name", "name"), Column("value", "value", digits=6)]
        points = (("state", self.states, self.x), ("input", self.inputs, self.u), ("output", self.outputs, self.y))
        rates = {("state", name): float(rate) for name, rate in zip(self.states, self.rates, strict=True)}
        rows = [
            [what, name, float(value), self.units.get(name, "1"), rates.get((what, name))]
            for what, names, values in points
            for name, value in zip(names, values, strict=True)
        ]
        return Table("point", [*columns, text_column("unit", "unit"), after], rows)

    def _pole(self, value: complex) -> list[str]:
        """Eigenvalue and time constant as text."""
        text = number(value.real, 5) + (
            f" {'+' if value.imag > 0 else '-'} {number(abs(value.imag), 5)}i" if value.imag else ""
        )
        rate = (np.log(abs(value)) / self.step if abs(value) > 0.0 else -np.inf) if self.step else value.real
        small = 1e-9 * max(1.0, float(np.abs(self.A).max(initial=0.0)))
        if abs(rate) <= small:
            return [text, "does not decay"]
        return [text, f"{number(1.0 / abs(rate), 4)} s{'' if rate < 0.0 else ', grows'}"]

    def _sentence(self, what: str, modes: list[Mode], otherwise: str) -> list[str]:
        if not self.states:
            return []
        if not modes:
            return [f"{otherwise}: every mode is."]
        return [f"{len(modes)} of {len(self.states)} modes {what}:", *(f"- {mode.explain()}" for mode in modes)]


def _or_nothing(rate: float | None) -> str:
    return "" if rate is None else number(rate, 5)


def _places(found: Linearisation, what: str, names: Sequence[str] | None) -> list[int]:
    own: tuple[str, ...] = getattr(found, what)
    for name in names or ():
        if name not in own:
            raise FmuModelError(f"{found.name}: no {what[:-1]} {name!r}; {nearest(name, own)}")
    return [own.index(name) for name in (own if names is None else names)]


def _write_json(found: Linearisation, path: Path) -> None:
    path.write_text(json.dumps(found.to_dict(), indent=1), encoding="utf-8")


def _write_npz(found: Linearisation, path: Path) -> None:
    with path.open("wb") as file:
        np.savez(file, **_arrays(found))


def _write_mat(found: Linearisation, path: Path) -> None:
    with path.open("wb") as file:
        scipy.io.savemat(file, _arrays(found))


def _arrays(found: Linearisation) -> dict[str, Any]:
    """What array files hold: matrices, the point, names and units."""
    numbers = {key: getattr(found, key) for key in ("A", "B", "C", "D", "x", "u", "y", "t", "step")}
    names = {key: np.array(getattr(found, key), dtype=str) for key in ("states", "inputs", "outputs")}
    units = {
        f"{key}_units": np.array([found.units.get(n, "1") for n in getattr(found, key)], dtype=str) for key in names
    }
    return numbers | names | units


_WRITERS: dict[str, Callable[[Linearisation, Path], None]] = {
    ".json": _write_json,
    ".npz": _write_npz,
    ".mat": _write_mat,
}
"""How a linearisation is written, by the ending of the file."""
