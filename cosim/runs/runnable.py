"""What a study needs of a scenario. Standard library only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.scenario.schema import ScenarioTable
    from fmus.cli.progress import Progress


class RunnableScenario(Protocol):
    """A scenario that is copied, changed and run; `cosim.Scenario` is one, and its methods say what these do.

    Attributes:
        folder: that relative paths start from. where: file name for messages.
    """

    folder: Path
    where: str

    @property
    def name(self) -> str:
        """Name of the file without its ending, or ``script``."""

    @property
    def cases(self) -> dict[str, dict[str, Any]]:
        """What each case sets."""

    def copy(self) -> Self:
        """An independent copy."""

    def set(self, name: str, value: Any) -> Self:
        """Override one value.

        Args:
            name: of the value. value: what it becomes.
        """

    def with_settings(self, settings: Mapping[str, Any]) -> Self:
        """A copy with many values set.

        Args:
            settings: values by name.
        """

    def table(self) -> ScenarioTable:
        """The validated scenario."""

    def save(self, path: Path) -> Path:
        """Write a scenario file that runs identically.

        Args:
            path: of the file.
        """

    def run(
        self,
        *,
        overrides: Mapping[str, Any] | None = None,
        warn: Callable[[str], None] | None = None,
        progress: Progress = None,
    ) -> Outcome:
        """Run it.

        Args:
            overrides: for this run only. warn: receives what is doubtful. progress: where it is reported.
        """
