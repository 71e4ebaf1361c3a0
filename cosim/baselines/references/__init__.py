"""Reference results inside an FMU, as the layered standard FMI-LS-REF lays them out: read, run again, and written."""

from __future__ import annotations

from cosim.baselines.references.embed import embed_baseline
from cosim.baselines.references.extract import extract_reference
from cosim.baselines.references.read import find_references, read_reference

__all__ = ["embed_baseline", "extract_reference", "find_references", "read_reference"]
