"""Partial inversion for the culture of E. coli; Figures 4.26 to 4.32."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from windows import Record, driven, recorded, rms

from fmu_observer.observers.signature import CultureSignature
from fmu_observer.observers.signature.culture_signature import in_tube
from plant_models.benchmarks import EcoliCulture
from plant_models.benchmarks.ecoli_culture import HOUR

SAMPLE = 0.1 * HOUR
SEEDS = 6
GUESS = {"estimated_biomass": 0.05, "estimated_glycerol": 1.6, "estimated_enzyme": 0.03}
NETWORK = "with norm scaling both quantities move the properties in one direction, here and there"
CLEAN = "the network is computed for the biomass at hand, 3 x 3 nodes, and inverted between them; there 21 x 21 nodes"
NOISE = (
    "the printed level is lost; noise is that share of each value, uniform, mean of six seeds. Independent: not said "
    "how its noise was spread"
)
WEIGHTED = (
    "21 x 21 nodes of the tube, weighted by exp(-mu distance) on axes from 0 to 1, uniform noise, mean of six seeds. "
    "The mean draws towards the middle of the tube, which is the nominal run, and that is the truth here: flat weights "
    "(mu = 20) have the independent numbers within a third, but for the look-up of enzyme; sharp ones (mu = 200) those "
    "of the network. How there was looked up is not stated"
)
OPEN = "over 3 h to 7 h, guess as there; where its mean ends is not said"
INDEPENDENT = {
    ("clean", "q"): (0.034, 0.0015),
    ("1 %", "q"): (0.048, 0.0022),
    ("3 %", "q"): (0.079, 0.0063),
    ("clean", "open"): (0.389, 0.017),
    ("1 %", "look-up"): (0.119, 0.0040),
}
OTHER = {"q": (0.125, 0.0026), "open": (0.570, 0.028)}


def main() -> None:
    """Nominal run, gain, network, and errors after 3 h."""
    sheet = Sheet(
        __file__, "Culture of E. coli: glycerol and enzyme of light", "Omar 2012, section 4.7, Figs. 4.26-4.32"
    )
    true = recorded(EcoliCulture(), 7.0 * HOUR, SAMPLE)
    for name, row, independent in (
        ("biomass", 50, 0.531), ("glycerol", 50, 1.423), ("enzyme", 50, 0.159),
        ("biomass", 70, 1.321), ("glycerol", 70, 0.459), ("enzyme", 70, 0.405),
    ):  # fmt: skip
        sheet.add(f"{name} after {row // 10} h", "kg/m3", None, true[name][row], "", independent=independent)
    ks, S = 0.06, 1.5
    rates = [s / (ks + s) for s in (S - 1e-4, S + 1e-4)]
    sheet.add(
        "change of mu / mu_m with S at 1.5 (4.7.10)",
        "m3/kg",
        0.025,
        (rates[1] - rates[0]) / 2e-4,
        "printed rounded",
        independent=0.02465,
    )
    for scaling, independent in (("literal", 0.52), ("norm", 0.058)):
        text = f"sine of the angle between S and P in (r1, r2) at X = 0.5, {scaling}, eps = 0.001"
        sheet.add(text, "1", None, angle(CultureSignature(3, scaling), 1e-3), NETWORK, independent=independent)
    observer = CultureSignature()
    late = true["time"] >= 3.0 * HOUR
    clean = np.stack([true["measured_biomass"], true["measured_light"]], axis=1)
    shown = {}
    for level, share in (("clean", 0.0), ("1 %", 0.01), ("3 %", 0.03)):
        found = []
        for seed in range(SEEDS if share else 1):
            spread = np.random.default_rng(seed).uniform(-share, share, clean.shape)
            told = driven(observer, clean * (1.0 + spread), **GUESS)
            found.append(
                [[rms(told, true, n, late, n + up) for n in ("glycerol", "enzyme")] for up in ("", "_look_up")]
            )
        shown[level] = told
        errors = np.mean(found, axis=0)
        for kind, pair in zip(("q", "look-up"), errors, strict=True):
            beside = INDEPENDENT.get((level, kind))
            for i, name in enumerate(("glycerol", "enzyme")):
                label = "look-up alone" if kind == "look-up" else "q = 0.3"
                other = None if beside is None else beside[i]
                text = f"RMSE of {name} after 3 h, noise {level}, {label}".replace("noise clean", "no noise")
                sheet.add(text, "kg/m3", None, pair[i], NOISE if share else CLEAN, independent=other)
    alone = driven(observer, clean, gain=0.0, **GUESS)
    for i, name in enumerate(("glycerol", "enzyme")):
        text = f"RMSE of {name} after 3 h, model alone"
        error = rms(alone, true, name, late)
        sheet.add(text, "kg/m3", None, error, OPEN, independent=INDEPENDENT["clean", "open"][i])
    start = {"biomass_state": 0.06, "glycerol_state": 2.2, "enzyme_state": 0.012}
    other_run = recorded(EcoliCulture(), 7.0 * HOUR, SAMPLE, **start)
    measured = np.stack([other_run["measured_biomass"], other_run["measured_light"]], axis=1)
    for kind, gain in (("q", 0.3), ("open", 0.0)):
        told = driven(observer, measured, gain=gain, **GUESS | {"estimated_biomass": 0.06})
        for i, name in enumerate(("glycerol", "enzyme")):
            text = f"RMSE of {name} after 3 h, start (0.06, 2.2, 0.012), " + ("q = 0.3" if gain else "model alone")
            why = OPEN if kind == "open" else CLEAN
            sheet.add(text, "kg/m3", None, rms(told, other_run, name, late), why, independent=OTHER[kind][i])
    add_weighted(sheet, observer, [clean, measured], [true, other_run])
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
    for name in ("biomass", "glycerol", "enzyme"):
        axes[0].plot(true["time"] / HOUR, true[name], label=name)
    axes[0].set(xlabel="time [h]", ylabel="[kg/m3]", title="nominal run")
    axes[0].legend(fontsize=7)
    for axis, name in zip(axes[1:], ("glycerol", "enzyme"), strict=True):
        axis.plot(true["time"] / HOUR, true[name], "k", label="true")
        axis.plot(true["time"] / HOUR, shown["1 %"][name], label="q = 0.3, noise 1 %")
        axis.plot(true["time"] / HOUR, shown["1 %"][f"{name}_look_up"], ".", ms=3, label="look-up alone")
        axis.plot(true["time"] / HOUR, alone[name], "--", label="model alone")
        axis.set(xlabel="time [h]", ylabel=f"{name} [kg/m3]")
    axes[1].legend(fontsize=7)
    sheet.finish(figure)


def add_weighted(sheet: Sheet, observer: CultureSignature, measured: list[np.ndarray], truths: list[Record]) -> None:
    """Errors of a look-up by weights, all runs at once: the clean one, each seed and level of noise, another start."""
    share = np.concatenate([[0.0], np.repeat([0.01, 0.03], SEEDS), [0.0]])
    noise = [
        np.random.default_rng(seed).uniform(-1.0, 1.0, measured[0].shape)
        for seed in (0, *range(SEEDS), *range(SEEDS), 0)
    ]
    runs = [measured[0]] * (1 + 2 * SEEDS) + [measured[1]]
    told = np.stack([run * (1.0 + s * n) for run, s, n in zip(runs, share, noise, strict=True)], axis=1)
    truth = np.stack([[t[name] for t in truths] for name in ("glycerol", "enzyme")])[:, [0] * (1 + 2 * SEEDS) + [1]]
    parts = {"no noise": slice(0, 1), "noise 1 %": slice(1, 1 + SEEDS), "noise 3 %": slice(1 + SEEDS, -1)}
    parts["start (0.06, 2.2, 0.012)"] = slice(-1, None)
    late = truths[0]["time"] >= 3.0 * HOUR
    for sharpness, kinds in zip((20.0, 200.0), weighted_runs(observer, told), strict=True):
        for kind, estimates in zip(("q = 0.3", "look-up alone"), kinds, strict=True):
            error = np.sqrt(np.mean((estimates - truth)[..., late] ** 2, axis=-1))
            for level, part in parts.items():
                key = level.removeprefix("noise ").replace("no noise", "clean"), kind.split()[0].rstrip(",")
                beside = OTHER.get(key[1]) if level.startswith("start") else INDEPENDENT.get(key)
                if beside is None:
                    continue
                for i, name in enumerate(("glycerol", "enzyme")):
                    text = f"RMSE of {name} after 3 h, {level}, {kind}, weighted, mu = {sharpness:g}"
                    sheet.add(text, "kg/m3", None, error[i, part].mean(), WEIGHTED, independent=beside[i])


def weighted_runs(observer: CultureSignature, told: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Estimates with q = 0.3 and look-ups of each run, shape (2, runs, samples) each, for sharpness 20 and 200.

    `told`: measured biomass and light, shape (samples, runs, 2).
    """
    p = observer.unpack_parameters(observer.start_parameters())
    side, runs, last = np.linspace(-1.0, 1.0, 21), told.shape[1], observer.window - 1
    state = np.array([told[0, :, 0], np.full(runs, 1.6), np.full(runs, 0.03)])
    states = [state, state]
    found: list[tuple[list[np.ndarray], list[np.ndarray]]] = [([], []), ([], [])]
    for k in range(len(told)):
        ahead = [observer.moved(x, 1, p)[-1] if k else x for x in states]
        looked = [x[1:] for x in ahead]
        if k >= last:
            X = told[k - last, :, 0]
            S = np.interp(X, p.nominal_biomass, p.nominal_glycerol) + p.glycerol_width * side[:, None, None]
            P = np.interp(X, p.nominal_biomass, p.nominal_enzyme) + p.enzyme_width * side[:, None]
            nodes = in_tube(*np.broadcast_arrays(X, S, P))
            light = np.stack([observer.plant.measured_under(x, p)[1] for x in observer.moved(nodes, last, p)])
            network = observer.properties(light, p.regularisation)
            target = observer.properties(told[k - last : k + 1, :, 1], p.regularisation)
            size = np.ptp(network, axis=(1, 2), keepdims=True)
            distance = np.hypot(*((network - target[:, None, None]) / size))
            starts = []
            for sharpness in (20.0, 200.0):
                weights = np.exp(-sharpness * (distance - distance.min(axis=(0, 1))))
                weights /= weights.sum(axis=(0, 1))
                starts.append(in_tube(X, *((weights * nodes[1 + i]).sum(axis=(0, 1)) for i in range(2))))
            now = observer.moved(np.stack(starts, axis=1), last, p)[-1]
            looked = [now[1:, i] for i in range(2)]
        for i in range(2):
            new = (ahead[i][1:] + 0.3 * looked[i]) / 1.3 if k >= last else ahead[i][1:]
            states[i] = in_tube(told[k, :, 0], *new)
            found[i][0].append(states[i][1:])
            found[i][1].append(looked[i])
    return [(np.stack(a, axis=-1), np.stack(b, axis=-1)) for a, b in found]


def angle(observer: CultureSignature, eps: float) -> float:
    """Sine of the angle in which glycerol and enzyme move the two properties at X = 0.5."""
    p = observer.unpack_parameters(observer.start_parameters())
    states = np.array([[0.5] * 4, [1.86, 1.06, 1.46, 1.46], [0.15, 0.15, 0.19, 0.11]])
    light = np.stack([observer.plant.measured_under(x, p)[1] for x in observer.moved(states, 7, p)])
    found = observer.properties(light, eps)
    a, b = found[:, 0] - found[:, 1], found[:, 2] - found[:, 3]
    return float(abs(a[0] * b[1] - a[1] * b[0]) / np.linalg.norm(a) / np.linalg.norm(b))


main()
