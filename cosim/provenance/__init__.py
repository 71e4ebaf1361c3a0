"""Provenance: results folders that say how they were made, and runs made again from them."""

from cosim.provenance.manifest import Manifest, read_manifest
from cosim.provenance.rerun import Rerun, rerun

__all__ = ["Manifest", "Rerun", "read_manifest", "rerun"]
