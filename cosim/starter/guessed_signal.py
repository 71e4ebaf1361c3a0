"""Guesses: which signals of an FMU are its position, speed, wheel speed and effort, and how sure that is. Knows no
files.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Literal

from plant_models.hybrid.units import Unit, UnitError, conversion, parse_unit

Quantity = Literal["position", "speed", "wheel_speed", "effort", "slip", "adhesion_force", "mass"]
_Sureness = Literal["sure", "likely", "a guess"]

UNITS: dict[Quantity, tuple[str, ...]] = {
    "position": ("m",),
    "speed": ("m/s",),
    "wheel_speed": ("m/s", "rad/s"),
    "effort": ("N",),
    "slip": ("1",),
    "adhesion_force": ("N",),
    "mass": ("kg",),
}
_BY_NAME_ONLY: frozenset[Quantity] = frozenset(("wheel_speed", "slip", "adhesion_force", "mass"))
"""Quantities for which a fitting unit says too little."""
SENSORS = frozenset({"odometer", "odo", "tacho", "tachometer", "encoder"})
TURNING = frozenset({"omega", "w", "rpm", "drehzahl"})


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


WORDS: Mapping[str, Set[str]] = {
    "position": _words(
        "position pos location chainage mileage odometry abscissa distance dist travelled traveled weg wegstrecke "
        "fahrweg ort standort strecke abscisse pk parcours posizione progressiva percorso posicion recorrido posicao "
        "polozenie plats positie afstand poloha"
    ),
    "speed": _words(
        "speed spd velocity vel velo geschwindigkeit geschw tempo fahrgeschwindigkeit vitesse vit velocita velocidad "
        "velocidade hastighet snelheid predkosc rychlost speedometer"
    ),
    "wheel": _words(
        "wheel wheels wheelset axle axles odometer odometry odo tacho tachometer encoder rim circumferential rad rads "
        "raeder rader achse achsen radsatz radsatze umfang radumfang roue roues essieu ruota ruote asse sala rueda eje "
        "roda eixo hjul wiel kolo"
    ),
    "effort": _words(
        "effort force traction tractive trac propulsion thrust demand command kraft zugkraft antrieb antriebskraft "
        "radkraft antriebs stellkraft effort forza trazione sforzo fuerza traccion esfuerzo forca tracao dragkraft "
        "trekkracht sila commande kommando"
    ),
    "slip": _words("slip slippage creep schlupf glissement patinage scorrimento slittamento deslizamiento"),
    "adhesion": _words("adhesion adherence haft haftkraft kraftschluss adhesive aderenza adherencia creepforce"),
    "mass": _words("mass masse massa masa gewicht weight tare fahrzeugmasse zugmasse"),
}
"""Words that speak for a quantity."""

_LETTERS: Mapping[str, Set[str]] = {
    "position": frozenset("sx"),
    "speed": frozenset("v"),
    "wheel": frozenset(),
    "effort": frozenset("f"),
    "slip": frozenset(),
    "adhesion": frozenset(),
    "mass": frozenset("m"),
}
"""Single letters that do so at the begin of a name: ``v``, ``v_train``, ``body.v``."""

_SURROUNDINGS: Set[str] = _words(
    "ambient amb pamb patm tamb pressure druck pression pressione presion temperature temp wind gradient grade slope"
)
"""Words of what acts on a train from outside, and is no effort."""

_FOREIGN: Set[str] = _SURROUNDINGS | _words(
    "reference ref setpoint set target desired wanted soll sollwert ziel consigne cible riferimento limit limite lim "
    "max min maximum minimum error err fehler erreur deviation difference diff noise relative rel delta "
    "tolerance limits resistance resistive resistances widerstand fahrwiderstand coupler kupplung "
    "buffer brake braking brems bremse bremskraft frein freinage freno brems disturbance storung friction reibung "
    "acceleration accel beschleunigung count status flag valid id index power energy current voltage "
    "previous next total remaining estimated"
)
"""Words that speak of something else: a reference, a limit, an error, another force."""

_FORCES = _words("force kraft haftkraft forza fuerza forca effort creepforce")
"""Words of forces: what adhesion is where no unit says so."""

_BRAKING = _words("brake braking brems bremse bremskraft frein freinage freno")
"""Words of brakes."""
_DRIVING = _words("traction tractive trac zug zugkraft antrieb trazione traccion tracao propulsion drive")
"""Words of traction, beside which brakes may be named: one signal for both."""

PARTS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")


def _plain_letters(text: str) -> str:
    """The text without accents: ``Ä`` becomes ``A``, ``ß`` becomes ``ss``."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.replace("ß", "ss")) if not unicodedata.combining(c))


