"""The task of a run: the tables of a scenario, its name, and where it stands. The first value, which all steps take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from cosim.errors import CosimError
from cosim.master.axis import TimeAxis
from cosim.scenario.schema import ScenarioTable, step_count


@dataclass(frozen=True)
class RunTask:
    """What is to be run.

    Args:
        table: validated scenario. name: its name. folder: start of relative paths. where: place for messages.
    """

    table: ScenarioTable
    name: str
    folder: Path
    where: str

    @property
    def axis(self) -> TimeAxis:
        """The communication points."""
        table = self.table
        return TimeAxis(table.start, table.step, step_count(table.start, table.stop, table.step))

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Within this context errors begin with the place of the scenario."""
        try:
            yield
        except CosimError as error:
            raise error if str(error).startswith(self.where) else type(error)(f"{self.where}: {error}") from error

    def with_table(self, table: ScenarioTable) -> RunTask:
        """The same task with other tables.

        Args:
            table: validated scenario, with more in it.
        """
        return replace(self, table=table)
