"""The keys of ``[components.NAME.filter]``: which filter, its states, measurements and noises."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from cosim.toml_table import OwnSeed, TomlTable
from fmus.fmi.standard import Interface
from plant_models.hybrid.noise import FROM_NAME

Kind = Literal["ekf", "ukf", "ensemble", "particle"]
_Positive = Annotated[float, Field(gt=0.0)]
_NotNegative = Annotated[float, Field(ge=0.0)]


class FilterTable(TomlTable):
    """A filter over the FMU of its component.

    Each key of a mapping is a name of the FMU; standard deviations are in the unit that the FMU has for that variable,
    as start values are, while results are in SI.
    """

    kind: Kind = Field(description="`ekf`, `ukf`, `ensemble` or `particle`")
    interface: Interface | None = Field(default=None, description="of an FMU that has both; co-simulation by default")
    states: list[str] | None = Field(default=None, description="states; those that the FMU declares by default")
    outputs: list[str] | None = Field(default=None, description="outputs that are estimated; all by default")
    measurements: dict[str, _Positive] = Field(
        default={}, description="outputs of the FMU that are measured, with standard deviations in the FMU's unit"
    )
    sample_period: _Positive | None = Field(
        default=None, description="time between samples of the measurements [s]; every communication step by default"
    )
    process_noise: dict[str, _NotNegative] = Field(
        default={},
        description="by state: standard deviation that a second adds, in the FMU's unit of the state by sqrt(s)",
    )
    input_noise: dict[str, _NotNegative] = Field(
        default={},
        description="by input: standard deviation in the FMU's unit, held over a step; enters the model where the "
        "input does",
    )
    start_deviation: dict[str, _NotNegative] = Field(
        default={},
        description="by state, or start value of a `particle` filter: standard deviation at the start in the FMU's "
        "unit",
    )
    balise: str | None = Field(default=None, description="output that a telegram measures, a position [m]")
    balise_deviation: _Positive = Field(
        default=1.0, description="standard deviation of it [m], where a telegram states no location accuracy"
    )
    horizon: _NotNegative = Field(default=10.0, description="how far back a late telegram is still taken in [s]")
    alpha: _Positive = Field(default=1.0, description="spread of the sigma points of a `ukf` [1]")
    members: Annotated[int, Field(ge=2)] = Field(default=100, description="of an `ensemble`, or particles")
    seed: OwnSeed = Field(
        default=FROM_NAME,
        description="of the numbers that they draw; -1: follows from the seed of the run and the name",
    )

    @model_validator(mode="after")
    def _sees_something(self) -> FilterTable:
        if not self.measurements and self.balise is None:
            raise ValueError("a filter needs 'measurements' (outputs with standard deviations) or 'balise' (an output)")
        if self.kind == "particle" and (self.states or self.process_noise):
            raise ValueError(
                "a particle filter selects saved states and moves none: leave out 'states' and 'process_noise', and "
                "give 'input_noise' and 'start_deviation'"
            )
        return self
