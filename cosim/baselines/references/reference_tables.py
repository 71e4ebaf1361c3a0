"""Tables of an FMU's own variables, in its own units, and those of a run: named by component and in SI. No files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cosim.components.component import Component
from cosim.results.result import Result, SignalInfo
from cosim.results.si import in_si
from cosim.results.table_layout import table_dtype
from plant_models.hybrid.units import Unit

REALS = ("Real", "Float64", "Float32")


def prefix(component: str) -> str:
    """What stands before the name of a variable in a table of a run.

    Args:
        component: name of the component.
    """
    return f"{component}."


def as_of_a_run(result: Result, component: Component) -> Result:
    """A table of the FMU's variables as a run would give it: named by component, in SI, with what the FMU says of
    them.

    Args:
        result: the table, in the units of the FMU.
        component: the component of the FMU.
    """
    names = [info.name for info in result.signals]
    table = np.empty(len(result.table), table_dtype(["time", *(prefix(component.name) + name for name in names)]))
    table["time"] = result.time
    for name in names:
        table[prefix(component.name) + name] = result.table[name]
    table, signals = in_si(
        table, [_info(info, component) for info in result.signals], lambda name: _unit(name, component)
    )
    return replace(result, table=table, signals=signals)


def in_units_of(result: Result, component: Component) -> Result:
    """A table of a run in the units of the FMU's variables; names stay.

    Args:
        result: the table of a run, in SI.
        component: the component of the FMU.
    """
    table = np.array(result.table)
    for info in result.signals:
        unit = _unit(info.name, component)
        if unit is not None and (unit.factor, unit.offset) != (1.0, 0.0):
            table[info.name] = (table[info.name] - unit.offset) / unit.factor
    return replace(result, table=table)


def _unit(name: str, component: Component) -> Unit | None:
    short = name.removeprefix(prefix(component.name))
    return component.unit(short) if short in component.variables else None


def _info(info: SignalInfo, component: Component) -> SignalInfo:
    whole = prefix(component.name) + info.name
    if info.name not in component.variables:
        return replace(info, name=whole)
    variable = component.variables[info.name]
    held = variable.variability not in ("continuous", None) or variable.type not in REALS
    unit = component.unit_name(info.name) or info.unit
    return SignalInfo(whole, unit, None, "discrete" if held else "continuous", variable.description or "")
