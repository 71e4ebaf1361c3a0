"""From a run that is set up to a results folder that grows with it and says at once what it is made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from cosim.errors import OutputError
from cosim.results.results_folder import check_writable
from cosim.run.made_from import renewed

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.scenario.origin import Origin


class Streaming(NamedTuple):
    """What a run needs to stream.

    Attributes:
        folder: to stream to. begun: called once this has begun: nothing of a former run is in the folder then.
        spare: the results do not need it; where it cannot be made the run goes on in memory.
    """

    folder: Path
    begun: Callable[[], None]
    spare: bool = False


def _streaming_to(directory: str | Path, origin: Origin) -> Streaming:
    """What a run needs to stream; the folder is made and nothing in it changed yet."""

    def begun() -> None:
        with renewed(directory, origin) as seal:
            seal({}, {})

    return Streaming(check_writable(directory), begun)


def where_to(
    stream: str | Path | None, fallback: str | Path | None, origin: Origin
) -> tuple[Path | None, Streaming | None]:
    """The results folder that a run streams to, and what it needs to stream to that or to the spare one.

    Args:
        stream: results folder; None for none. fallback: folder for rows in case the process dies; None for none.
        origin: of the run.

    Raises:
        OutputError: the folder cannot be written.
    """
    if stream is not None:
        folder = Path(stream).absolute()  # an FMU may change the working directory
        return folder, _streaming_to(folder, origin)
    return None, None if fallback is None else Streaming(Path(fallback).absolute(), lambda: None, spare=True)


def ending(
    origin: Origin,
    folder: Path | None,
    warn: Callable[[str], None],
    finished: Callable[[Outcome], None] | None,
    note: str = "",
) -> Callable[[Outcome], Outcome]:
    """What is done with an outcome before the components are closed.

    Args:
        origin: of the run. folder: that it was streamed to, or None. warn: called with each warning.
        finished: notified of the outcome; None for nobody. note: one more of the run; empty for none.
    """

    def finish(outcome: Outcome) -> Outcome:
        outcome = replace(outcome, origin=origin)
        if note:
            outcome = outcome.with_summary(notes=[*outcome.result.summary.get("notes", []), note])
        outcome = outcome if folder is None else _finish_stream(outcome, folder, warn)
        if finished is not None:
            finished(outcome)
        return outcome

    return finish


def _finish_stream(outcome: Outcome, directory: str | Path, warn: Callable[[str], None]) -> Outcome:
    """Write what only the end of a run shows. Where the disk refuses, the folder keeps what was streamed, and a warning
    says so.
    """
    assert outcome.origin is not None
    asked = outcome.tables if "tables" in outcome.origin.table.report.model_fields_set else ()
    streamed = replace(outcome, tables=("npy",))
    try:
        streamed.write(directory, report=False)
    except OutputError as error:
        text = f"The folder of the stream could not be brought to an end: {error}"
        warn(text)
        streamed = streamed.with_summary(warnings=[*outcome.warnings, text])
    return replace(streamed, tables=tuple(dict.fromkeys(("npy", *asked))))
