"""What the standard deviations of a filter are in SI where its FMU has other units. Reads descriptions only."""

from __future__ import annotations

from cosim.components.described import DescribedComponent
from cosim.fmu_filter.settings import FilterTable
from cosim.results.si import NAMED

_BY_NAME = ("measurements", "process_noise", "input_noise", "start_deviation")


def taken_as(table: FilterTable, fmu: DescribedComponent) -> list[str]:
    """A note of the deviations of variables that the FMU has in another unit than SI; empty where there are none.

    Args:
        table: of the filter. fmu: its FMU.
    """
    found = [
        f"{key}.{name} = {words}"
        for key in _BY_NAME
        for name, value in getattr(table, key).items()
        if (words := _in_si(fmu, name, value)) is not None
    ]
    own = "filter: standard deviations are in the FMU's own units, results in SI"
    return [f"{fmu.name}: {own}; taken as {', '.join(found)}."] if found else []


def _in_si(fmu: DescribedComponent, name: str, value: float) -> str | None:
    """A deviation in the unit of its variable and in SI; None where these are one, or none is known."""
    named = fmu.named_unit(name) if name in fmu.variables else None
    if named is None or named.unit is None or named.unit.factor == 1.0:
        return None
    si = NAMED.get(named.unit.exponents, "in SI units")
    return f"{value:g} {named.name} ({abs(named.unit.factor) * value:.3g} {si})"
