"""Checks of what lies in the archive, without running anything but fmpy's validation."""

from __future__ import annotations

import warnings

from fmpy.validation import validate_fmu

from fmus.check.findings import CheckOutcome, noted, passed
from fmus.fmi.archive import Archive

SHOWN = 3
_COMPILED = "a library that was compiled of its sources on this machine"


def validation(archive: Archive) -> CheckOutcome:
    """The XML schema and fmpy's validation of the model description.

    Args:
        archive: the FMU file.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # libraries below warn about what the FMU did
        try:
            problems = [" ".join(str(p).split()) for p in validate_fmu(str(archive.path))]
        except Exception as error:  # a damaged file in the archive; unpacking says which
            problems = [f"it could not be validated ({error or type(error).__name__})"]
    if not problems:
        return passed("the model description is valid against the schema and fmpy's rules")
    more = f"; and {len(problems) - SHOWN} more" if len(problems) > SHOWN else ""
    return noted(
        f"{len(problems)} problems, for which strict importers refuse it: " + "; ".join(problems[:SHOWN]) + more
    )


def platforms(archive: Archive) -> CheckOutcome:
    """The platforms there are libraries for.

    Args:
        archive: the FMU file.
    """
    others = [p for p in archive.platforms if p not in archive.here]
    foreign = f"; not checked here: {', '.join(others)}" if others else ""
    library = f"a library for this platform ({', '.join(archive.here)})" if archive.here else _COMPILED
    return passed(library + foreign)
