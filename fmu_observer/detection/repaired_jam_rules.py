"""The repaired rules of the jam detector [ours]: they recover from every state. Pure functions.

docs/theses/jam_detection.md states the theorem and proves it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fmu_observer.detection.jam_rules import ROUNDING, JamVerdict, Passing, Reading, Rules
from plant_models.hybrid import Array, Signal, memory, parameter
from plant_models.hybrid.arrays import indicator

TRUSTED, HELD, UNCONFIRMED = 0.0, 1.0, 2.0
"""Modes: the odometer is believed; it is not, and the model alone runs on; the model alone has run too long, and the
odometer is followed again although nothing has confirmed it.
"""
_UNSETTLED = 1000.0  # faults since the residual was last small: so many that none is judged before it is
_REFUTATIONS = 2.0  # ways in a row that must be wrong before an odometer that is believed is held to lie
_VOUCHED = 0.25  # of the time for which an odometer has rolled that speaks against a jump before it is proven [ours]


class RepairedRules(Rules):
    """Recovery by agreement within a widening threshold, by balises, and in bounded time, for faults of both signs
    [ours].

    While the odometer is *held* to lie (mode 1) the model runs alone and its error grows by `disturbance_bound` at
    most. The odometer is believed again, and the speed set to it,

    1. where ``|r| <= eps' + M delta T`` at `recover_samples` samples in a row, T the time held, and the wheel rolled
       between them: ``|y_k - y_{k-1}| <= a_max period + 2 noise``;
    2. where, from one balise to the next, the way of the odometer is the distance.

    If neither has happened within `hold_limit` the speed is set to the odometer, which is followed again but stays
    *unconfirmed* (mode 2): `odometer_fault` stays 1. That ends when the wheel has rolled with a small residual for
    `trust_time`, or when a balise confirms the way. An unconfirmed odometer that jumps is followed at once.

    In two cases the estimate may be what is wrong. Then the limit is `release_time` and a period, and what the position
    has missed meanwhile is made up for (`Judgement.withdrawn`):

    a. against the sign of the effort: a braked wheel has been faster than the estimate by more than eps' / M, or a
       driven one slower, at all samples of that time, rolling between them. Jams and skids of that sign are short; what
       lasts is the end of a fault that was too small, or grew too slowly, to be seen. A wheel that locked while braking
       may still be slow when it is driven: for `release_time` after the sign of the effort has changed it counts as one
       that coasts. Where balises, and no jump, began the hold, the odometer is believed by that, for what balises
       correct a speed by is a mean over the way;
    b. an odometer that is not *proven*: since the last standstill, or a start with a speed that it contradicts, it has
       neither rolled with a small residual for `trust_time` nor been confirmed by a balise. A jump may then be the end
       of a fault that was there from the first turn of the wheel on. A quarter of the time for which it has rolled is
       the limit where that is longer.

    A fault begins where ``|r| > eps'``, of either sign, in time to keep the very sample out; or where balises refute
    the way of an odometer that was believed twice in a row. eps' is eps, or what the noise stated of the odometer
    makes of a residual, ``sqrt(2) M nu``, where that is more (`doubt_limit`); a residual is small that is below eps / 2
    or explained by noise (`settled_limit`). None is judged before `arming_delay` has passed and the residual has been
    small for `settle_samples` (until then an odometer that is not proven is followed at once
    where it jumps), nor after `fault_limit` faults between which it was not, nor below `least_speed`.

    Source: the three states of Aguiar Cota 2019, Algorithm 3-3; the rules are ours.
    """

    memory: tuple[Signal, ...] = (
        memory("odometer_mode", "1", TRUSTED, "0 believed, 1 held to lie, 2 followed without being confirmed"),
        memory("hold_time", "s", 0.0, "Time for which the model has run alone, as its error counts"),
        memory("agreeing", "1", 0.0, "Samples in a row that speak for the odometer"),
        memory("settled", "1", 0.0, "Samples in a row with a small residual while the odometer was followed"),
        memory("faults", "1", _UNSETTLED, "Faults since the residual was last small; 1000 after the start"),
        memory("last_odometer", "m/s", 0.0, "Reading before"),
        memory("unchanged_time", "s", 0.0, "Time since mode or rolling last changed"),
        memory("refutations", "1", 0.0, "Ways between balises in a row that the odometer had wrong"),
        memory("samples", "1", 0.0, "Readings since the start"),
        memory("effort_time", "s", 0.0, "Samples in a row with one sign of the effort, times period and sign"),
        memory("against", "1", 0.0, "Samples in a row that no fault explains which the effort causes"),
        memory("proven_time", "s", 0.0, "Time for which the wheel has rolled since the last standstill, up to trust"),
    )
    parameters: tuple[Signal, ...] = (
        parameter(
            "disturbance_bound", "m/s2", 0.1, "Growth of the speed error while the model runs alone, delta", min=0.0
        ),
        parameter("odometer_noise", "m/s", 0.15, "Bound of the odometer's noise and quantisation, nu", min=0.0),
        parameter("acceleration_limit", "m/s2", 1.5, "Largest acceleration of a train whose wheels roll", min=0.0),
        parameter("recover_samples", "1", 2.0, "Samples in a row that agree before the odometer is believed", min=1.0),
        parameter("hold_limit", "s", 15.0, "Longest time for which the model runs alone", min=0.0),
        parameter("trust_time", "s", 20.0, "Time of rolling after which an unconfirmed odometer is believed", min=0.0),
        parameter("settle_samples", "1", 5.0, "Samples with a small residual before faults are judged", min=1.0),
        parameter("fault_limit", "1", 3.0, "Faults in a row without a small residual between them", min=1.0),
        parameter("least_speed", "m/s", 0.5, "Estimated speed below which no fault begins", min=0.0),
        parameter("release_time", "s", 1.0, "Longest time of a fault that the effort does not cause", min=0.0),
        parameter("sign_rule", "1", 1.0, "1: jams while driving and skids while braking are short", min=0.0, max=1.0),
        parameter("way_share", "1", 0.01, "Error of the odometer's way that a balise allows, a share of it", min=0.0),
        parameter("way_floor", "m", 1.0, "Error of the odometer's way that a balise always allows", min=0.0),
        parameter("way_time", "s", 1.0, "Shortest time between balises for the odometer's way to be judged", min=1e-3),
    )

    def at_sample(self, m: Any, reading: Reading, p: Any) -> JamVerdict:
        """Judge an odometer sample; it takes effect at once."""
        now = _compared(m, reading, p)
        settled, faults, armed, onset = _followed(m, reading, now, p)
        hold, row, believed, expired, withdrawn = _held(m, now, p)
        quiet, trusted = _unconfirmed(m, now, settled, p)
        jumped = _jumped(m, reading, now, armed, p)
        mode = np.where(
            onset > 0.0,
            HELD,
            np.where(expired > 0.0, UNCONFIRMED, np.where(believed + trusted > 0.0, TRUSTED, m.odometer_mode)),
        )
        changed = np.maximum(indicator(mode != m.odometer_mode), now.unconfirmed * jumped)
        rolled = _proven_time(m, reading, np.maximum(now.held, onset), now.small, p)
        after = {
            "odometer_mode": mode,
            "hold_time": np.where(mode == HELD, hold, 0.0),
            "agreeing": np.where(changed > 0.0, 0.0, np.where(now.held > 0.0, row, quiet)),
            "settled": np.where(onset > 0.0, 0.0, settled),
            "faults": np.where(trusted > 0.0, 0.0, np.where(expired > 0.0, _UNSETTLED, faults + onset)),
            "last_odometer": reading.odometer,
            "unchanged_time": np.where(changed > 0.0, 0.0, m.unchanged_time + p.odometer_period),
            "samples": m.samples + 1.0,
            "effort_time": now.effort_time,
            "against": now.against,
            "proven_time": np.where(trusted > 0.0, p.trust_time, rolled),
        }
        restart = np.maximum(np.maximum(believed, expired), jumped)
        return JamVerdict(after, restart, onset, withdrawn=withdrawn)

    def at_balise(self, m: Any, passing: Passing, p: Any) -> JamVerdict:
        """Judge the way between two balises, where nothing changed on it."""
        long_enough = indicator(passing.duration >= p.way_time)
        clean = passing.known * long_enough * indicator(m.unchanged_time >= passing.duration)
        right = indicator(np.abs(passing.way - np.abs(passing.distance)) <= _way_limit(passing, p))
        held, unconfirmed = indicator(m.odometer_mode == HELD), indicator(m.odometer_mode == UNCONFIRMED)
        row = clean * (1.0 - right) * (m.refutations + 1.0)
        # Once may be a jam that is over; what is not believed anyway is refuted by that.
        confirmed, refuted = clean * right, indicator(row >= np.where(m.odometer_mode == TRUSTED, _REFUTATIONS, 1.0))
        mode = np.where(refuted > 0.0, HELD, np.where(confirmed * (held + unconfirmed) > 0.0, TRUSTED, m.odometer_mode))
        changed = indicator(mode != m.odometer_mode)
        begun = refuted * (1.0 - held)
        # Mean error of the speed over the way; what is left of it grew within the way, half as long as that at most.
        shift = np.where(
            refuted > 0.0, (np.abs(passing.distance) - passing.believed) / np.maximum(passing.duration, p.way_time), 0.0
        )
        after = {
            "odometer_mode": mode,
            "hold_time": np.where(refuted > 0.0, 0.5 * passing.duration, np.where(changed > 0.0, 0.0, m.hold_time)),
            "agreeing": np.where(changed > 0.0, 0.0, m.agreeing),
            "settled": np.where(changed > 0.0, 0.0, m.settled),
            "faults": np.where(confirmed * changed > 0.0, _UNSETTLED, m.faults + begun),
            "unchanged_time": np.where(changed > 0.0, 0.0, m.unchanged_time),
            "refutations": row,
            "proven_time": np.where(confirmed > 0.0, p.trust_time, m.proven_time),
        }
        return JamVerdict(after, confirmed * held, begun, shift)

    def fault(self, m: Any) -> Array:
        """1 while the odometer is judged to lie or is not confirmed."""
        return indicator(m.odometer_mode > TRUSTED)

    def discarded(self, m: Any) -> Array:
        """1 while the estimate must not follow the odometer."""
        return indicator(m.odometer_mode == HELD)

    def recovering(self, m: Any) -> Array:
        """1 while samples agree, and while the odometer is followed without being confirmed."""
        return np.maximum(
            indicator(m.odometer_mode == UNCONFIRMED), indicator(m.odometer_mode == HELD) * indicator(m.agreeing > 0.0)
        )

    def limit(self, m: Any, p: Any) -> Array:
        """Residual beyond which the odometer is doubted, or, while it is held to lie, within which it agrees [m/s]."""
        return _agreement_limit(m.hold_time, p)

    def settled_time(self, m: Any, p: Any) -> Array:
        """Time for which the residual of an odometer that was followed has been small [s]; `settle_samples` periods of
        it are needed before faults are judged.
        """
        return m.settled * p.odometer_period


class _Compared(NamedTuple):
    """A sample beside the memory: 1 where it is so, else 0, and times of the effort.

    Attributes:
        held, unconfirmed: mode. size: of the residual [m/s]. rolls: the wheel rolled since the sample before.
        small, large: the residual. proven: the odometer. brief: least time of a fault that the effort does not cause
            [s]. effort_time, against: new values of the memory. lasts: what the effort does not cause has lasted.
    """

    held: Array
    unconfirmed: Array
    size: Array
    rolls: Array
    small: Array
    large: Array
    proven: Array
    brief: Array
    effort_time: Array
    against: Array
    lasts: Array


def _compared(m: Any, reading: Reading, p: Any) -> _Compared:
    rolling = p.acceleration_limit * p.odometer_period + 2.0 * p.odometer_noise  # largest change of a rolling wheel
    rolls = indicator(np.abs(reading.odometer - m.last_odometer) <= rolling) * indicator(m.samples > 0.0)
    size = np.abs(reading.residual)
    sign = indicator(reading.effort > 0.0) - indicator(reading.effort < 0.0)
    effort_time = np.where(sign * m.effort_time > 0.0, m.effort_time, 0.0) + sign * p.odometer_period
    # Of a period in which the sign changes a part is unknown, and a reading shows of the period before it.
    brief = p.release_time + p.odometer_period
    lasting = sign * indicator(np.abs(effort_time) + ROUNDING >= brief)
    large = indicator(size > doubt_limit(p))
    against = large * _against(reading, lasting, p) * (1.0 + rolls * m.against)
    return _Compared(
        held=indicator(m.odometer_mode == HELD),
        unconfirmed=indicator(m.odometer_mode == UNCONFIRMED),
        size=size,
        rolls=rolls,
        small=indicator(size <= settled_limit(p)),
        large=large,
        proven=indicator(m.proven_time + ROUNDING >= p.trust_time),
        brief=brief,
        effort_time=effort_time,
        against=against,
        lasts=indicator((against + ROUNDING) * p.odometer_period >= brief),
    )


def _followed(m: Any, reading: Reading, now: _Compared, p: Any) -> tuple[Array, Array, Array, Array]:
    """Of an odometer that is followed: samples settled, faults, whether they are judged, and whether one begins."""
    settled = np.where(now.held > 0.0, 0.0, np.where(now.small > 0.0, m.settled + 1.0, 0.0))
    passed = indicator((m.samples + ROUNDING) * p.odometer_period >= p.arming_delay)
    faults = np.where(indicator(settled >= p.settle_samples) * passed > 0.0, 0.0, m.faults)
    armed = indicator(m.odometer_mode == TRUSTED) * indicator(faults < p.fault_limit) * passed
    moves = indicator(np.abs(reading.speed) > p.least_speed)
    return settled, faults, armed, armed * moves * now.large


def _held(m: Any, now: _Compared, p: Any) -> tuple[Array, Array, Array, Array, Array]:
    """Of an odometer that is held to lie: time held, samples in a row that agree; 1 where it is believed again, where
    its time has expired, and where the fault is withdrawn.
    """
    hold = np.where(now.held > 0.0, m.hold_time + p.odometer_period, 0.0)
    agrees = now.held * indicator(now.size <= _agreement_limit(hold, p))
    row = np.where(agrees > 0.0, np.where(now.rolls > 0.0, m.agreeing + 1.0, 1.0), 0.0)
    believed = now.held * indicator(row >= p.recover_samples)
    doubtful = np.maximum(1.0 - now.proven, now.lasts)
    vouched = np.maximum(now.brief, (1.0 - now.lasts) * _VOUCHED * m.proven_time)
    limit = np.where(doubtful > 0.0, np.minimum(vouched, p.hold_limit), p.hold_limit)
    over = now.held * (1.0 - believed) * indicator(hold + ROUNDING >= limit)
    # Balises began the hold, at no jump of the wheel: what they corrected the speed by was a mean, and is outlived.
    outlived = over * now.lasts * indicator(m.refutations >= _REFUTATIONS)
    return hold, row, believed + outlived, over - outlived, over * doubtful


def _unconfirmed(m: Any, now: _Compared, settled: Array, p: Any) -> tuple[Array, Array]:
    """Of an odometer that is not confirmed: samples for which its wheel has rolled, and 1 where it is believed."""
    quiet = np.where(now.unconfirmed * now.rolls * now.small > 0.0, m.agreeing + 1.0, 0.0)
    long = indicator((quiet + ROUNDING) * p.odometer_period >= p.trust_time)
    return quiet, now.unconfirmed * long * indicator(settled >= p.settle_samples)


def _jumped(m: Any, reading: Reading, now: _Compared, armed: Array, p: Any) -> Array:
    """1 where an odometer jumps that is followed at once: one that is not confirmed, or not proven before faults are
    judged.
    """
    rolling = indicator(np.maximum(reading.speed, reading.odometer) > p.least_speed) * indicator(m.samples > 0.0)
    unjudged = (1.0 - now.proven) * (1.0 - armed) * (1.0 - now.held) * rolling * now.large
    return np.maximum(now.unconfirmed, unjudged) * (1.0 - now.rolls)


def _proven_time(m: Any, reading: Reading, doubted: Array, small: Array, p: Any) -> Array:
    """How long the odometer has rolled since the last standstill [s]; `trust_time` where it fits the start."""
    rolled = np.where(m.proven_time >= p.trust_time, p.trust_time, small * (m.proven_time + p.odometer_period))
    stands = indicator(np.maximum(np.abs(reading.speed), np.abs(reading.odometer)) <= p.odometer_noise)
    later = np.where(doubted > 0.0, m.proven_time, indicator(m.odometer_mode == TRUSTED) * rolled)
    first = indicator(np.abs(reading.residual) <= doubt_limit(p)) * p.trust_time
    return np.where(stands > 0.0, 0.0, np.where(m.samples > 0.0, later, first))


def _agreement_limit(hold_time: Array, p: Any) -> Array:
    """Residual within which a held odometer agrees [m/s]: ``eps' + M delta T``."""
    return doubt_limit(p) + p.residual_gain * p.disturbance_bound * hold_time


