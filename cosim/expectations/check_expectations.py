"""Expectations before the run: what they name exists, their windows lie within the run, thresholds are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cosim.components.component import Component
from cosim.errors import CosimError, ScenarioError
from cosim.expectations.before import Before
from plant_models.explained_error import explained

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable


def check_expectations(
    table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str], where: str
) -> ScenarioTable:
    """Check the expectations of a scenario against its components.

    Args:
        table: the scenario. components: by name. receivers: of balise telegrams. where: place for messages.

    Returns:
        The scenario, with the thresholds of indicators that were left to us.

    Raises:
        ScenarioError: a signal, observer or receiver does not exist, a window lies outside the run, or an expectation
        can never
            be judged; one line for each expectation at fault.
    """
    faults, items = [], []
    before = _before(table, components, receivers)
    for place, item in enumerate(table.expect, start=1):
        title = f" ({item.name})" if item.name else ""
        try:
            items.append(_prepared(item, before))
        except CosimError as error:
            faults.append(f"{where}: expect, number {place}{title}, {item.check!r}: {error}")
    if faults:
        raise ScenarioError("\n".join(faults))
    return table.model_copy(update={"expect": items})


def _prepared(item: Any, before: Before) -> Any:
    try:
        prepared = item.prepare(before)
    except CosimError:
        raise
    except Exception as error:  # code of others
        raise CosimError(f"prepare() failed: {explained(error)}") from error
    if not isinstance(prepared, type(item)):
        raise CosimError(f"prepare() returned {type(prepared).__name__}; expected itself or another {item.check!r}.")
    return prepared


def _before(table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str]) -> Before:
    return Before(
        start=table.start,
        stop=table.stop,
        period=table.step * table.master.record_every,
        report=table.report,
        tables=table.components,
        components=components,
        receivers=None if table.balises is None else receivers,
        certificates=table.certificates,
    )
