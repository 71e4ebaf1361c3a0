"""Values by name: reading and writing scalars and elements of an instance's variables, whole arrays and signs included.

FMI reads and writes whole variables. Where only some elements of an array are asked for, the others are read and left
alone; where the slave holds a variable with the other sign (a negated alias of FMI 1.0), the sign is turned on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from fmpy.model_description import ModelVariable

from fmus.fmi.described import Described
from fmus.fmi.elements import Element, layout
from fmus.fmi.exact_ports import Values, make_exact_reader, make_exact_writer
from fmus.fmi.ports import make_port

Turn = Callable[[np.ndarray, np.ndarray], None]


def element_reader(instance: Described, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
    """A call that reads scalars and elements into `values`, shape (len(names),).

    Args:
        instance: instantiated.
    """
    spread, turn = layout([instance.variables.element(n) for n in names]), signs(instance, names)
    whole = values if spread.is_whole else np.zeros(spread.total)
    read = make_port(instance.slave, instance.fmi_version, "Get", spread.variables, whole)
    if whole is values and turn is None:
        return read

    def read_and_pick() -> None:
        read()
        if whole is not values:
            whole.take(spread.positions, out=values, mode="clip")
        if turn is not None:
            turn(values, values)

    return read_and_pick


def element_writer(
    instance: Described, names: Sequence[str], values: np.ndarray | None = None
) -> tuple[Callable[[], None], np.ndarray]:
    """A call that writes scalars and elements, and the array of shape (len(names),) it writes from.

    Args:
        instance: instantiated. values: that array, contiguous; None for one of its own.
    """
    spread, turn = layout([instance.variables.element(n) for n in names]), signs(instance, names)
    slave, version, buffer = instance.slave, instance.fmi_version, np.zeros(len(names)) if values is None else values
    if spread.is_whole and turn is None:
        return make_port(slave, version, "Set", spread.variables, buffer), buffer
    whole, signed = np.zeros(spread.total), np.zeros(len(names))
    write = make_port(slave, version, "Set", spread.variables, whole)
    keep = make_port(slave, version, "Get", spread.variables, whole) if spread.is_partial else None

    def place_and_write() -> None:
        if keep is not None:
            keep()
        if turn is not None:
            turn(buffer, signed)
        whole[spread.positions] = buffer if turn is None else signed
        write()

    return place_and_write, buffer


def exact_reader(instance: Described, variable: ModelVariable) -> Callable[[], Values]:
    """A call that returns the values of a whole variable as they are.

    Args:
        instance: instantiated.
    """
    read = make_exact_reader(instance.slave, instance.fmi_version, variable)
    if variable.name not in instance.negated:
        return read
    return lambda: tuple(negative(variable, value) for value in read())


def exact_writer(instance: Described, variable: ModelVariable) -> Callable[[Sequence[Any]], None]:
    """A call that writes the values of a whole variable as they are.

    Args:
        instance: instantiated.
    """
    write = make_exact_writer(instance.slave, instance.fmi_version, variable)
    if variable.name not in instance.negated:
        return write
    return lambda values: write([negative(variable, value) for value in values])


def write_start(instance: Described, variable: ModelVariable, element: Element | None, values: list[Any]) -> None:
    """Write a whole variable, or one element of it, once.

    Args:
        instance: whose variable it is.
        variable: what is written.
        element: the element; None for the whole variable.
        values: of the variable or the element.
    """
    if element is not None and element.index is not None:
        everything = list(exact_reader(instance, variable)())
        everything[element.index] = values[0]
        values = everything
    exact_writer(instance, variable)(values)


def signs(instance: Described, names: Sequence[str]) -> Turn | None:
    """What turns values as the slave holds them into those of the variables and back, or None where nothing is negated.

    The call takes source and target, both of shape (len(names),), which may be the same array.

    Args:
        instance: whose variables they are.
    """
    if not any(name in instance.negated for name in names):
        return None
    held_negative = np.array([name in instance.negated for name in names])
    truths = np.array([instance.variables[name].type == "Boolean" for name in names])
    factor, offset = np.where(held_negative, -1.0, 1.0), np.where(held_negative & truths, 1.0, 0.0)

    def turn(source: np.ndarray, target: np.ndarray) -> None:
        np.multiply(source, factor, out=target)
        np.add(target, offset, out=target)

    return turn


def negative(variable: ModelVariable, value: Any) -> Any:
    """A value with the other sign; of a truth value the opposite.

    Args:
        variable: in the model description.
    """
    return not value if variable.type == "Boolean" else -value
