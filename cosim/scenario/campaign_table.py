"""The table ``[campaign]`` of a scenario: what varies over many runs, how points are laid, what is kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from cosim.errors import nearest
from cosim.toml_table import Name, TomlTable

_Numbers = tuple[float, float]
_KINDS = ("uniform", "log", "whole", "normal", "triangular", "choose")


class VariedTable(TomlTable):
    """What one setting is drawn from."""

    uniform: _Numbers | None = None
    log: _Numbers | None = None
    whole: tuple[int, int] | None = None
    normal: _Numbers | None = None
    low: float | None = None
    high: float | None = None
    triangular: tuple[float, float, float] | None = None
    choose: list[Any] | None = None
    weights: list[Annotated[float, Field(ge=0.0)]] | None = None
    unit: str | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> VariedTable:
        if len(stated := [kind for kind in _KINDS if getattr(self, kind) is not None]) != 1:
            got = f" (got {' and '.join(stated)})" if stated else ""
            raise ValueError(f"expected a list, or a table with one of: {', '.join(_KINDS)}{got}")
        if stated != ["normal"] and {"low", "high"} & self.model_fields_set:
            raise ValueError("'low' and 'high' belong to 'normal', which they cut")
        if stated != ["choose"] and self.weights is not None:
            raise ValueError("'weights' belong to 'choose'")
        return self

    @property
    def kind(self) -> str:
        """Which of the kinds it is."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)


def flat_settings(stated: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of tables of settings, which may be written ``"plant.mass"`` and ``plant.mass`` alike.

    Args:
        stated: as in the file. before: keys that lead to it.
    """
    for name, value in stated.items():
        below = isinstance(value, Mapping) and not set(value) & set(VariedTable.model_fields)
        if below and value:
            yield from flat_settings(value, f"{before}{name}.")
        else:
            yield before + name, value


def _flat(stated: Any) -> Any:
    return dict(flat_settings(stated)) if isinstance(stated, Mapping) else stated


class KeepTable(TomlTable):
    """Runs whose whole results are kept beside the table."""

    failures: Annotated[int, Field(ge=0)] = 10
    worst: Annotated[int, Field(ge=0)] = 3
    of: list[str] = Field(default_factory=list)
    sample: Annotated[int, Field(ge=0)] = 0


class CampaignTable(TomlTable):
    """Many runs of the scenario: what varies, how points are laid, what is kept."""

    runs: Annotated[int, Field(ge=1)] | None = None
    method: Literal["random", "latin", "sobol", "grid", "zip"] = "random"
    seed: Annotated[int, Field(ge=0)] = 0
    vary: Annotated[dict[str, list[Any] | VariedTable], BeforeValidator(_flat)] = Field(default_factory=dict)
    faults: bool | list[Name] = False
    correlate: list[tuple[str, str, Annotated[float, Field(gt=-1.0, lt=1.0)]]] = Field(default_factory=list)
    where: list[str] = Field(default_factory=list)
    design: Annotated[dict[str, list[Any]], BeforeValidator(_flat)] = Field(default_factory=dict)
    keep: KeepTable = KeepTable()

    @model_validator(mode="after")
    def _complete(self) -> CampaignTable:
        if not (self.vary or self.faults):
            raise ValueError("nothing varies: give 'vary', such as { seed = { whole = [0, 9999] } }, or 'faults'")
        listed = self.method in ("grid", "zip")
        if listed and self.runs is not None:
            raise ValueError(f"'runs' is not given with method {self.method!r}, which takes every entry of the lists")
        if not listed and self.runs is None:
            raise ValueError(f"method {self.method!r} needs 'runs', the number of points")
        if self.correlate and self.method in ("grid", "zip"):
            raise ValueError(f"'correlate' belongs to drawn points, not to method {self.method!r}")
        for first, second, _ in self.correlate if not self.faults else ():
            for name in (first, second):
                if name not in self.vary:
                    raise ValueError(f"correlate: {name!r} is not varied; {nearest(name, self.vary)}")
        if both := sorted(set(self.design) & set(self.vary)):
            raise ValueError(f"{both[0]!r} stands in both 'vary' and 'design'; a setting has one place")
        return self
