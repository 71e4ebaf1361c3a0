"""Scenarios: what is coupled, how long, past which balises, and what is reported; read, checked, and run."""
