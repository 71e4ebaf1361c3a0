"""Scenarios: what is coupled, how long, past which balises, and what is reported."""

from cosim.scenario.outcome import Outcome
from cosim.scenario.scenario import Scenario, shipped_scenarios

__all__ = ["Outcome", "Scenario", "shipped_scenarios"]
