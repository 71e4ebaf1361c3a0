"""Formulas of the observers, each once: pure functions that trace, and what recordings are read with. No observer."""
