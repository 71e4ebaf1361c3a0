"""What the program ``life`` is told of a model: inputs to move, outputs to look at, the event to tell."""

from __future__ import annotations

from pathlib import Path

from c_hosts import Unpacked, Wiring

MODELS = ("takagi_sugeno_cdo", "multirate_cdo", "balise_reader", "odometer", "locomotive")
SIZES = {"effort": 2e4, "position": 4.0, "noise_std": 0.1}  # else 14 [m/s]


def life_wiring(fmu: Unpacked, path: Path, library: Path | None = None) -> Path:
    """Write the wiring of one model alone; `library` replaces the FMU's own."""
    if library is not None:
        fmu.library = library
    variables = fmu.description.modelVariables
    clocks = any(v.type == "Clock" for v in variables)
    w = Wiring().slave("one", fmu, clocks)
    names = [v.name for v in variables if v.causality == "input"]
    w.starts("one", {name: SIZES.get(name, 14.0) for name in names if not name.startswith("balise")})
    if "balise_time" in names:
        # the program has values of its own
        payload = {"one.balise_time": "one.time", "one.balise_position": "one.time"}
        w.event("one.time" if clocks else "one.balise_count", "one.balise" if clocks else "one.time", payload)
    reals = [v.name for v in variables if v.causality in ("output", "local") and v.type in ("Real", "Float64")]
    w.record(*(f"one.{name}" for name in reals[:60]))
    return w.write(path)