def _noise_residual(p: Any) -> Array:
    """Residual that noise and quantisation explain [m/s]: ``M sqrt(2) nu``.

    A reading of a rolling wheel is within nu of the speed, and so is an estimate that has just been set to one; both
    are independent, so their difference is ``sqrt(2)`` times as large. What gains make of readings later must be no
    worse than a reading (`fmu_observer.design.jam_recovery.estimate_noise`).
    """
    return np.sqrt(2.0) * p.residual_gain * p.odometer_noise


def doubt_limit(p: Any) -> Array:
    """Residual beyond which an odometer is doubted [m/s]: eps, or what noise explains where that is more."""
    return np.maximum(p.threshold, _noise_residual(p))


def settled_limit(p: Any) -> Array:
    """Residual of an estimate that has settled, at most [m/s]: eps / 2, or what noise explains where that is more.

    It is asked of all samples of a time, up to `trust_time`, so that noise must not be beyond it.
    """
    return np.maximum(0.5 * p.threshold, _noise_residual(p))


def certain_fault(p: Any) -> Array:
    """Error of a reading beyond which it is doubted whatever its noise, where the estimate is right [m/s]:
    ``eps' / M + nu``. At ``eps' / M`` one in two is.
    """
    return doubt_limit(p) / p.residual_gain + p.odometer_noise


def _way_limit(passing: Passing, p: Any) -> Array:
    """Difference between the odometer's way and the distance that a balise allows [m].

    A held reading is late by a period at most, which costs the period times the change of speed.
    """
    late = p.odometer_period * np.abs(passing.speed_change)
    return p.way_floor + passing.accuracy + p.way_share * np.abs(passing.distance) + late


def _against(reading: Reading, sign: Array, p: Any) -> Array:
    """1 where the effort can cause neither the jam nor the skid: a braked wheel too fast, a driven one too slow."""
    too_fast = indicator(reading.odometer > reading.speed)
    braked, driven = indicator(sign < 0.0), indicator(sign > 0.0)
    return indicator(p.sign_rule > 0.5) * (braked * too_fast + driven * (1.0 - too_fast))
