"""Documentation inside an FMU: a page that says what it is, how it is built again, and the licences. Text in, bytes
out.
"""

from __future__ import annotations

from collections.abc import Sequence

from fmpy.model_description import ModelDescription

from fmus.documentation.licences import licence_files
from fmus.documentation.page import page
from fmus.documentation.rebuild import rebuild_text
from fmus.toolchain.targets import Target
from plant_models.hybrid import HybridSystem

__all__ = ["documentation_files"]


def documentation_files(
    system: HybridSystem, description: ModelDescription, preset: str | None, targets: Sequence[Target]
) -> dict[str, bytes]:
    """The files under ``documentation/``, by name inside the FMU.

    Args:
        system: the hybrid system. description: its model description. preset: preset of the start values.
        targets: platforms of the libraries and the compilers that built them.
    """
    texts = {
        "index.html": page(system, description, preset, targets),
        "staticLinking.txt": rebuild_text(description),  # the name that FMI 3.0 gives it
        **licence_files(system),
    }
    return {f"documentation/{name}": text.encode() for name, text in texts.items()}
