"""From the table ``[campaign]`` to the settings of every run: units, faults, points, designs. Runs nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from cosim.campaign.conditions import Condition
from cosim.campaign.variables import VariedSettings
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.campaign_table import CampaignTable, VariedTable
from cosim.scenario.override import CASE
from cosim.studies.distributions import Distribution, Entries, Normal, Range, Triangular
from cosim.studies.fault_draws import fault_ranges
from cosim.studies.sampling_plans import variations
from cosim.studies.setting_units import setting_unit
from cosim.studies.sweep import check_parameters
from plant_models.hybrid.units import UnitError, conversion, parse_unit


@dataclass(frozen=True)
class Planned:
    """One run of a campaign as it is planned.

    Args:
        number: of the run, from 0. point: which disturbance, and design: which point of the design, from 0: runs of
            one disturbance are compared in pairs. settings: values by name.
    """

    number: int
    point: int
    design: int
    settings: Mapping[str, Any]


def planned_runs(scenario: RunnableScenario, table: CampaignTable) -> list[Planned]:
    """All runs of a campaign, every design over the same disturbances.

    Args:
        scenario: that is varied. table: its campaign.

    Raises:
        CosimError: something in the table cannot be; the message begins with its key.
    """
    lists = dict(sorted(table.design.items()))
    designs = [dict(zip(lists, row, strict=True)) for row in product(*lists.values())]
    rows = product(enumerate(_points(scenario, table)), enumerate(designs))
    return [
        # what is said by name wins over a case
        Planned(number, p, d, dict(sorted({**point, **design}.items(), key=lambda entry: entry[0] != CASE)))
        for number, ((p, point), (d, design)) in enumerate(rows)
    ]


def _points(scenario: RunnableScenario, table: CampaignTable) -> list[dict[str, Any]]:
    """The disturbances."""
    if table.method != "grid" and table.method != "zip":  # noqa: PLR1714 # so that type checkers follow
        return campaign_variables(scenario, table).draw(table.method, int(table.runs or 0), table.seed)
    ranged = [name for name, stated in table.vary.items() if isinstance(stated, VariedTable)]
    if ranged or table.faults:
        what = f"campaign.vary.{ranged[0]}" if ranged else "campaign.faults"
        raise ScenarioError(f'{what}: is drawn, and method {table.method!r} takes lists; give method = "random".')
    points = variations(dict(sorted(table.vary.items())), table.method, None, 0)
    conditions = [Condition(text, list(table.vary)) for text in table.where]
    met = [point for point in points if all(condition.holds(point) for condition in conditions)]
    if not met:
        raise ScenarioError(f"campaign.where: none of {len(points)} points meets all conditions.")
    return met


def campaign_variables(scenario: RunnableScenario, table: CampaignTable) -> VariedSettings:
    """What varies in a campaign of drawn points.

    Args:
        scenario: that is varied. table: its campaign.

    Raises:
        CosimError: something in the table cannot be; the message begins with its key.
    """
    drawn: dict[str, Distribution] = dict(_faults(scenario, table))
    for name, stated in table.vary.items():
        with_place = f"campaign.vary.{name}"
        try:
            drawn[name] = Entries(stated) if isinstance(stated, list) else _distribution(stated)
        except ScenarioError as error:
            raise ScenarioError(f"{with_place}: {error}") from error
        if isinstance(stated, VariedTable) and stated.unit is not None:
            drawn[name] = _in_own_unit(scenario, name, stated.unit, drawn[name])
    for name in (name for first, second, _ in table.correlate for name in (first, second)):
        if name not in drawn:
            raise ScenarioError(f"campaign.correlate: {name!r} is not varied; {nearest(name, drawn)}")
    return VariedSettings(dict(sorted(drawn.items())), table.correlate, table.where)  # whatever the order in the file


def _faults(scenario: RunnableScenario, table: CampaignTable) -> Iterator[tuple[str, Distribution]]:
    """Parameters of the faults that are drawn."""
    if not table.faults:
        return
    ranges = fault_ranges(scenario)
    owners = {name.partition(".")[0] for name in ranges}
    chosen = owners if table.faults is True else table.faults
    if not owners or (unknown := [name for name in chosen if name not in owners]):
        what = unknown[0] if owners else "true"
        known = nearest(what, owners) if owners else "the scenario has no component with a fault to be drawn"
        raise ScenarioError(f"campaign.faults: {what!r} is no such component; {known}")
    yield from ((name, one) for name, one in ranges.items() if name.partition(".")[0] in chosen)


def _distribution(stated: VariedTable) -> Distribution:
    """The distribution that a table states."""
    kind, values = stated.kind, getattr(stated, stated.kind)
    if kind == "normal":
        ends = {key: value for key in ("low", "high") if (value := getattr(stated, key)) is not None}
        return Normal(*values, **ends)
    if kind == "triangular":
        return Triangular(*values)
    if kind == "choose":
        return Entries(values, stated.weights)
    low, high = values
    return Range(low, high, kind)  # type: ignore[arg-type] # one of the kinds of ranges


def _in_own_unit(scenario: RunnableScenario, name: str, unit: str, drawn: Distribution) -> Distribution:
    """Numbers that are stated in a unit, in the unit of the setting."""
    own = setting_unit(scenario, name)
    try:
        if own is None:
            raise UnitError("the setting has no unit")
        return drawn.scaled(*conversion(parse_unit(unit), parse_unit(own)))
    except (UnitError, TypeError) as error:
        raise ScenarioError(f"campaign.vary.{name}: unit {unit!r} cannot be: {error}.") from error


def check_settings(scenario: RunnableScenario, planned: list[Planned]) -> None:
    """That settings can be: the extreme ones of every name, and each text, in the first run.

    Args:
        scenario: that is varied. planned: its runs.

    Raises:
        CosimError: a name or a value cannot be.
    """
    first = planned[0].settings
    for name in first:
        values = {str(run.settings[name]): run.settings[name] for run in planned}.values()
        numbers = [value for value in values if isinstance(value, int | float)]
        texts = [value for value in values if not isinstance(value, int | float)]
        for value in [*({min(numbers), max(numbers)} if numbers else ()), *texts]:
            try:
                scenario.with_settings({**first, name: value}).table()
            except CosimError as error:
                raise ScenarioError(f"campaign.vary.{name}: {value!r}: {error}") from error
    try:
        check_parameters(scenario.with_settings(first), first)
    except CosimError as error:
        error.args = (f"campaign.vary: {error}", *error.args[1:])
        raise
