"""Structures of ``stepper.h``: what is handed to the stepper, field by field."""

from __future__ import annotations

import ctypes

from cosim.compiled.journal import CJournal, StepperCall
from cosim.diagnostics.sampled_times import BINS
from fmus.fmi.call_warnings import CONTRADICTIONS

RETURNS_AT_MOST = 256


class CPort(ctypes.Structure):
    """`Port`."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("function", "instance", "references", "values", "raw")),
        *((name, ctypes.c_void_p) for name in ("places", "elements")),
        *((name, ctypes.c_int64) for name in ("count", "reference_count", "raw_count", "raw_bytes", "kind")),
    )


class CSlave(ctypes.Structure):
    """`Slave`."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("instance", "do_step", "stepped", "no_way_back", "left_at")),
        *((name, ctypes.c_void_p) for name in ("writes", "reads")),
        *((name, ctypes.c_int64) for name in ("write_count", "read_count", "fmi_version", "heeds_events")),
        ("usual_step", ctypes.c_double),
        ("rounding", ctypes.c_double),
        ("input_count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("sources", "factors", "offsets", "inputs", "followed")),
        ("calls", ctypes.c_int64),
        ("all_calls", ctypes.c_int64),
        ("sampled_seconds", ctypes.c_double * BINS),
        ("sampled_calls", ctypes.c_int64 * BINS),
        ("now", ctypes.c_double),
        ("left_here", ctypes.c_double),
        ("calls_here", ctypes.c_int64),
        ("more_calls", ctypes.c_int64),
        ("seconds_over", ctypes.c_double),
        *((name, ctypes.c_int64) for name in ("returns_here", "returns", "numbers")),
        ("returns_early", ctypes.c_int64),
        ("contradictions", ctypes.c_int64 * len(CONTRADICTIONS)),
        ("first_contradictions", ctypes.c_double * len(CONTRADICTIONS)),
        ("warnings", ctypes.c_int64 * len(StepperCall)),
        ("first_warnings", ctypes.c_double * len(StepperCall)),
        *((name, ctypes.c_int64) for name in ("special", "every", "in_python")),
        *((name, ctypes.c_void_p) for name in ("save_state", "release_state", "saved")),
    )


class CListener(ctypes.Structure):
    """`Listener`."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("sources", "factors", "offsets", "told")),
    )


class CPlantMonitor(ctypes.Structure):
    """`PlantMonitor`."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("slave", "first_output", "output_count", "position", "speed")),
        *((name, ctypes.c_double) for name in ("position_factor", "position_offset", "speed_factor", "speed_offset")),
        ("acceleration_limit", ctypes.c_double),
        ("places", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("place_count", "cursor")),
    )


class CPassed(ctypes.Structure):
    """`Passed`."""

    _fields_ = (
        ("which", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("stamp", "position", "speed", "reading")),
    )


class _CBalises(ctypes.Structure):
    """`Balises`."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("on", "by_instant")),
        ("instants", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("instant_count", "next_instant")),
        *(
            (name, ctypes.c_void_p)
            for name in ("recorded", "accuracies", "save_state", "restore_state", "release_state")
        ),
        ("odometer", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("continuous", "telegrams", "start", "final", "there", "arrived")),
        ("passed", ctypes.POINTER(CPassed)),
        ("outcomes", ctypes.POINTER(ctypes.c_int64)),
        *((name, ctypes.c_int64) for name in ("passed_count", "passed_limit", "steps")),
    )


class CProgram(ctypes.Structure):
    """`Program`."""

    _fields_ = (
        *((name, ctypes.c_double) for name in ("start", "step")),
        ("values", ctypes.c_void_p),
        ("value_count", ctypes.c_int64),
        ("slaves", ctypes.c_void_p),
        ("slave_count", ctypes.c_int64),
        ("watch", CPlantMonitor),
        ("balises", _CBalises),
        ("journal", CJournal),
        ("seconds_at_most", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("last_call", "last_time", "rows_reported")),
        ("rows_before", ctypes.c_int64),
        ("can_be_missing", ctypes.c_void_p),
        ("step_count", ctypes.c_int64),
        ("turn", ctypes.c_void_p),
        ("saves", ctypes.c_int64),
        ("listeners", ctypes.c_void_p),
        ("listener_count", ctypes.c_int64),
        ("parts", ctypes.c_int64),
        ("rows_done", ctypes.c_int64),
        ("seconds", ctypes.c_double),
        *((name, ctypes.c_int64) for name in ("stop", "slave", "port", "status", "event", "terminate", "early")),
        ("reached", ctypes.c_double),
        ("returns", ctypes.c_double * RETURNS_AT_MOST),
        ("return_count", ctypes.c_int64),
    )
