"""The small academic plants on which observers are shown."""

from plant_models.benchmarks.e1 import TriangularisablePlant
from plant_models.benchmarks.e2 import NonTriangularisablePlant
from plant_models.benchmarks.pendulum import Pendulum

SYSTEMS = (Pendulum, TriangularisablePlant, NonTriangularisablePlant)

__all__ = ["SYSTEMS", "NonTriangularisablePlant", "Pendulum", "TriangularisablePlant"]
