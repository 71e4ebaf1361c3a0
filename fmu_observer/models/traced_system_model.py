"""Any hybrid system as the model of a filter: its own flow over a period, or its own periodic jump. It knows no filter.

1. Continuous states are estimated. They move by the system's own method (dry friction and switches included) in equal
   steps, none longer than the system's own internal step unless `Steps` says how many; memory stays at its start,
   triggered events do not occur, and periodic ones must leave the continuous states alone.
2. A system without continuous states that jumps at one periodic event moves by this jump; all its memory is estimated,
   and the period of the event is that of the filter.
3. Its parameters become parameters of the filter. Vectors are taken apart, ``x[1]`` as ``x_1``.

What does not flow and does not jump at one period only has no transition that a filter could differentiate; it is
refused in words.
"""

from __future__ import annotations

from collections.abc import Sequence

from fmu_observer.models.filter_models import FilterModel, filter_model
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.moving_system import USUAL_STEPS, MovingSystem, Steps, identifier
from fmu_observer.models.observer_model import ObserverModel
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem
from plant_models.hybrid.signal import Signal, input_signal, scalar_names
from plant_models.interop.continuous_part import known as known_name
from plant_models.user_file import Expected, load_class, names_code

_USERS = Expected("subclass of HybridSystem", lambda found: isinstance(found, type) and issubclass(found, HybridSystem))


Source = str | ObserverModel | FilterModel | HybridSystem | type[HybridSystem]


def system_model(
    system: HybridSystem,
    outputs: Sequence[str],
    inputs: Sequence[str] | None = None,
    *,
    process_noises: Sequence[str] = (),
    measurement_noises: Sequence[str] = (),
    steps: Steps = USUAL_STEPS,
    preset: str | None = None,
) -> FilterModel:
    """A hybrid system as the model of a filter; how it moves then stands at the head of this module.

    Args:
        system: traceable. outputs: scalar names of what is measured. inputs: names of the inputs that the filter knows,
            all by default; the others stay at their starts.
        process_noises: names of inputs, or of noises of the periodic event, through which the process noise enters,
            held over a period; none for additive noise on every state.
        measurement_noises: names of inputs through which noise enters the outputs; none for additive noise.
        steps: of the integration in a period. preset: of the start values; None for the default one.

    Raises:
        ValueError: a name is unknown, nothing is measured, or the system does not move so; the message says which.
    """
    _require_list(system, outputs)
    moving = MovingSystem(system, steps.of(system), preset, steps.period)
    noisy = (*process_noises, *measurement_noises)
    names = [n for n in scalar_names(system.inputs) if n not in noisy] if inputs is None else list(inputs)
    return _model(moving, steps, outputs, names, process_noises, measurement_noises)


def _model(
    moving: MovingSystem,
    steps: Steps,
    outputs: Sequence[str],
    names: Sequence[str],
    process_noises: Sequence[str],
    measurement_noises: Sequence[str],
) -> FilterModel:
    system = moving.system
    signals = {name: s for s in system.input_signals for name in s.scalar_names}
    for name in (*names, *process_noises, *measurement_noises):
        known_name(name, signals, f"{system.name}: input")
    every = {name: s for s in system.outputs for name in s.scalar_names}
    measured = [every[known_name(name, every, f"{system.name}: output")] for name in outputs]
    rows = [list(every).index(name) for name in outputs]
    moving.check_outputs(rows)
    return FilterModel(
        name=system.name,
        description=system.description,
        source=system.source,
        states=moving.states,
        inputs=tuple(_input(name, signals[name]) for name in names),
        measurements=tuple(_input(name, s) for name, s in zip(outputs, measured, strict=True)),
        parameters=moving.parameters,
        process_noises=tuple(_input(name, signals[name]) for name in process_noises),
        measurement_noises=tuple(_input(name, signals[name]) for name in measurement_noises),
        moved=moving.transition(names, process_noises),
        measured=moving.measured(names, measurement_noises, rows),
        sample_period=moving.sample_period,
        any_period=moving.event is None,
        longest_period=moving.longest_period(steps),
        deviates=moving.deviates(names, process_noises, measurement_noises, rows),
    )


def _require_list(system: HybridSystem, outputs: Sequence[str]) -> None:
    if isinstance(outputs, str) or not outputs:
        raise ValueError(
            f"{system.name}: outputs = {outputs!r}; expected a list of what is measured, some of: "
            f"{', '.join(scalar_names(system.outputs))}."
        )


def find_filter_model(
    model: Source,
    outputs: Sequence[str] = (),
    inputs: Sequence[str] | None = None,
    process_noises: Sequence[str] = (),
    measurement_noises: Sequence[str] = (),
    steps: Steps = USUAL_STEPS,
) -> FilterModel:
    """The model of a filter, of whatever names or is one.

    Args:
        model: name of an observer model, or of a plant, or ``file.py:Class``; or a model or hybrid system itself. A
            name that both bear is the observer model's, unless `outputs` are given.
        outputs, inputs, process_noises, measurement_noises, steps: of a hybrid system, see `system_model`. An observer
            model keeps the period that it has.

    Raises:
        ValueError: the name is unknown, or something is asked for that the model has not.
    """
    if isinstance(model, FilterModel | ObserverModel) or (model in MODELS and not outputs):
        _require_nothing(
            outputs=outputs, inputs=inputs, process_noises=process_noises, measurement_noises=measurement_noises
        )
        return model if isinstance(model, FilterModel) else filter_model(find_model(model))
    plant = _found(model)
    return system_model(
        plant, outputs, inputs, process_noises=process_noises, measurement_noises=measurement_noises, steps=steps
    )


def _require_nothing(**options: Sequence[str] | None) -> None:
    asked = [name for name, value in options.items() if value]
    if asked:
        raise ValueError(
            f"{', '.join(asked)}: what an observer model measures and knows stands in the model; leave it out, or name "
            "a plant."
        )


def _found(model: object) -> HybridSystem:
    if isinstance(model, HybridSystem):
        return model
    if isinstance(model, type) and issubclass(model, HybridSystem):
        return model()
    if isinstance(model, str) and names_code(model):
        found: HybridSystem = load_class(model, _USERS)()
        return found
    if not isinstance(model, str) or model not in PLANTS:
        raise ValueError(
            f"Unknown model {model!r} of a filter; known are the observer models {', '.join(MODELS)}, and with "
            f"`outputs` the plants {', '.join(PLANTS)}."
        )
    return PLANTS[model]()


def _input(name: str, signal: Signal) -> Signal:
    start = signal.start_values[signal.scalar_names.index(name)]
    return input_signal(identifier(name), signal.unit, float(start), signal.description)
