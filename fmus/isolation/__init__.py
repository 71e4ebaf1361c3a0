"""Isolation: an FMU in a process of its own, behind a library with the functions of FMI. Linux."""
