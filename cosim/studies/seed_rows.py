"""The rows of a study over seeds as a CSV file, written as they come. Touches that file only."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from cosim.errors import OutputError
from cosim.studies.seed_runs import SeedRow

SEEDS_CSV = "seeds.csv"
COLUMNS = ("seed", "observer", "phase", "speed_error_max", "failure")


@contextmanager
def seed_file(path: Path) -> Iterator[Callable[[SeedRow], None]]:
    """A file with a line for each seed, observer and phase, and one for a seed that failed before the first phase.

    Args:
        path: of the file, which is written anew.

    Yields:
        What takes the row of a seed; it is in the file when it returns.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)

            def add(row: SeedRow) -> None:
                errors = [(*key, repr(error)) for key, error in row.errors.items()] or [("", "", "")]
                writer.writerows((row.seed, *entry, row.failure or "") for entry in errors)
                file.flush()

            yield add
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error
