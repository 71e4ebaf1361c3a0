"""The gate against true and false telegrams: every train observer, clean and slippery rails, balises near and far.

``python docs/studies/telegram_gate.py`` prints the tables of docs/telegram_gate.md and draws
docs/images/telegram_gate.png.

The plant is run once on each rail; the observers run beside the recording, with gains certified for the longest gap
between two balises (the adaptive one by its rule, the discrete one with its fixed gains). At each true telegram the
gate is also asked what it would say to a false one there: a position that is off by so much.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim import Scenario
from fmu_observer import OBSERVERS
from fmu_observer.design.augmented_gains import design_for_gap
from fmu_observer.design.certified_gains import balise_family, certified_gains
from fmu_observer.observers.innovation_gate import GATE_MEMORY, GateMemory, Told, gate_limit
from fmu_observer.observers.parameter_values import parameter_values
from fmu_observer.observers.train import TrainObserver
from plant_models.hybrid import Runtime, scalar_names

SCENARIO, RAILS = "freight_profile_b", ("clean", "slippery")
SPACINGS = (5.0, 20.0, 100.0, 300.0)  # [m]
OFFSETS = np.geomspace(0.1, 1000.0, 81)  # [m]
TOLD_OFFSETS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0)  # [m], of the table
STARTS = (0.0, 0.25, 0.5, 0.75)  # of a spacing: where the first balise lies, a run each
STEP = 0.01  # [s]
PICTURE = Path(__file__).parents[1] / "images" / "telegram_gate.png"
TRAIN = {"n_axles": 1.0, "davis_b": 32.0, "davis_c": 1.7}
SHARE = 1.5  # of the adaptive gain: theta_min times the longest gap


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
    """A true telegram: its innovation, the limit [m], and whether the gate had settled and doubted it."""

    innovation: float
    limit: float
    settled: bool
    doubted: bool


def record(rails: str, stop: float = 95.0) -> Recording:
    """Run the plant of the shipped scenario without observers."""
    scenario = Scenario(stop=stop, step=STEP)
    zones = {"zone_from": [10.0, 40.0, 70.0], "zone_to": [20.0, 50.0, 80.0]}
    none = {"zone_from": [1e6, 1e6 + 2.0, 1e6 + 4.0], "zone_to": [1e6 + 1.0, 1e6 + 3.0, 1e6 + 5.0]}
    shipped = Scenario.load(SCENARIO).table().components
    driver = {"preset": shipped["driver"].preset, "parameters": dict(shipped["driver"].parameters)}
    scenario.add(
        "locomotive", model="locomotive", preset="chapter_3", parameters=zones if rails == "slippery" else none
    )
    scenario.add("odometer", model="odometer", parameters={"sample_period": STEP})
    scenario.add("driver", model="driver", **driver)
    scenario.connect(
        "driver.effort -> locomotive.effort",
        "locomotive.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> driver.odometer",
    )
    run = scenario.run(warn=lambda _text: None)
    names = ("time", "driver.effort", "odometer.reading", "locomotive.position")
    return Recording(*(np.asarray(run[name], dtype=float) for name in names))


def gains(observer: TrainObserver, spacing: float, longest: float) -> Mapping[str, Any]:
    """Gains certified for the longest gap [s], of the observer's own family; those that need none keep theirs."""
    if observer.name == "augmented_takagi_sugeno_cdo":
        designed = design_for_gap(longest)
        return {"balise_gain": designed.gains, "balise_decay": designed.decay, "gps_gain": (0.0,) * 4, "gps_decay": 0.0}
    if observer.name == "adaptive_gain_cdo":
        return {"expected_spacing": spacing, "theta_min": min(SHARE / longest, 8.0)}
    families: dict[str, Any] = {
        "differentiator_cdo": lambda theta: {"theta": min(theta, 8.0)},
        "multirate_cdo": lambda theta: {"theta_2": min(theta, 8.0)},
        "takagi_sugeno_cdo": lambda theta: balise_family(min(theta, 8.0)),
        "augmented_high_gain_cdo": lambda theta: {"theta_balise": min(theta, 1.75), "theta_gps": 0.0},
    }
    family = families.get(observer.name)
    found = None if family is None else certified_gains(longest, family, lambda g: observer.certify(longest, g))
    return found or {}


def crossings(recording: Recording, spacing: float, start: float) -> tuple[np.ndarray, np.ndarray]:
    """When the balises are passed [s], and where they lie [m]."""
    places = np.arange(max(start, 0.02) * spacing, recording.position[-1] - 0.5, spacing)
    moving = np.concatenate([[True], np.diff(recording.position) > 0.0])
    return np.interp(places, recording.position[moving], recording.t[moving]), places