def _words_of(text: str) -> list[str]:
    """The words in a name or a sentence, in small letters: ``vTrain`` and ``v_train`` alike are ``v`` and ``train``."""
    return [part.lower() for part in PARTS.findall(_plain_letters(text))]


_NOT_THIS: Mapping[Quantity, Set[str]] = {
    "position": WORDS["wheel"] | {"rel", "relative", "nominal"},
    "speed": WORDS["wheel"] | {"rel", "relative", "nominal"},
    "effort": WORDS["adhesion"] | WORDS["slip"],
}
"""Words that speak of another quantity of the same unit."""
STRONG, WEAK, _SAID, MEASURED, _DENIED = 4, 3, 2, 3, -99
_SURE, _LIKELY, _STATED = 7, 4, 20


@dataclass(frozen=True)
class GuessedSignal:
    """A numeric scalar variable, or an element of an array, as the description has it.

    Args:
        name: its name. unit: name of its unit, or None. meaning: of the unit; None without one, or where nobody
            understands it.
        description: one line. start: its start value as a number, or None. type: of FMI.
        stated: what the scenario says that it is, one of `UNITS` or other words; empty where it says nothing.
    """

    name: str
    unit: str | None = None
    meaning: Unit | None = None
    description: str = ""
    start: float | None = None
    type: str = "Float64"
    stated: str = ""

    @property
    def readable(self) -> bool:
        """Whether its unit, where it has one, can be understood."""
        return self.unit is None or self.meaning is not None

    @property
    def acts_from_outside(self) -> bool:
        """Whether name or description speak of what is around a train, and nothing of an effort."""
        words = {*_words_of(self.name), *_words_of(self.description)}
        return not words & WORDS["effort"] and bool(words & _SURROUNDINGS)


@dataclass(frozen=True)
class Guess:
    """A signal that may be what is looked for.

    Args:
        signal: the signal. sureness: how sure this is. reason: why, for people. others: the next best, best first.
    """

    signal: GuessedSignal
    sureness: _Sureness
    reason: str
    others: Sequence[str] = ()


def guess(
    quantity: Quantity, signals: Sequence[GuessedSignal], taken: Sequence[str] = (), part: str = ""
) -> Guess | None:
    """The signal that is most likely a quantity; the first of equals.

    Args:
        quantity: what is looked for. signals: to choose from. taken: names that are something else already.
        part: of the model; among equals its signals come first (``mass`` for ``mass.s``).

    Returns:
        The best with its alternatives, or None where nothing fits.
    """
    rated = [(_rate(quantity, signal), signal) for signal in signals if signal.name not in taken]
    fitting = sorted(
        ((rate, s) for rate, s in rated if rate[0] > 0),
        key=lambda pair: (-pair[0][0], not pair[1].name.startswith(f"{part}.")),
    )
    if not fitting:
        return None
    (score, reason), best = fitting[0]
    rivals = [s.name for (other, _), s in fitting[1:4]]
    tied = len(fitting) > 1 and fitting[1][0][0] == score
    sureness: _Sureness = "sure" if score >= _SURE and not tied else "likely" if score >= _LIKELY else "a guess"
    return Guess(best, sureness, reason + (", as others are" if tied else ""), rivals)


