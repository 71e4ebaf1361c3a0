"""What holds for observers with their gains: findings, those that runs are to find included, and demands on them."""

from cosim.certify.demands import Certified, Demands, certified
from cosim.certify.findings_table import findings_table
from cosim.certify.scenario_findings import scenario_observers
from cosim.certify.simulated_limit import keeps_plant, simulated, simulated_limit

__all__ = [
    "Certified",
    "Demands",
    "certified",
    "findings_table",
    "keeps_plant",
    "scenario_observers",
    "simulated",
    "simulated_limit",
]
