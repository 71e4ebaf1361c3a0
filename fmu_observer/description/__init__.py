"""The model description of a system, used by the block and by the exported FMU alike."""

from fmu_observer.description.model_description import LOG_CATEGORIES, can_exchange, describe
from fmu_observer.description.variable_table import FIRST_REFERENCE, VariableTable, exposed_inputs, referenced
from fmu_observer.description.variables import STAMP_NOW, FmiVersion

__all__ = [
    "FIRST_REFERENCE",
    "LOG_CATEGORIES",
    "STAMP_NOW",
    "FmiVersion",
    "VariableTable",
    "can_exchange",
    "describe",
    "exposed_inputs",
    "referenced",
]
