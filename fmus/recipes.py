"""Recipes: the systems that can be exported by name, plants and observers alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from inspect import Parameter, isabstract, signature
from typing import Any

from fmu_observer import OBSERVERS
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem
from plant_models.user_file import Expected

SYSTEM = Expected(
    "subclass of HybridSystem",
    lambda found: isinstance(found, type) and issubclass(found, HybridSystem) and not isabstract(found),
)
"""What the name of a user's own model must stand for."""


class UnknownRecipeError(LookupError):
    """A name or an option that does not exist; the message names the nearest that does."""


class _Recipes(Mapping[str, type[HybridSystem]]):
    """Both registries as one; read at each look-up, so that what a user registers is found."""

    def __getitem__(self, name: str) -> type[HybridSystem]:
        return PLANTS[name] if name in PLANTS else OBSERVERS[name]

    def __iter__(self) -> Iterator[str]:
        yield from PLANTS
        yield from (name for name in OBSERVERS if name not in PLANTS)

    def __len__(self) -> int:
        return len(set(PLANTS) | set(OBSERVERS))


RECIPES: Mapping[str, type[HybridSystem]] = _Recipes()
"""Class by model name: all of `plant_models.PLANTS` and `fmu_observer.OBSERVERS`."""


def recipe(name: str, **options: Any) -> HybridSystem:
    """A system by name.

    Args:
        name: model name, see `RECIPES`.
        options: numbers and choices that shape its equations, see `_recipe_options`.

    Raises:
        UnknownRecipeError: the name or an option does not exist.
        ValueError: an option has a value that the system refuses.
    """
    if name not in RECIPES:
        raise UnknownRecipeError(
            f"There is no model named {name!r}{_nearest(name, RECIPES) or '.'} 'fmus list' shows all."
        )
    known = _recipe_options(name)
    for option in options:
        if option not in known:
            hint, has = _nearest(option, known) or ".", ", ".join(known) or "none"
            raise UnknownRecipeError(f"{name} has no option {option!r}{hint} It has: {has}.")
    return RECIPES[name](**options)


def _recipe_options(name: str) -> dict[str, Any]:
    """Options of a model and their defaults (None where it has none)."""
    cls = RECIPES[name]
    named = {
        p.name: None if p.default is Parameter.empty else p.default
        for p in signature(cls).parameters.values()
        if p.kind in {Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY}
    }
    return dict.fromkeys(cls.option_choices) | named


def legal_values(choices: Sequence[Any] | None) -> str:
    """The legal values of an option in words; empty where any is legal.

    Args:
        choices: allowed values; None where anything is.
    """
    if not choices:
        return ""
    if isinstance(choices, range):
        return f", {choices[0]} to {choices[-1]}"
    return f", one of {', '.join(map(str, choices))}"


def recipe_entry(name: str) -> dict[str, Any]:
    """What is known of a model, for lists: the fields of `fmus.catalogue.Entry` as plain data.

    Args:
        name: model name, one of `RECIPES`.
    """
    cls = RECIPES[name]
    model = _as_declared(cls)
    options = [
        {
            "name": option,
            "default": None if default is None else str(default),
            "legal": legal_values(cls.option_choices.get(option)),
            "listed": option in cls.option_choices,
        }
        for option, default in _recipe_options(name).items()
    ]
    said = {"name": name, "room": _room(name), "description": cls.description, "source": cls.source}
    payload = {signal.name for event in model.triggered_events for signal in event.payload}
    return said | {
        "presets": list(model.presets),
        "preset": model.default_preset,
        "options": options,
        "inputs": [s.name for s in model.inputs if not s.optional and s.name not in payload],
        "events": [event.name for event in model.triggered_events],
    }


def _room(name: str) -> str:
    """The first line of the room's description; for others than shipped models, who brings it."""
    registry = PLANTS if name in PLANTS else OBSERVERS
    room = registry.room(name)
    words = (import_module(room).__doc__ or room).splitlines()[0].rstrip(".") if room else registry.origin(name)
    return words[0].upper() + words[1:]


def _as_declared(cls: type[HybridSystem]) -> Any:
    """A model with its default options, on which presets and signals may depend; its class where it has none."""
    required = (
        p.default is Parameter.empty and p.kind is not Parameter.VAR_KEYWORD for p in signature(cls).parameters.values()
    )
    return cls if any(required) else cls()


def _nearest(name: str, known: Mapping[str, Any]) -> str:
    matches = get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean {matches[0]!r}?" if matches else ""
