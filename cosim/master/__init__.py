"""The master: initialisation, stepping, delivery of events."""
