"""What a plant, an observer or a class of the user's declares, as plain data for ``cosim info``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cosim.errors import CosimError, ScenarioError, nearest
from cosim.run.component_models import make_declared
from cosim.scenario.scenario_tables import ComponentTable
from fmu_observer import OBSERVERS
from fmus.near_files import what_it_is
from fmus.recipes import legal_values
from plant_models import PLANTS
from plant_models.code_trust import looking
from plant_models.explained_error import explained
from plant_models.hybrid import Signal, TracingError
from plant_models.user_file import names_code

_REGISTRIES = {"model": PLANTS, "observer": OBSERVERS}
_ARTICLES = {"model": "a plant", "observer": "an observer"}


def declared_model(
    name: str, where: str, kinds: Sequence[str] = tuple(_REGISTRIES), options: Mapping[str, Any] | None = None
) -> Any:
    """A plant or an observer by what a user calls it.

    Args:
        name: of one that ships or is installed, ``file.py:Class`` or ``package.module:Class``.
        where: place for messages. kinds: ``model``, ``observer``. options: of its constructor.

    Raises:
        ScenarioError: there is none of these kinds, or it cannot be loaded or made.
    """
    key = next((kind for kind in kinds if name in _REGISTRIES[kind]), kinds[-1])
    if name not in _REGISTRIES[key] and not names_code(name):
        known = [one for kind in kinds for one in _REGISTRIES[kind]]
        other = next((kind for kind, room in _REGISTRIES.items() if name in room), None)
        is_what = _ARTICLES[other] if other else what_it_is(Path(name))
        if is_what:
            expected = " or ".join(_ARTICLES[kind] for kind in kinds)
            raise ScenarioError(f"{name} is {is_what}; expected the name of {expected}, or file.py:Class.")
        raise ScenarioError(f"There is no {' or '.join(kinds)} {name!r}; {nearest(name, known)}")
    with looking(False):  # a class that is named on the command line is run as any Python file that is
        return make_declared(ComponentTable.model_validate({key: name, "options": options or {}}), where)


@contextmanager
def in_own_words(name: str, where: str) -> Iterator[None]:
    """What a model's own methods raise, in their own words.

    Args:
        name: of the model, as a user calls it. where: place for messages.

    Raises:
        CosimError: an argument is not legal, or the code of a user raised something, with its kind and line; what is
            not legal in what ships raises on as it is.
    """
    try:
        yield
    except CosimError:
        raise
    except (ValueError, TracingError) as error:
        raise CosimError(f"{where}: {error}") from error
    except Exception as error:
        if not names_code(name):
            raise
        raise CosimError(f"{where}: {name}: {explained(error)}") from error


def describe_model(name: str) -> dict[str, Any]:
    """What a model declares, as plain data.

    Args:
        name: of a plant or an observer, ``file.py:Class`` or ``package.module:Class``.

    Returns:
        The same keys for variables as of an FMU; the others say where the model comes from and what can be chosen.

    Raises:
        ScenarioError: there is no such model, or it cannot be loaded or made.
    """
    registry = PLANTS if name in PLANTS else OBSERVERS
    made = declared_model(name, "info")
    cls = getattr(made, "cls", type(made))  # of plain Python it is the user's
    variables = [*made.inputs, *made.outputs, *made.parameter_signals, *getattr(made, "states", ())]
    return {
        "model": name,
        "description": " ".join((getattr(made, "description", "") or cls.__doc__ or "").split()),
        "source": getattr(made, "source", ""),
        "origin": registry.origin(name) if name in registry else f"{cls.__module__.partition('@')[0]}:{cls.__name__}",
        "presets": list(getattr(made, "presets", ())),
        "options": [
            f"{k}: {legal_values(v).removeprefix(', ') or 'any'}" for k, v in getattr(cls, "option_choices", {}).items()
        ],
        "events": [event.name for event in getattr(made, "triggered_events", ())],
        "variables": [_variable(signal) for signal in variables],
    }


def _variable(signal: Signal) -> dict[str, Any]:
    return {
        "name": signal.name,
        "causality": signal.causality,
        "variability": signal.variability,
        "type": "Float64" if signal.size is None else f"Float64[{signal.size}]",
        "unit": signal.unit,
        "start": signal.start if signal.causality != "output" else None,
        "description": f"{signal.description} (optional)" if signal.optional else signal.description,
    }
