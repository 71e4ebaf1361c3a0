"""Licences of a hosted FMU: what is in it, compiled and as Python, and under which terms."""

from __future__ import annotations

from importlib.metadata import distribution

from fmus.documentation.licences import OWN_PACKAGES, licence_texts
from fmus.hosted.source import Source

OURS = ("fmu-observer.txt", "fmi-headers.txt")
"""Of the licences that native FMUs carry; nothing here is CasADi's."""


def hosted_licences(source: Source) -> dict[str, str]:
    """Texts under ``documentation/licenses/``, by name; ``license.txt`` is the entry, as in a native FMU.

    Args:
        source: the user's file.
    """
    texts = {name: licence_texts()[name] for name in OURS}
    return {"license.txt": _entry(source), **texts, "pythonfmu.txt": _pythonfmu()}


def _entry(source: Source) -> str:
    return "\n".join(
        [
            _model_terms(source),
            "The library in binaries/, and hosted_*.py and hosted.json in resources/: BSD-3-Clause, see "
            "fmu-observer.txt.",
            "The headers of FMI that the library was compiled with: BSD-2-Clause, see fmi-headers.txt.",
            "The folder pythonfmu and the library pythonfmu-export in resources/: MIT, see pythonfmu.txt.",
            "",
        ]
    )


def _model_terms(source: Source) -> str:
    if source.file is None and source.module.partition(".")[0] in OWN_PACKAGES:
        return f"The model {source.name} is part of fmu-observer: BSD-3-Clause, see fmu-observer.txt."
    place = "resources/model" if source.file else f"the installed module {source.module}"
    return f"The model {source.name} ({place}) is not part of fmu-observer: its terms are its author's to state."


def _pythonfmu() -> str:
    return "".join(p.read_text() for p in distribution("pythonfmu").files or () if p.name == "LICENSE")
