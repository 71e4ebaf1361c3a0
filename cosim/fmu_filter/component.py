"""A filter over a sealed FMU as a component of a scenario: inputs, samples and telegrams in, an estimate out.

It is plain Python to the master: what `cosim.components.python_model` demands of an object.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.components.description import open_fmu
from cosim.components.stated_units import NONE_STATED, StatedUnit
from cosim.errors import nearest
from cosim.fmu_filter.belief import ExtendedFilter, FmuFilter, Noises, UnscentedFilter
from cosim.fmu_filter.journal import EQUAL_WITHIN, FilterJournal
from cosim.fmu_filter.many import EnsembleFilter, FmuParticleFilter
from cosim.fmu_filter.scale import Scale, scale_of, shown
from cosim.fmu_filter.settings import FilterTable
from cosim.fmu_filter.shadow import Shadow
from cosim.fmu_model.opening import open_model
from cosim.fmu_model.sealed import FmuModelError, SealedModel
from cosim.fmu_model.trust import check_saving, check_states, usual_step
from plant_models.hybrid.missing import MISSED_SAMPLES
from plant_models.hybrid.noise import FROM_NAME, RUN_SEED, seed_of
from plant_models.hybrid.signal import Signal, input_signal, output_signal
from plant_models.hybrid.units import parse_unit

Array = NDArray[np.float64]
MEASURED = "measured_"
"""How the inputs begin that take measurements."""


class FmuFilterModel:
    """A filter over an FMU: ``step`` predicts and takes samples, ``balise`` takes telegrams, late ones too.

    Inputs are those of the FMU, and ``measured_NAME`` for each output that is measured. Outputs are the estimated
    states, the FMU's outputs at the estimate, ``NAME_std`` for each state, ``nis``, ``nis_degrees`` and
    ``missed_samples``: measurements that are NaN are left out, and counted. In names such as ``body.v[2]`` all but
    letters, digits and ``_`` becomes ``_``.

    Args:
        path: the ``.fmu`` file. table: which filter. parameters: start values of the FMU by name.
        units: what the scenario states of its variables, by name.
        checked: whether its states have been looked at already.

    Raises:
        FmuLoadError: the FMU cannot be opened.
        FmuModelError: a name is unknown, or it cannot serve this filter.
    """

    def __init__(
        self,
        path: str | Path,
        table: FilterTable,
        parameters: Mapping[str, Any] | None = None,
        units: Mapping[str, StatedUnit] = NONE_STATED,
        *,
        checked: bool = False,
    ) -> None:
        self._made_of = path, table, dict(parameters or {}), units
        numbers = _numbers(parameters or {})
        self._model = _opened(path, table, numbers, units)
        model = self._model
        if not checked:
            _demand(table, model)
        self._start = model.start.copy()
        self._seen = [_place(model, "output", model.outputs, name) for name in table.measurements]
        self._R = np.diag([value**2 for value in table.measurements.values()])
        self._balise, self._metres = _position(model, table.balise)
        intensity = np.diag(_by_name(model, "state", model.states, table.process_noise) ** 2)
        noisy = np.diag(_by_name(model, "input", model.inputs, table.input_noise) ** 2)
        self._engine = _engine(table, model, Noises(intensity, noisy))
        self._estimated = model.outputs if table.kind == "particle" else model.states
        self._P = np.zeros((len(self._estimated), len(self._estimated)))
        if table.kind != "particle":
            self._P = np.diag(_by_name(model, "state", model.states, table.start_deviation) ** 2)
        self._words = _legal_names([*model.inputs, *model.states, *model.outputs])
        self._scales: dict[str, Scale] = {}
        self.inputs = [self._signal(name, "input", self._words[name]) for name in model.inputs]
        self.inputs += [
            replace(self._signal(name, "input", MEASURED + self._words[name]), can_be_missing=True)
            for name in table.measurements
        ]
        self.outputs = self._output_signals()
        self._driven = [self._words[name] for name in model.inputs]
        self._output_words = [self._words[name] for name in model.outputs]
        self._measured_inputs = [MEASURED + self._words[name] for name in table.measurements]
        self._means = [self._words[name] for name in self._estimated]
        self._deviations = [f"{name}_std" for name in self._means]
        self._unchecked = not checked and table.kind != "particle"
        self._shadow = self._shadow_beside(numbers) if self._unchecked else None
        self._journal: FilterJournal | None = None
        self._next = self._missed = 0
        self._u = model.start_inputs.copy()
        if table.balise is None:
            self.balise = None  # type: ignore[method-assign,assignment]

    # -- what the master calls ----------------------------------------------------------------------------------------

    def step(self, t: float, inputs: Mapping[str, float], dt: float) -> dict[str, float]:
        """Predict over a step, and take the samples at its end.

        Args:
            t: begin of the step [s]. inputs: by name. dt: length of the step [s].

        Returns:
            The outputs.
        """
        table = self._made_of[1]
        if self._unchecked:
            self._check_step(dt)
        journal = self._begun(t)
        if self._scales:
            inputs = {name: self._scales[name].own(x) if name in self._scales else x for name, x in inputs.items()}
        self._u = np.array([inputs[name] for name in self._driven], dtype=float)
        journal.predict(dt, self._u)
        if self._shadow is not None:
            self._shadow.follow(t, dt, self._u)
        now = t + dt
        period = table.sample_period
        if self._seen and (period is None or now >= self._origin + self._next * period - EQUAL_WITHIN):
            y = np.array([inputs[name] for name in self._measured_inputs], dtype=float)
            finite = np.isfinite(y)  # NaN is a missing measurement
            self._missed += int(np.count_nonzero(~finite))
            if finite.any():
                known = np.flatnonzero(finite)
                seen = [self._seen[i] for i in known]
                journal.correct(now, self._u, seen, y[known], self._R[np.ix_(known, known)])
            if period is not None:
                self._next = int(np.floor((now - self._origin) / period + EQUAL_WITHIN / period)) + 1
        return self._values(now)

    def balise(self, stamp: float, position: float, location_accuracy: float = 0.0) -> bool | dict[str, float]:
        """Take a telegram in at its stamp; what followed a late one is done again.

        Args:
            stamp: when the balise was passed [s]. position: reported [m]. location_accuracy: reported [m].

        Returns:
            The outputs; False for a telegram from before the horizon.
        """
        journal = self._begun(stamp)
        assert self._balise is not None
        deviation = location_accuracy if location_accuracy > 0.0 else self._made_of[1].balise_deviation
        y, R = np.array([self._metres.own(position)]), np.array([[(deviation / self._metres.factor) ** 2]])
        taken = journal.correct(stamp, self._u, [self._balise], y, R)
        return self._values(journal.t) if taken else False

    def get_state(self) -> Any:
        """What to keep in order to return here."""
        journal = None if self._journal is None else self._journal.state()
        shadow = None if self._shadow is None else self._shadow.state()
        return journal, self._next, self._u.copy(), getattr(self, "_origin", 0.0), self._missed, shadow

    def set_state(self, state: Any) -> None:
        """Return.

        Args:
            state: from `get_state`.
        """
        journal, self._next, self._u, self._origin, self._missed, shadow = state
        if self._shadow is not None and not self._shadow.restore(shadow):
            self._shadow = None
        if journal is None:
            self._journal = None
        else:
            self._begun(journal[1]).restore(journal)

    def __deepcopy__(self, memo: Any) -> FmuFilterModel:
        return FmuFilterModel(*self._made_of, checked=True)

    # -- internals ----------------------------------------------------------------------------------------------------

    def _shadow_beside(self, parameters: Mapping[str, float]) -> Shadow | None:
        """An undisturbed run beside it, where the FMU is started again at each step and may have a second instance."""
        path, table, _, units = self._made_of
        alone = self._model.instance.capabilities.canBeInstantiatedOnlyOncePerProcess
        if self._model.way == "exchange" or alone:
            return None
        return Shadow(_opened(path, table, parameters, units), self._model)

    def _begun(self, t: float) -> FilterJournal:
        if self._journal is None:
            self._origin = t
            belief = self._engine.begin(self._start, self._P)
            self._journal = FilterJournal(self._engine, belief, t, self._made_of[1].horizon)
            self._next = 1
        return self._journal

    def _check_step(self, dt: float) -> None:
        """At the first step: its length [s] is no multiple of the one at which the states were looked at before."""
        self._unchecked = False
        usual = usual_step(self._model)
        if abs(dt / usual - max(1, round(dt / usual))) > EQUAL_WITHIN:
            check_states(self._model, dt)

    def _values(self, t: float) -> dict[str, float]:
        assert self._journal is not None
        belief = self._journal.belief
        found = dict(zip(self._output_words, self._engine.outputs(belief, t, self._u).tolist(), strict=True))
        found.update(zip(self._means, belief.x.tolist(), strict=True))
        deviations = np.sqrt(np.maximum(belief.P.diagonal(), 0.0))
        found.update(zip(self._deviations, deviations.tolist(), strict=True))
        found["nis"], found["nis_degrees"] = belief.nis, float(belief.degrees)
        return shown(self._scales, found | {MISSED_SAMPLES: float(self._missed)})

    def _output_signals(self) -> list[Signal]:
        names = list(dict.fromkeys([*self._model.states, *self._model.outputs]))
        found = [self._signal(name, "output", self._words[name]) for name in names]
        found += [self._signal(name, "output", f"{self._words[name]}_std", deviation=True) for name in self._estimated]
        return [
            *found,
            output_signal("nis", "1", "NIS of the last sample"),
            output_signal("nis_degrees", "1", "Values in it"),
            output_signal(MISSED_SAMPLES, "1", "Measurements that were missing at a sample", variability="discrete"),
        ]

    def _signal(self, source: str, causality: str, name: str, *, deviation: bool = False) -> Signal:
        """A signal like a variable of the FMU; how it is converted is kept in `_scales`."""
        model = self._model
        variable = model.instance.variables.element(source).variable
        scale = scale_of(model.instance.description, variable)
        scale = scale.of_deviations if deviation else scale
        if not scale.is_plain:
            self._scales[name] = scale
        text = variable.description or source
        if causality == "input":
            own = model.start_inputs[model.inputs.index(source)] if source in model.inputs else 0.0
            start = scale.shown(float(own)) if name == self._words[source] else 0.0
            return input_signal(name, scale.unit, start, text)
        return output_signal(name, scale.unit, text)

    def __getattr__(self, name: str) -> float:
        """First outputs, before the first step: the start."""
        if name.startswith("_"):
            raise AttributeError(name)
        return shown(self._scales, {name: self._first(name)})[name]

    def _first(self, name: str) -> float:
        states = [self._words[state] for state in self._model.states]
        first = dict(zip(states, self._start.tolist(), strict=True))
        first |= zip(self._deviations, np.sqrt(np.diagonal(self._P)).tolist(), strict=True)
        if name in first:
            return float(first[name])
        if name in self._output_words:
            _, y = self._model.values_at(0.0, self._start, self._model.start_inputs)
            return float(y[self._output_words.index(name)])
        if name in ("nis", "nis_degrees", MISSED_SAMPLES):
            return 0.0
        raise AttributeError(name)


def _legal_names(names: Sequence[str]) -> dict[str, str]:
    """Names of an FMU as those of signals: what is no letter, digit or ``_`` becomes ``_``."""
    found: dict[str, str] = {}
    for name in dict.fromkeys(names):
        word = re.sub(r"\W+", "_", name).strip("_") or "variable"
        word = f"_{word}" if word[0].isdigit() else word
        number, base = 2, word
        while word in found.values():
            word, number = f"{base}_{number}", number + 1
        found[name] = word
    return found


def _engine(table: FilterTable, model: SealedModel, noises: Noises) -> FmuFilter:
    seed = (
        seed_of(RUN_SEED, Path(model.path).stem) if table.seed == FROM_NAME else table.seed
    )  # alone, without a scenario
    if table.kind == "ukf":
        return UnscentedFilter(model, noises, table.alpha)
    if table.kind == "ensemble":
        return EnsembleFilter(model, noises, table.members, seed)
    if table.kind == "particle":
        starts = {name: model.parameters[name] for name in table.start_deviation}
        return FmuParticleFilter(model, noises, table.start_deviation, starts, table.members, seed)
    return ExtendedFilter(model, noises)


def _opened(
    path: str | Path, table: FilterTable, parameters: Mapping[str, float], units: Mapping[str, StatedUnit]
) -> SealedModel:
    """The FMU with its states, or without where they are only saved."""
    states, starts = table.states, dict[str, float]()
    if table.kind == "particle":
        states = []
        starts = {name: _start_value(path, name) for name in table.start_deviation if name not in parameters}
    settings = {**parameters, **starts}
    return open_model(path, table.interface, states=states, outputs=table.outputs, parameters=settings, units=units)


def _demand(table: FilterTable, model: SealedModel) -> None:
    """Refuse an FMU of which a measurement says that it cannot serve this filter."""
    h = usual_step(model)
    if table.kind != "particle":
        check_states(model, h)
        return
    check_saving(model, h)
    if not any((*table.start_deviation.values(), *table.input_noise.values())):
        raise FmuModelError(
            f"{model.path}: nothing moves the particles apart: give 'start_deviation' (start values, parameters too) "
            "or 'input_noise'."
        )


def _place(model: SealedModel, what: str, names: tuple[str, ...], name: str) -> int:
    if name not in names:
        raise FmuModelError(f"{model.path}: no {what} {name!r}; {nearest(name, names)}")
    return names.index(name)


def _position(model: SealedModel, name: str | None) -> tuple[int | None, Scale]:
    """The place of the output that telegrams measure, and how it is shown in metres; what has no unit that we know is
    taken as metres.
    """
    if name is None:
        return None, Scale("m")
    place = _place(model, "output", model.outputs, name)
    scale = scale_of(model.instance.description, model.instance.variables.element(name).variable)
    unit = parse_unit(scale.unit)
    if unit.exponents not in (parse_unit("m").exponents, parse_unit("1").exponents):
        raise FmuModelError(
            f"{model.path}: balise = {name!r}: it is in {model.unit(name)}; a telegram measures a position [m]."
        )
    return place, Scale("m", unit.factor * scale.factor, unit.factor * scale.offset)


def _by_name(model: SealedModel, what: str, names: tuple[str, ...], stated: Mapping[str, float]) -> Array:
    found = np.zeros(len(names))
    for name, value in stated.items():
        found[_place(model, what, names, name)] = value
    return found


def _numbers(parameters: Mapping[str, Any]) -> dict[str, float]:
    for name, value in parameters.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FmuModelError(f"parameter {name} = {value!r}: an FMU in a filter takes numbers.")
    return {name: float(value) for name, value in parameters.items()}


def _start_value(path: str | Path, name: str) -> float:
    """The declared start of a variable, 0 where it declares none."""
    description = open_fmu(Path(path), Path(path).name).description
    by_name = {variable.name: variable for variable in description.modelVariables}
    if name not in by_name:
        raise FmuModelError(f"{path}: no start value {name!r}; {nearest(name, by_name)}")
    return float(by_name[name].start or 0.0)
