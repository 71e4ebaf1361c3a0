"""Reference results inside an FMU, as the layered standard FMI-LS-REF lays them out: read, run again, and written."""

from __future__ import annotations

from cosim.baselines.references.extract import extract_reference
from cosim.baselines.references.read import find_references, read_reference
from cosim.baselines.references.write import embed_baseline

__all__ = ["embed_baseline", "extract_reference", "find_references", "read_reference"]