def follow(
    observer: TrainObserver, recording: Recording, spacing: float, start: float, **gate: float
) -> list[Telegram]:
    """Run an observer beside the recording, its gate rejecting, and note every telegram."""
    stamps, places = crossings(recording, spacing, start)
    longest = float(np.diff(stamps, prepend=0.0).max())
    runtime = Runtime(observer)
    overrides = {**TRAIN, **gains(observer, spacing, longest), "gate": 2.0, **gate}
    runtime.p[:] = parameter_values(observer, overrides)
    values, inputs = observer.unpack_parameters(runtime.p.copy()), scalar_names(observer.input_signals)
    effort, odometer, told = (inputs.index(name) for name in ("effort", "odometer", "balise_position"))
    runtime.x[1] = 0.0
    runtime.start(0.0)
    found, following = [], 0
    for k, t in enumerate(recording.t[:-1]):
        runtime.u[effort], runtime.u[odometer] = recording.effort[k], recording.odometer[k]
        while following < len(stamps) and stamps[following] <= recording.t[k + 1]:
            runtime.advance(max(float(stamps[following]), float(t)))
            found.append(_told(observer, runtime, float(places[following]), values))
            runtime.u[told] = places[following]
            runtime.trigger("balise")
            following += 1
        runtime.advance(float(recording.t[k + 1]))
    return found


def _told(observer: TrainObserver, runtime: Runtime, place: float, p: Any) -> Telegram:
    memory = GateMemory(*runtime.x[len(runtime.x) - len(GATE_MEMORY) :].tolist())
    estimate = float(runtime.x[observer.position_state])
    limit = float(gate_limit(memory, Told(place, 0.0, estimate, 0.0, None, runtime.t), p))
    settled = memory.settled >= p.gate_recover
    return Telegram(estimate - place, limit, settled, settled and abs(estimate - place) > limit)


def accepted_false(telegrams: Sequence[Telegram], offsets: Iterable[float]) -> np.ndarray:
    """Share of false telegrams that would have been used, by offset: forward and backward, at every telegram once
    settled.
    """
    settled = [t for t in telegrams if t.settled]
    innovation, limit = (np.array([getattr(t, name) for t in settled]) for name in ("innovation", "limit"))
    return np.array(
        [
            np.mean([np.abs(innovation + sign * offset) <= limit for sign in (-1.0, 1.0)]) if settled else np.nan
            for offset in offsets
        ]
    )


def missed_true(telegrams: Sequence[Telegram]) -> float:
    """Share of the true telegrams that were doubted, once settled."""
    settled = [t for t in telegrams if t.settled]
    return float(np.mean([t.doubted for t in settled])) if settled else float("nan")


def study(
    observers: Sequence[str], spacings: Sequence[float] = SPACINGS, starts: Sequence[float] = STARTS
) -> dict[Any, list[Telegram]]:
    """All telegrams, by rails, observer and spacing."""
    recordings = {rails: record(rails) for rails in RAILS}
    return {
        (rails, name, spacing): [
            t
            for start in starts
            for t in follow(OBSERVERS[name](), recordings[rails], spacing, start)  # type: ignore[arg-type]
        ]
        for rails in RAILS
        for name in observers
        for spacing in spacings
    }


def tables(results: Mapping[Any, list[Telegram]]) -> str:
    """Missed true and accepted false telegrams as markdown."""
    head = "| rails | observer | spacing [m] | true telegrams | missed true | " + " | ".join(
        f"+-{o:g} m" for o in TOLD_OFFSETS
    )
    lines = [head + " |", "|" + "---|" * (5 + len(TOLD_OFFSETS))]
    for (rails, name, spacing), telegrams in results.items():
        shares = " | ".join(f"{100.0 * share:.3g}" for share in accepted_false(telegrams, TOLD_OFFSETS))
        missed = f"{100.0 * missed_true(telegrams):.3g}"
        lines.append(
            f"| {rails} | `{name}` | {spacing:g} | {sum(t.settled for t in telegrams)} | {missed} | {shares} |"
        )
    return "\n".join(lines)


def draw(results: Mapping[Any, list[Telegram]], path: Path = PICTURE) -> None:
    """Accepted false telegrams over the offset, one panel for each rail and spacing, and missed true ones beside the
    name.
    """
    import matplotlib as mpl  # noqa: PLC0415 - only to draw

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(
        len(RAILS), len(SPACINGS), figsize=(15, 7), sharex=True, sharey=True, layout="constrained"
    )
    for row, rails in zip(axes, RAILS, strict=True):
        for ax, spacing in zip(row, SPACINGS, strict=True):
            missed = 0.0
            for (_, name, _), telegrams in ((k, v) for k, v in results.items() if (k[0], k[2]) == (rails, spacing)):
                ax.semilogx(OFFSETS, 100.0 * accepted_false(telegrams, OFFSETS), label=name, lw=1.2)
                missed = max(missed, np.nan_to_num(100.0 * missed_true(telegrams)))
            ax.set_title(f"{rails}, a balise every {spacing:g} m; at most {missed:.2g} % of true missed", fontsize=8)
            ax.grid(alpha=0.3)
    for ax in axes[-1]:
        ax.set_xlabel("offset of the false telegram [m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("false telegrams used [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=110)


def main(arguments: list[str]) -> None:
    """Print the tables and draw the picture."""
    results = study(arguments or [name for name in OBSERVERS if OBSERVERS.room(name).endswith(".train")])
    print(tables(results))
    if not arguments:
        draw(results)


if __name__ == "__main__":
    main(sys.argv[1:])
