"""How plants and observers are stepped together: masters, balises, scenarios, results, reports.

``cosim.Scenario.load("freight_profile_d").run()`` is the whole of it. Importing needs no compiler.
"""

from cosim.errors import CosimError
from cosim.scenario import Outcome, Scenario, shipped_scenarios

__all__ = ["CosimError", "Outcome", "Scenario", "shipped_scenarios"]
