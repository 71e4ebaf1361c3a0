"""What the diagnosis of a train remembers. Data only."""

from __future__ import annotations

from fmu_observer.detection.train_isolation import FAULTS, RESIDUALS
from plant_models.hybrid import Signal, memory, state

CONTINUOUS = (
    state("estimated_position", "m", 0.0, "Position by dead reckoning from the last balise"),
    state("way", "m", 0.0, "Ways of first odometer, second odometer and radar since the start", size=3),
    state("modelled_pressure", "Pa", 0.0, "Pressure in the brake cylinder by the demand"),
)


_FIXED = (
    memory("gps_samples", "1", 0.0, "Samples since the satellite positions began"),
    memory("samples", "1", 0.0, "Samples so far"),
    memory("voted_speed", "m/s", 0.0, "Speed that is believed"),
    memory("ratio", "1", 0.0, "Residuals over their thresholds", size=len(RESIDUALS)),
    memory("raised", "1", 0.0, "Alarms", size=len(RESIDUALS)),
    memory("contrary", "1", 0.0, "Samples in a row that speak against an alarm as it is", size=len(RESIDUALS)),
    memory("since", "s", 0.0, "Instants at which alarms changed", size=len(RESIDUALS)),
    memory("group_since", "s", -1.0, "Since when alarms of motion, brake, traction are raised; -1 none", size=3),
    memory("telegrams", "1", 0.0, "Balises so far"),
    memory("refused", "1", 0.0, "1 where the last balise was refused"),
    memory("telegram_verdict", "1", 0.0, "0 used, 2 refused: the last balise"),
    memory("mark", "m", 0.0, "Position of the last balise that was used"),
    memory("way_mark", "m", 0.0, "Ways at that balise", size=3),
    memory("faulty", "1", 0.0, "1 where odometers and radar were at fault since the last balise", size=3),
    memory("disagree", "1", 0.0, "1 for odometers and radar whose ways the last balise contradicts", size=3),
    memory("against_wheel", "s", 0.0, "Time for which no wheel explains the odometers", size=2),
    memory("last_reading", "1", 0.0, "Readings of odometers, radar, satellites, pressure at the last sample", size=5),
    memory("then", "1", 0.0, "Speed, position or pressure believed when each of them changed last", size=5),
    memory("since_pull", "s", 1e3, "Time since the train pulled"),
    memory("since_brake", "s", 1e3, "Time since it braked"),
    memory("code", "1", 0.0, "Fault codes", size=len(FAULTS)),
    memory("detected_at", "s", -1.0, "Instant of the last detection; -1 none"),
    memory("trust", "1", 0.0, "Confidence of the verdict"),
    memory("several", "1", 0.0, "1 where no single fault explains the alarms"),
    memory("coarse_sum", "1", 0.0, "Sums of the coarse step that runs", size=5),
    memory("coarse_samples", "1", 0.0, "Samples in the coarse step that runs"),
    memory("quiet_steps", "1", 0.0, "Coarse steps since speeds disagreed"),
)
_SHARES = (
    memory("share", "1", 1.0, "Shares of traction, brake by measured, brake by demanded pressure", size=3),
    memory("share_found", "1", 0.0, "1 where the grid held the share that was found last", size=3),
)


def remembered(speed_window: int, gps_window: int, force_window: int) -> tuple[Signal, ...]:
    """The memory.

    Args:
        speed_window: samples N of a pair of speeds. gps_window: samples L of a difference of satellite positions.
        force_window: coarse steps M of the window of forces.
    """
    n = speed_window - 1
    return (
        memory("squares_odometers", "1", 0.0, "Squares of the pair of odometers", size=n),
        memory("squares_first_radar", "1", 0.0, "Squares of first odometer and radar", size=n),
        memory("squares_second_radar", "1", 0.0, "Squares of second odometer and radar", size=n),
        memory("lead_first", "m", 0.0, "Leads of the satellite position over the first odometer", size=gps_window),
        memory("lead_second", "m", 0.0, "Leads of the satellite position over the second odometer", size=gps_window),
        memory("lead_radar", "m", 0.0, "Leads of the satellite position over the radar", size=gps_window),
        *_FIXED,
        memory("mean_speed", "m/s", 0.0, "Mean speeds of the coarse steps", size=force_window),
        memory("mean_drive", "m/s2", 0.0, "Acceleration by traction as asked for", size=force_window),
        memory("mean_measured", "m/s2", 0.0, "Deceleration by the measured pressure", size=force_window),
        memory("mean_demanded", "m/s2", 0.0, "Deceleration by the pressure asked for", size=force_window),
        memory("mean_other", "m/s2", 0.0, "Acceleration by electric brake and gradient", size=force_window),
        *_SHARES,
    )
