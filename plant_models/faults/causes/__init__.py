"""Causes of faults, one file each: when a signal is wrong, by how much, and which way."""
