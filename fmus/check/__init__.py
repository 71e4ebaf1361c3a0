"""What an FMU really does, whatever it says about itself: ``fmus check``, and the probe of the master in `probe.py`.

Importing it costs nothing; what does the work is loaded when it is first used. It may use `plant_models`,
`fmu_observer` and the rest of `fmus`, never `cosim`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.registry import lazy_imports

if TYPE_CHECKING:
    from fmus.check.findings import CheckFinding, Class, Verdict
    from fmus.check.run import CheckReport, check_fmu

__all__ = ["CheckFinding", "CheckReport", "Class", "Verdict", "check_fmu"]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "CheckReport": "fmus.check.run",
        "Class": "fmus.check.findings",
        "CheckFinding": "fmus.check.findings",
        "Verdict": "fmus.check.findings",
        "check_fmu": "fmus.check.run",
    },
)
