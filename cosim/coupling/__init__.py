"""Coupling: connections, order, plan."""
