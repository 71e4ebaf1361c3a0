"""The base of all tables of a scenario file."""

from __future__ import annotations

from numbers import Real
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, PlainValidator

from plant_models.hybrid.noise import FROM_NAME, SEED_EXPECTED, is_seed
from plant_models.meant_number import meant_number

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
"""Name of a component."""


def _seed(value: Any) -> int:
    if not isinstance(value, bool) and isinstance(value, Real) and is_seed(float(value)):
        return int(float(value))
    meant = meant_number(value, whole=True) if isinstance(value, str) else ""
    raise ValueError(f"expected {SEED_EXPECTED}{meant} (got {value!r})")


def _own_seed(value: Any) -> int:
    follows = not isinstance(value, bool) and isinstance(value, Real) and float(value) == FROM_NAME
    return FROM_NAME if follows else _seed(value)


Seed = Annotated[int, PlainValidator(_seed)]
"""Seed of a run."""
OwnSeed = Annotated[int, PlainValidator(_own_seed)]
"""Seed of something that draws; -1: it follows from the seed of the run and the name."""


class TomlTable(BaseModel):
    """A table of a scenario file."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, allow_inf_nan=False)
