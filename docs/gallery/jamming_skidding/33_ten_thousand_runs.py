"""10 000 random runs of the discrete-measurement observer: no bound is ever broken."""

from __future__ import annotations

import matplotlib.pyplot as plt
from shared.bound_runs import Unknown, random_runs
from shared.sheet import Sheet

DESIGNS = {
    "as_published": "gain of 4.3.4",
    "m_0_1_alpha_4": "m 0.1 1/s, alpha 4",
    "m_0_5_alpha_100": "m 0.5 1/s, alpha 100",
    "m_1_alpha_100": "m 1 1/s, alpha 100",
}
RUNS = 2500
SHARE = (
    "not in the thesis: 2500 runs of 5 s for each gain, accelerations up to 1.7 m/s2 either way or anywhere between, "
    "disturbances with a constant rate; a share above 1 would be a broken bound"
)
MORE = (
    "not in the thesis: 0.05 m/s of noise, 0.05 m/s2 of acceleration and 0.05 m/s4 of the disturbance unknown, one "
    "sample of five missing, all of it stated to the bounds"
)
MEAN = "not in the thesis: the mean of the bound over all runs"


def main() -> None:
    """Shares of the bounds over all runs, without and with what is unknown."""
    sheet = Sheet(__file__, "10 000 random runs", "Aguiar Cota 2019, (4.19)")
    found = {words: random_runs(preset, RUNS, seed=k) for k, (preset, words) in enumerate(DESIGNS.items())}
    for words, worst in found.items():
        sheet.add(f"largest share of the i-DMO bound, {words}", "1", None, worst.published, SHARE)
        sheet.add(f"largest share of the carried bound, {words}", "1", None, worst.carried, SHARE)
        sheet.add(f"largest share of error_bound, {words}", "1", None, worst.error, SHARE)
        sheet.add(f"mean carried bound, {words}", "m/s", None, worst.carried_bound, MEAN)
        sheet.add(f"mean error_bound, {words}", "m/s", None, worst.error_bound, MEAN)
    broken = sum(max(w.published, w.carried, w.error, w.position) > 1.0 for w in found.values())
    sheet.add("gains for which a bound was broken", "1", None, float(broken), SHARE, independent=0.0)
    unknown = Unknown(noise=0.05, acceleration=0.05, jerk_rate=0.05, missing=0.2)
    worst = random_runs("m_1_alpha_100", 500, seed=9, unknown=unknown, lost="predicted")
    for name, share in (
        ("carried bound", worst.carried),
        ("error_bound", worst.error),
        ("position_bound", worst.position),
    ):
        sheet.add(f"largest share of the {name}, noise and missing samples", "1", None, share, MORE)
    sheet.add("largest speed error, noise and missing samples", "m/s", None, worst.largest, MORE)
    figure, axis = plt.subplots(figsize=(6, 3.6), layout="constrained")
    shares = {"i-DMO": "published", "carried": "carried", "error_bound": "error", "position_bound": "position"}
    for k, (label, name) in enumerate(shares.items()):
        places = [i + 0.2 * (k - 1.5) for i in range(len(found))]
        axis.bar(places, [getattr(w, name) for w in found.values()], 0.18, label=label)
    axis.axhline(1.0, color="k", lw=0.8)
    axis.set_xticks(range(len(found)), list(found), fontsize=8)
    axis.set(ylabel="largest share of the bound [1]", ylim=(0.0, 1.35))
    axis.legend(fontsize=8, ncols=4)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
