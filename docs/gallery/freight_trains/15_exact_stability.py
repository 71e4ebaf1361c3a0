"""Exact stability of the printed Takagi-Sugeno gains: the contraction from sample to sample, and the gaps they
stand.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.observers.generic.sampled import GeneralTakagiSugenoCdo
from fmu_observer.observers.train import TakagiSugenoCdo

EXAMPLES = {  # gap of the thesis [s], independent: contraction by vertex, first unstable gap
    "triangularisable_example": ("E1", 0.2, "0.837 and 0.711, unstable from 0.247 s on"),
    "non_triangularisable_example": ("E2", 0.4, "0.629 to 0.744, stable up to 1.2 s at least"),
    "takagi_sugeno_train": ("train", 0.5, "2.7226, unstable from 0.286 s on"),
}
DECAYS = (3.0, 6.0, 8.0, 9.9, 12.0, 15.0)  # [1/s]
LIMITS = (
    "published: stable at mixed gaps up to 0.5 s for eta = 3 1/s. An independent implementation gave 0.286, 0.50, "
    "0.73, "
    "0.985, 1.28 s for constant gaps at eta = 3, 6, 8, 9.9, 12 1/s and 0.286, 0.496, 0.713, 0.779, 0.740, 0.637 s for "
    "mixed"
    " ones up to 15 1/s"
)


def examples(sheet: Sheet) -> None:
    """Contraction at the gap of the thesis; published is that the observer is stable there, a factor below 1."""
    for name, (short, gap, independent) in EXAMPLES.items():
        vertices = GeneralTakagiSugenoCdo(name).vertex_errors(preset="as_published")
        why = f"published: the error decays at this gap. An independent implementation gave for {short}: {independent}"
        largest = max(v.spectral_radius(gap) for v in vertices)
        sheet.add(f"{short}: growth of the error from sample to sample at {gap:g} s", "1", "below 1", largest, why)
        unstable = min(first_unstable_gap((v,), 20.0) for v in vertices)
        measured = unstable if np.isfinite(unstable) else "none up to 20 s"
        sheet.add(f"{short}: first unstable constant gap", "s", None, measured, why)


def decays(sheet: Sheet) -> dict[float, tuple[float, float]]:
    """Limits of the train's printed gains by the decay of the innovation."""
    limits = {}
    for eta in DECAYS:
        found = next(TakagiSugenoCdo().findings(0.25, {"innovation_decay": eta}))
        limits[eta] = (found.condition(CONSTANT_GAP).limit, found.limit)
        published = (0.5, 0.5) if eta == 3.0 else (None, None)
        for words, claim, limit in zip(("constant", "mixed"), published, limits[eta], strict=True):
            measured = limit if np.isfinite(limit) else "none found"
            sheet.add(
                f"printed gains of the train, eta {eta:g} 1/s: limit for {words} gaps", "s", claim, measured, LIMITS
            )
    return limits


def main() -> None:
    """The tables, and the growth over the gap by eta."""
    sheet = Sheet(
        __file__, "Exact stability of the printed Takagi-Sugeno gains", "Bouchama 2024, sections 2.5.1, 2.5.2, (3.48)"
    )
    examples(sheet)
    limits = decays(sheet)
    figure, (growth, stable) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    gaps, observer = np.linspace(0.01, 1.2, 240), GeneralTakagiSugenoCdo("takagi_sugeno_train")
    for eta in (3.0, 6.0, 9.9):
        vertex = observer.vertex_errors({"innovation_decay": eta}, preset="as_published")[0]
        growth.plot(gaps, [vertex.spectral_radius(float(gap)) for gap in gaps], label=f"eta = {eta:g} 1/s")
    growth.axhline(1.0, color="k", lw=0.8)
    growth.set(xlabel="constant gap [s]", ylabel="growth from balise to balise [1]", ylim=(0.0, 4.0))
    for column, words in enumerate(("constant gaps", "mixed gaps")):
        stable.plot(list(limits), [limit[column] for limit in limits.values()], "o-", label=words)
    stable.axhline(0.5, color="k", ls="--", lw=0.8, label="gap of the thesis")
    stable.set(xlabel="decay of the innovation eta [1/s]", ylabel="longest stable gap [s]")
    sheet.finish(figure, growth, stable)


if __name__ == "__main__":
    main()
