"""What an output warns of: a number other than zero in it, or one that it never reached, is reported after the run.

Declared beside the output, carried by block and FMU alike. Standard library only.
"""

from __future__ import annotations

from dataclasses import dataclass

ANNOTATION, ELEMENT = "fmu-observer.output-warning", "OutputWarning"
"""Names under which the description of an exported model carries it."""


@dataclass(frozen=True, slots=True)
class OutputWarning:
    """Warn where an output is not zero, or of a whole run in which it did not reach a number.

    Args:
        text: what that means and what to do, in words that follow the name of the component and begin with a verb or a
            noun, without a full stop.
        shows: outputs of the same system whose values are reported beside it.
        at_end: only the last row of a run counts; otherwise every row does.
        reaches: what the output comes to in a run that is long enough; where it is given, staying below it is what is
            warned of, and other numbers are none.

    Raises:
        ValueError: there is no text.
    """

    text: str
    shows: tuple[str, ...] = ()
    at_end: bool = False
    reaches: float | None = None

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError("The warning of an output has no text; say what it means that it is not zero.")
