"""Signals that train observers share: estimates, balises, the odometer, and the train that they know. Data only."""

from __future__ import annotations

from dataclasses import replace

from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from plant_models.hybrid import TriggeredEvent, discrete_output, input_signal, memory, output_signal, parameter, state

POSITION = state("estimated_position", "m", 0.0, "Estimate of the train position")
SPEED = state("estimated_speed", "m/s", 1.0, "Estimate of the train speed")
MOTION = (POSITION, SPEED)
BALISE_INNOVATION = state("balise_innovation", "m", 0.0, "Position error seen at the last balise, decaying since")
BALISE = TriggeredEvent(
    "balise",
    (input_signal("balise_position", "m", 0.0, "Position of the balise just passed", variability="discrete"),),
    "A balise is passed, at its own time stamp",
)

LAST_INNOVATION = memory("last_innovation", "m", 0.0, "Position error seen at the last balise")
BALISES_USED = memory("balises_used", "1", 0.0, "Balises used so far")
ODOMETER = input_signal("odometer", "m/s", 0.0, "Odometer speed")
BALISE_AND_ODOMETER = (BALISE, replace(ODOMETER_SAMPLE, samples=("odometer",)))
"""Events of an observer that takes the odometer at its samples."""

POSITION_OUTPUT = output_signal("position", "m", "Estimated position")
SPEED_OUTPUT = output_signal("speed", "m/s", "Estimated speed", display_unit="km/h")
INNOVATION_OUTPUT = discrete_output("innovation", "m", "Estimated minus true position at the last balise")
MOTION_OUTPUTS = (POSITION_OUTPUT, SPEED_OUTPUT)

TRAIN_PARAMETERS = (
    parameter("mass", "kg", 90000.0, "Train mass", min=1.0),
    parameter("davis_a", "N", 900.0, "Running resistance, constant term", min=0.0),
    parameter("davis_b", "N.s/m", 32.4, "Running resistance, linear term", min=0.0),
    parameter("davis_c", "N.s2/m2", 1.65287, "Running resistance, quadratic term", min=0.0),
)
