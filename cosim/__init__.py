"""How plants and observers are stepped together: masters, balises, scenarios, results, comparison, reports.

``cosim.Scenario.load("freight_profile_d").run()`` is the whole of it. Importing this package costs nothing and needs no
compiler: what does the work is loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.registry import lazy_imports

if TYPE_CHECKING:
    from cosim.choice.benchmark import benchmark_observers
    from cosim.comparison.compare import compare
    from cosim.comparison.comparison import Comparison
    from cosim.comparison.tolerance import Tolerance, Tolerances
    from cosim.errors import CosimError, UnmetError
    from cosim.falsification.falsify import falsify
    from cosim.provenance.rerun import rerun
    from cosim.results.load_result import load_result
    from cosim.results.result import Result
    from cosim.results.save import save_result
    from cosim.run.outcome import Outcome
    from cosim.scenario.shipped import shipped_scenarios
    from cosim.simulation.scenario import Scenario
    from cosim.studies.distributions import log_uniform, uniform, whole
    from cosim.studies.sweep import Sweep
    from cosim.studies.sweep_result import SweepResult
    from cosim.tuning.tune import tune
    from cosim.tuning.tuning_result import Tuning

__all__ = [
    "Comparison",
    "CosimError",
    "Outcome",
    "Result",
    "Scenario",
    "Sweep",
    "SweepResult",
    "Tolerance",
    "Tolerances",
    "Tuning",
    "UnmetError",
    "benchmark_observers",
    "compare",
    "falsify",
    "load_result",
    "log_uniform",
    "rerun",
    "save_result",
    "shipped_scenarios",
    "tune",
    "uniform",
    "whole",
]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "Comparison": "cosim.comparison.comparison",
        "CosimError": "cosim.errors",
        "Outcome": "cosim.run.outcome",
        "Result": "cosim.results.result",
        "Scenario": "cosim.simulation.scenario",
        "Sweep": "cosim.studies.sweep",
        "SweepResult": "cosim.studies.sweep_result",
        "Tolerance": "cosim.comparison.tolerance",
        "Tolerances": "cosim.comparison.tolerance",
        "Tuning": "cosim.tuning.tuning_result",
        "UnmetError": "cosim.errors",
        "benchmark_observers": "cosim.choice.benchmark",
        "compare": "cosim.comparison.compare",
        "falsify": "cosim.falsification.falsify",
        "load_result": "cosim.results.load_result",
        "log_uniform": "cosim.studies.distributions",
        "rerun": "cosim.provenance",
        "save_result": "cosim.results.save",
        "shipped_scenarios": "cosim.scenario.shipped",
        "tune": "cosim.tuning.tune",
        "uniform": "cosim.studies.distributions",
        "whole": "cosim.studies.distributions",
    },
)
