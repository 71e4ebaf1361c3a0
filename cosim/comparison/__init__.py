"""Comparison of results: tolerance tubes for each smooth piece of a signal, jumps and telegrams matched as events."""
