"""Starter scenarios: a commented scenario file for an FMU, from what its description says. Nothing of the FMU is
executed.
"""
