"""Diagnostics: the structure of a run as text and picture, what the FMUs log, what each component is called for."""
