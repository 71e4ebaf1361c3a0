"""What the scripts of chapter 2's academic examples share: the plants, what their observers see of them, sizes of
errors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from shared.runner import Together, errors, sampling

from fmu_observer.observers.generic.sampled import GeneralTakagiSugenoCdo
from plant_models.exhibits import NonTriangularisablePlant, TriangularisablePlant

EXAMPLES = {  # plant, longest gap [s], instant of the first drop-outs [s]
    "triangularisable_example": (TriangularisablePlant, 0.2, 6.7),
    "non_triangularisable_example": (NonTriangularisablePlant, 0.4, 4.97),
}
STOP = 20.0


def followed(example: str, premise: Any, seed: int = 0, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and errors of the Takagi-Sugeno observer with the printed gains; noise on the continuous output by
    `options`.

    The seed is that of the instants and of the noise.
    """
    plant, gap, loss = EXAMPLES[example]
    observer = GeneralTakagiSugenoCdo(example, premise)

    def seen(values: Any, noise: Any) -> dict[str, Any]:
        named = {"drive": values["total_drive"]}
        named |= {f"measured_{s.name}": values[s.name] + noise for s in observer.model.continuous}
        return named | {f"sample_{s.name}": values[s.name] for s in observer.model.sampled}

    pair = Together(plant(), observer, seen, preset="as_published")
    return errors(pair, STOP, {observer.model.event: sampling(gap, STOP, seed, loss)}, seed=seed, **options)


def final_quarter(t: np.ndarray, found: np.ndarray) -> tuple[float, float]:
    """Largest and root-mean-square norm of the error in the last quarter."""
    norms = np.linalg.norm(found[t > 0.75 * STOP], axis=1)
    return float(norms.max()), float(np.sqrt(np.mean(norms**2)))


if __name__ == "__main__":
    raise SystemExit("Run 12_triangularisable_example.py or 13_non_triangularisable_example.py.")
