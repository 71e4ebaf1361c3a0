"""Diagnostics: messages of the FMUs, the call log, what each component is called for. Knows no component."""
