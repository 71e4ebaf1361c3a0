"""Code that a results folder names and that was never run here: whoever made the folder may be somebody else.

Reads files, runs none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.machinery import all_suffixes
from pathlib import Path
from typing import Any

from cosim.errors import UntrustedError
from cosim.run.results_manifest import MADE_FROM, MANIFEST
from plant_models.code_trust import remember, strangers
from plant_models.local_files import local_files
from plant_models.user_file import names_a_file, split_name


def is_of_results(scenario: Path) -> bool:
    """Whether a scenario file is what a results folder was made from.

    Args:
        scenario: its path.
    """
    folder = scenario.resolve().parent
    return folder.name == MADE_FROM and (folder / MANIFEST).is_file()


def demand_trust(scenario: Path, data: Any, trust: bool) -> None:
    """Refuse a scenario of results that names code which was never run here.

    Args:
        scenario: its file. data: its tables. trust: whether that code may be run, which is noted.

    Raises:
        UntrustedError: there is such code, and nobody trusts it.
    """
    files = strangers(dict.fromkeys(_code(data, scenario.resolve().parent)))
    if trust:
        remember(files)
    elif files:
        error = UntrustedError(
            f"{scenario} names code that was never run here: {', '.join(map(str, files))}. Who runs it trusts whoever "
            "wrote it: --trust (trust=True in a script)."
        )
        error.files = tuple(files)
        raise error


def _code(data: Any, folder: Path) -> Iterator[Path]:
    """Files of Python with what lies beside them for an import, and FMUs, that tables name anywhere."""
    for text in _texts(data):
        if names_a_file(text):
            path = folder / split_name(text)[0]
            yield path
            yield from local_files(path).values() if path.is_file() else ()
            if path.resolve().is_relative_to(folder):  # what a compiled module beside it hides
                beside = path.parent.rglob("*")
                yield from sorted(file for file in beside if file.name.endswith(tuple(all_suffixes())))
        elif text.lower().endswith(".fmu"):
            yield folder / text


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    entries: Iterable[Any] = data.values() if isinstance(data, dict) else data if isinstance(data, list | tuple) else ()
    for entry in entries:
        yield from _texts(entry)
