"""The gate against true and false telegrams: train observers with true and wrong models, dry and wet rails, balises
near and far.

``python docs/studies/telegram_gate.py`` prints the tables of docs/theses/telegram_gate.md and draws
docs/images/telegram_gate.png.

The plant of the line Amsterdam - Utrecht is run once on each rail, 29.7 km, without jams; the observers run beside the
recording, with the settings of the shipped scenario or gains certified for the longest gap. At each true telegram the
gate is also asked what it would say to a false one there: a position that is off by so much.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim import Scenario
from fmu_observer import OBSERVERS
from fmu_observer.design.certified_gains import certified_gains
from fmu_observer.observers.innovation_gate import GATE_MEMORY, VERDICT, GateMemory, ReportedPlace, evaluate
from fmu_observer.observers.parameter_values import parameter_values
from fmu_observer.observers.train import TrainObserver
from plant_models.hybrid import Runtime, scalar_names

SCENARIO, RAILS, MODELS = "amsterdam_utrecht", ("dry", "wet"), ("true", "wrong")
SPACINGS = {20.0: (0.5,), 100.0: (0.5,), 300.0: (0.5,), 1000.0: (0.2, 0.7), 2000.0: (0.2, 0.5, 0.8)}
"""Distance of the balises [m], and where in it the first one lies, a run each."""
OFFSETS = np.geomspace(1.0, 1000.0, 61)  # [m]
STATED_OFFSETS = (3.0, 10.0, 30.0, 100.0, 300.0)  # [m], of the table
STEP, BEGIN = 0.05, 3100.0  # [s], [m]
PICTURE = Path(__file__).parents[1] / "images" / "telegram_gate.png"
TRUE = {"mass": 900e3, "davis_a": 5400.0, "davis_b": 200.0, "davis_c": 12.0}
FAMILIES = {"multirate_cdo": "theta_2"}
STUDIED = (
    "odometer_reset",
    "quasi_lpv_uio",
    "discrete_measurement_observer",
    "takagi_sugeno_cdo",
    "adaptive_gain_cdo",
    "multirate_cdo",
    "discrete_uio",
    "balise_odometer_ekf",
)


@dataclass(frozen=True)
class Recording:
    """A run of the plant: instants [s], efforts held from them on [N], odometer [m/s] and true position [m], shape
    (k,).
    """

    t: np.ndarray
    effort: np.ndarray
    odometer: np.ndarray
    position: np.ndarray


@dataclass(frozen=True)
class Telegram:
    """A true telegram: its innovation [m], whether the gate had settled and ignored it, and which false ones it would
    have used in its place, by offset and sign.
    """

    innovation: float
    settled: bool
    ignored: bool
    false_used: np.ndarray


def record(rails: str, stop: float = 890.0) -> Recording:
    """Run the plant of the shipped scenario without observers."""
    scenario = Scenario(stop=stop, step=STEP)
    for name in ("train", "driver", "tachometer"):
        table = Scenario.load(SCENARIO).table().components[name]
        values = dict(table.parameters)
        if rails == "dry" and name == "train":
            values |= {
                "zone_from": [1e6 + 2.0 * k for k in range(6)],
                "zone_to": [1e6 + 2.0 * k + 1.0 for k in range(6)],
            }
        scenario.add(
            name, model=str(table.model), preset=table.preset, parameters=values, **{"options": dict(table.options)}
        )
    return recorded(scenario)


def recorded(scenario: Scenario) -> Recording:
    """Close the loop of `train`, `driver` and `tachometer`, and run it.

    Args:
        scenario: with these components, not connected yet.
    """
    scenario.connect(
        "driver.effort -> train.effort",
        "train.wheel_speed -> tachometer.wheel_speed",
        "tachometer.reading -> driver.odometer",
    )
    run = scenario.run(warn=lambda _text: None)
    names = ("time", "driver.effort", "tachometer.reading", "train.position")
    return Recording(*(np.asarray(run[name], dtype=float) for name in names))


def settings(name: str, longest: float, model: str) -> tuple[str | None, dict[str, Any]]:
    """Preset and parameters of an observer, by the shipped scenario, its gain certified for the longest gap [s]."""
    table = Scenario.load(SCENARIO).table().components[name]
    values = dict(table.parameters)
    if model == "true":
        values |= {key: value for key, value in TRUE.items() if key in values}
    observer = OBSERVERS[name]()
    if name in FAMILIES:
        found = certified_gains(
            longest,
            lambda theta: {FAMILIES[name]: min(theta, 8.0)},
            lambda gains: next(observer.findings(longest, gains)),  # type: ignore[attr-defined]
        )
        values |= found or {}
    if name == "adaptive_gain_cdo":
        values |= {"theta_min": min(1.0 / longest, 0.25), "theta_max": min(4.0 / longest, 8.0)}
    return table.preset, values


def crossings(recording: Recording, spacing: float, start: float) -> tuple[np.ndarray, np.ndarray]:
    """When the balises are passed [s], and where they lie [m]."""
    places = np.arange(BEGIN + max(start, 0.02) * spacing, recording.position[-1] - 0.5, spacing)
    moving = np.concatenate([[True], np.diff(recording.position) > 0.0])
    return np.interp(places, recording.position[moving], recording.t[moving]), places


def follow(
    name: str, recording: Recording, spacing: float, start: float, model: str = "true", **gate: float
) -> list[Telegram]:
    """Run an observer beside the recording, its gate rejecting, and note every telegram."""
    stamps, places = crossings(recording, spacing, start)
    preset, values = settings(name, float(np.diff(stamps, prepend=0.0).max()), model)
    return beside(name, preset, values | gate, recording, stamps, places)


def beside(
    name: str,
    preset: str | None,
    values: Mapping[str, Any],
    recording: Recording,
    stamps: np.ndarray,
    places: np.ndarray,
    step: float | None = None,
) -> list[Telegram]:
    """Run an observer beside the recording, its gate rejecting, and note the telegrams of balises at `places` [m],
    passed at `stamps` [s]; in internal steps of its own, or of `step` [s].
    """
    observer = OBSERVERS[name]()
    starts = {s.name for s in observer.states}
    runtime = Runtime(observer)
    own = {key: value for key, value in values.items() if key not in starts and key != "internal_step"}
    runtime.p[:] = parameter_values(observer, {"gate": 2.0, **own}, preset)
    if step is not None:
        runtime.p[scalar_names(observer.parameter_signals).index("internal_step")] = step
    p, inputs = observer.unpack_parameters(runtime.p.copy()), scalar_names(observer.input_signals)
    for key, value in values.items():
        if key in starts:
            runtime.x[scalar_names(observer.states).index(key)] = value
    runtime.start(0.0)
    found, following = [], 0
    for k, t in enumerate(recording.t[:-1]):
        for signal, column in (("effort", recording.effort), ("odometer", recording.odometer)):
            if signal in inputs:
                runtime.u[inputs.index(signal)] = column[k]
        while following < len(stamps) and stamps[following] <= recording.t[k + 1]:
            runtime.advance(max(float(stamps[following]), float(t)))
            found.append(_reported(observer, runtime, float(places[following]), p, float(recording.odometer[k])))
            runtime.u[inputs.index("balise_position")] = places[following]
            runtime.trigger("balise")
            following += 1
        runtime.advance(float(recording.t[k + 1]))
    return found


def _reported(observer: TrainObserver, runtime: Runtime, place: float, p: Any, odometer: float) -> Telegram:
    names = scalar_names(observer.states)
    first = names.index(VERDICT)
    memory = GateMemory(*runtime.x[first : first + len(GATE_MEMORY)].tolist())
    estimate = float(runtime.x[names.index(observer.position_state)])
    offsets = np.concatenate([[0.0], OFFSETS, -OFFSETS])
    bound = float(observer.own_bound(observer.unpack_states(runtime.x), p))
    used = np.asarray(
        evaluate(memory, ReportedPlace(place + offsets, 0.0, estimate, bound, odometer, runtime.t), p).used
    )
    settled = memory.settled >= p.gate_recover
    return Telegram(estimate - place, settled, used[0] == 0.0, used[1:].reshape(2, -1).mean(axis=0))


def accepted_false(telegrams: Sequence[Telegram]) -> np.ndarray:
    """Share of false telegrams that would have been used, by `OFFSETS`: forward and backward, at every telegram once
    settled.
    """
    settled = [t.false_used for t in telegrams if t.settled]
    return np.mean(settled, axis=0) if settled else np.full(len(OFFSETS), np.nan)


def ignored_true(telegrams: Sequence[Telegram]) -> float:
    """Share of the true telegrams that were ignored, once settled."""
    settled = [t.ignored for t in telegrams if t.settled]
    return float(np.mean(settled)) if settled else float("nan")


def study(observers: Sequence[str], spacings: Mapping[float, Sequence[float]] = SPACINGS) -> dict[Any, list[Telegram]]:
    """All telegrams, by rails, model, observer and spacing."""
    recordings = {rails: record(rails) for rails in RAILS}
    return {
        (rails, model, name, spacing): [
            t for start in starts for t in follow(name, recordings[rails], spacing, start, model)
        ]
        for name in observers
        for rails in RAILS
        for model in MODELS
        for spacing, starts in spacings.items()
    }


def tables(results: Mapping[Any, list[Telegram]]) -> str:
    """Ignored true and used false telegrams as markdown, by observer and spacing [%]: least and most of both rails and
    both models.
    """
    head = "| observer | spacing | telegrams | true ignored | " + " | ".join(f"+-{o:g} m" for o in STATED_OFFSETS)
    lines = [head + " |", "|" + "---|" * (4 + len(STATED_OFFSETS))]
    for name, spacing in dict.fromkeys(key[2:] for key in results):
        each = [telegrams for key, telegrams in results.items() if key[2:] == (name, spacing)]
        count = sum(t.settled for telegrams in each for t in telegrams)
        false = np.transpose([np.interp(STATED_OFFSETS, OFFSETS, accepted_false(telegrams)) for telegrams in each])
        cells = " | ".join(_span(shares) for shares in ([ignored_true(t) for t in each], *false))
        lines.append(f"| `{name}` | {spacing:g} m | {count} | {cells} |")
    return "\n".join(lines)


def _span(shares: Sequence[float]) -> str:
    """Least and most of shares, in per cent."""
    least, most = (f"{100.0 * share:.2g}".replace("1e+02", "100") for share in (min(shares), max(shares)))
    return least if least == most else f"{least} to {most}"


def draw(results: Mapping[Any, list[Telegram]], path: Path = PICTURE) -> None:
    """Used false telegrams over the offset, one panel for each rail and spacing, models drawn and dashed."""
    import matplotlib as mpl  # noqa: PLC0415 - only to draw

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(
        len(RAILS), len(SPACINGS), figsize=(18, 7), sharex=True, sharey=True, layout="constrained"
    )
    colours = {name: f"C{i}" for i, name in enumerate(dict.fromkeys(key[2] for key in results))}
    for row, rails in zip(axes, RAILS, strict=True):
        for ax, spacing in zip(row, SPACINGS, strict=True):
            shown = {key: t for key, t in results.items() if (key[0], key[3]) == (rails, spacing)}
            for (_, model, name, _), telegrams in shown.items():
                label, style = (name, "-") if model == "true" else (None, "--")
                share = 100.0 * accepted_false(telegrams)
                ax.semilogx(OFFSETS, share, style, color=colours[name], label=label, lw=1.2)
            worst = max(np.nan_to_num(100.0 * ignored_true(t)) for t in shown.values())
            ax.set_title(f"{rails}, a balise every {spacing:g} m; at most {worst:.2g} % of true ignored", fontsize=8)
            ax.grid(alpha=0.3)
    for ax in axes[-1]:
        ax.set_xlabel("offset of the false telegram [m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("false telegrams used [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=110)


def main(arguments: list[str]) -> None:
    """Print the tables and draw the picture."""
    results = study(arguments or STUDIED)
    print(tables(results))
    if not arguments:
        draw(results)


if __name__ == "__main__":
    main(sys.argv[1:])
