"""Second academic example: the ball of the error by bandwidth of the noise and by premises."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from academic import final_quarter, followed
from shared.sheet import Sheet

NAME = "non_triangularisable_example"
NO_NOISE = (
    "published: the error goes to zero without noise. That is so with estimated premises only; printed are weights "
    "frozen "
    "at the samples. An independent implementation gave 8e-8 estimated, 0.023 live, 0.043 frozen"
)
BANDWIDTH = (
    "published: a ball of radius 0.02 for noise up to 0.3, without the bandwidth of the noise, on which it depends. An "
    "independent implementation gave 0.019, 0.035, 0.030 rms for noise held 1, 5, 10 ms (one seed; 5 s of one spread "
    "by a "
    "third), and 0.100 for 100 ms (median of 8 seeds); single seeds lie between 0.06 and 0.13 there, so ours is a "
    "median as well"
)
HOLDS = {0.001: 0.02, 0.005: None, 0.01: None, 0.1: None}  # [s] and the published radius
SEEDS = {0.1: range(12)}  # by holding time; one seed elsewhere


def main() -> None:
    """Errors without noise by premises, with noise by its holding time."""
    sheet = Sheet(
        __file__, "Second academic example, not triangularisable", "Bouchama 2024, section 2.5.2, Figures 2.4-2.10"
    )
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for premise in ("estimated", "live", "frozen"):
        t, found = followed(NAME, premise)
        value = final_quarter(t, found)[0]
        published = 0.0 if premise == "frozen" else None
        sheet.add(
            f"largest error norm, 15 to 20 s, no noise, {premise} premises",
            "1",
            published,
            value,
            NO_NOISE,
            repeats=0.05,
        )
        axes[0].semilogy(t, np.linalg.norm(found, axis=1) + 1e-12, lw=0.8, label=f"{premise} premises")
    for hold, published in HOLDS.items():
        seeds = SEEDS.get(hold, (0,))
        runs = [followed(NAME, "estimated", seed, noise=0.3, hold=hold) for seed in seeds]
        largest, rms = np.median([final_quarter(*run) for run in runs], axis=0)
        evaluated = f", median of {len(seeds)} seeds" if len(seeds) > 1 else ""
        words = f"15 to 20 s, noise up to 0.3 held {1e3 * hold:g} ms{evaluated}"
        sheet.add(f"rms of the error norm, {words}", "1", published, rms, BANDWIDTH)
        sheet.add(f"largest error norm, {words}", "1", None, largest, BANDWIDTH)
        t, found = runs[0]
        step = max(1, round(0.01 / hold))
        axes[1].plot(t[::step], np.linalg.norm(found[::step], axis=1), lw=0.6, label=f"noise held {1e3 * hold:g} ms")
    axes[1].axhline(0.02, color="k", ls="--", label="published ball")
    axes[1].set_ylim(0.0, 0.5)
    for axis in axes:
        axis.set(xlabel="time [s]", ylabel="norm of the error [1]")
    sheet.finish(figure, *axes)


if __name__ == "__main__":
    main()
