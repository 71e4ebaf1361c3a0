"""Provenance: runs made again from what their results folders say of how they were made."""

from cosim.provenance.rerun import Rerun, rerun

__all__ = ["Rerun", "rerun"]