def fits(signal: GuessedSignal, unit: str) -> bool:
    """Whether the unit of a signal can be converted to this one; rad counts, unlike in SI.

    Args:
        signal: a signal of the FMU.
        unit: the unit it should have.
    """
    if signal.meaning is None:
        return False
    wanted = parse_unit(unit)
    try:
        conversion(signal.meaning, wanted)
    except UnitError:
        return False
    return signal.meaning.exponents[-1] == wanted.exponents[-1]


def _rate(quantity: Quantity, signal: GuessedSignal) -> tuple[int, str]:
    """How much speaks for a signal, 0 and less is nothing; and what."""
    if signal.stated in UNITS:
        return (_STATED if signal.stated == quantity else 0), "as it is stated"
    has_unit = any(fits(signal, unit) for unit in UNITS[quantity]) or (quantity == "slip" and signal.unit is None)
    if (signal.meaning is not None and not has_unit) or signal.type == "Boolean":
        return 0, ""
    if quantity == "adhesion_force" and not has_unit and not _FORCES & set(_words_of(signal.name)):
        return 0, ""  # a coefficient or a state of the rail is named after adhesion as well
    named, said = _named(quantity, signal.name, has_unit), _described(quantity, signal.description)
    if not named and not said and (not has_unit or quantity in _BY_NAME_ONLY):
        return 0, ""
    if signal.meaning is None and not named:
        return 0, ""  # a sentence alone is too little
    reasons = (
        ["its name"] * (named > 0)
        + [f"its unit {signal.unit or 'of a pure number'}"] * has_unit
        + ["its description"] * (said > 0)
    )
    text = ", ".join(reasons[:-1]) + " and " * (len(reasons) > 1) + reasons[-1]
    return named + said + MEASURED * has_unit + _denied(quantity, signal), f"by {text}"


def _key(quantity: Quantity) -> str:
    return {"wheel_speed": "wheel", "adhesion_force": "adhesion"}.get(quantity, quantity)


def _named(quantity: Quantity, name: str, has_unit: bool) -> int:
    last = _words_of(name.rpartition(".")[2])
    words, key = _words_of(name), _key(quantity)
    if quantity == "wheel_speed" and not (WORDS["speed"] | SENSORS | TURNING) & set(words):
        return WEAK if has_unit and WORDS[key] & set(words) else 0
    if WORDS[key] & set(last):
        return STRONG
    if WORDS[key] & set(words):
        return WEAK
    return WEAK if last and last[0] in _LETTERS[key] else 0


def _described(quantity: Quantity, description: str) -> int:
    words = set(_words_of(description))
    if quantity == "wheel_speed":
        return _SAID if words & WORDS["wheel"] and words & WORDS["speed"] else 0
    if quantity in ("speed", "position") and words & WORDS["wheel"]:
        return 0
    return _SAID if words & WORDS[_key(quantity)] else 0


def _denied(quantity: Quantity, signal: GuessedSignal) -> int:
    """What speaks against it: it is named as a reference, a limit, an error, or as another force."""
    name = set(_words_of(signal.name))
    against = (_FOREIGN | _NOT_THIS.get(quantity, frozenset())) - WORDS[_key(quantity)]
    if quantity == "effort" and name & _DRIVING:
        against -= _BRAKING  # one signal for both
    if name & against:
        return _DENIED
    if WORDS[_key(quantity)] & name or quantity == "effort":
        return 0  # what is named plainly may be described beside other things
    return _DENIED if set(_words_of(signal.description)) & against else 0


def in_si(signal: GuessedSignal) -> float:
    """Start value of a signal in SI units, as it stands where it declares none; 0 without one.

    Args:
        signal: of an FMU.
    """
    return (signal.start or 0.0) * (1.0 if signal.meaning is None else signal.meaning.factor)
