"""Reading what is left of a run that was streamed and did not end. Touches only the files it is given."""

from __future__ import annotations

UNFINISHED = ".unfinished"
"""The folder, within that of the results, to which a run is streamed in case its process dies."""

DID_NOT_END = "the run did not end"
EXPLAINED = (
    f"{DID_NOT_END}: it is still going on, or its program was stopped from outside or taken along by an FMU. The rows "
    "are those written until then."
)
