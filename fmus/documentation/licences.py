"""Licences: what is in an FMU and under which terms."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from plant_models.hybrid import HybridSystem

OWN_PACKAGES = {"plant_models", "fmu_observer", "fmus", "cosim"}


def _is_ours(system: HybridSystem) -> bool:
    """Whether a system ships with this package; any other is its author's."""
    return type(system).__module__.partition(".")[0] in OWN_PACKAGES


def licence_files(system: HybridSystem) -> dict[str, str]:
    """Texts under ``documentation/``, by name; ``licenses/license.txt`` is the entry that FMI names.

    Args:
        system: the system in the FMU.
    """
    texts = {f"licenses/{name}": text for name, text in licence_texts().items()}
    return {"licenses/license.txt": _entry(system), **texts}


@cache
def licence_texts() -> dict[str, str]:
    """The licences that every FMU carries, by file name."""
    folder = files("fmus") / "licenses"
    return {entry.name: entry.read_text(encoding="utf-8") for entry in sorted(folder.iterdir(), key=lambda e: e.name)}


def model_terms(system: HybridSystem) -> str:
    """One sentence about the terms of the model itself.

    Args:
        system: the system in the FMU.
    """
    if _is_ours(system):
        return f"The model {system.name} is part of fmu-observer: BSD-3-Clause, see fmu-observer.txt."
    return f"The model {system.name} is not part of fmu-observer: its terms are its author's to state."


def _entry(system: HybridSystem) -> str:
    return "\n".join(
        [
            model_terms(system),
            "The runtime (all other C files in sources/ and what is compiled from them): BSD-3-Clause, see "
            "fmu-observer.txt.",
            "The headers fmi*.h in sources/: BSD-2-Clause, see fmi-headers.txt.",
            "The code that CasADi generated in sources/model.c: free of claims, see casadi-generated-code.txt.",
            "",
        ]
    )
