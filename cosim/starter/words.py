"""Words: how signals of a train are called, in the languages vendors write. Plain data; small letters, no accents."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Set


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

LETTERS: Mapping[str, Set[str]] = {
    "position": frozenset("sx"),
    "speed": frozenset("v"),
    "wheel": frozenset(),
    "effort": frozenset("f"),
    "slip": frozenset(),
    "adhesion": frozenset(),
    "mass": frozenset("m"),
}
"""Single letters that do so at the begin of a name: ``v``, ``v_train``, ``body.v``."""

FOREIGN: Set[str] = _words(
    "reference ref setpoint set target desired wanted soll sollwert ziel consigne cible riferimento limit limite lim "
    "max min maximum minimum error err fehler erreur deviation difference diff noise wind ambient relative rel delta "
    "tolerance limits resistance resistive resistances widerstand fahrwiderstand gradient grade slope coupler kupplung "
    "buffer brake braking brems bremse bremskraft frein freinage freno brems disturbance storung friction reibung "
    "acceleration accel beschleunigung count status flag valid id index temperature power energy current voltage "
    "previous next total remaining estimated"
)
"""Words that speak of something else: a reference, a limit, an error, another force."""

BRAKING = _words("brake braking brems bremse bremskraft frein freinage freno")
"""Words of brakes."""
DRIVING = _words("traction tractive trac zug zugkraft antrieb trazione traccion tracao propulsion drive")
"""Words of traction, beside which brakes may be named: one signal for both."""

PARTS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")


def _plain_letters(text: str) -> str:
    """The text without accents: ``Ä`` becomes ``A``, ``ß`` becomes ``ss``."""
    return "".join(c for c in unicodedata.normalize("NFKD", text.replace("ß", "ss")) if not unicodedata.combining(c))


def words_of(text: str) -> list[str]:
    """The words in a name or a sentence, in small letters: ``vTrain`` and ``v_train`` alike are ``v`` and ``train``.

    Args:
        text: the text.
    """
    return [part.lower() for part in PARTS.findall(_plain_letters(text))]
