"""Partial inversion with one state measured: the culture of E. coli."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fmu_observer.observers.signature.signature_observer import Inverted, SignatureObserver
from fmu_observer.signatures.inversion import Found, network_inverse
from fmu_observer.signatures.pencil import NextScaling
from plant_models.benchmarks.ecoli_culture import HOUR, EcoliCulture
from plant_models.hybrid import parameter, vector
from plant_models.hybrid.integration import rk4_step
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.scan import enclosed, scan
from plant_models.hybrid.system import Array

ORDER, POINTS = 6, 2  # printed N; N_O = 8
NOMINAL = 32
"""Places of the nominal run that are kept."""
LEAST_ENZYME = 1e-4  # [kg/m3]


class CultureSignature(SignatureObserver):
    """Reduced signature observer of `ecoli_culture`: Omar 2012, section 4.7, (4.7.5)-(4.7.9).

    Biomass is measured; glycerol and enzyme are looked up in the network that the signatures of light make over an
    admissible tube around a nominal run, ``S0(X) +- 0.4`` and ``P0(X) +- 0.04`` (4.7.5), with `nodes` values of each.
    Properties are the mean abscissa and the mean ordinate of the points (4.7.8).

    The network changes steeply with X. The thesis tabulates it over a grid of X whose half-width it does not print;
    here the signatures of the nodes are computed for the X that is measured, so that no table is interpolated and the
    parameters may be changed at will [ours]. S0(X) and P0(X) are a table. ``literal`` scaling: with ``norm`` both
    quantities move the properties in nearly one direction.

    Args:
        nodes: values of glycerol and of enzyme in the network, printed 3. next_scaling: see above.

    Raises:
        ValueError: an option is no whole number or out of bounds.
    """

    name = "culture_signature"
    description = "Signature observer of the E. coli culture, biomass and light measured"
    source = "Omar 2012, (4.7.5)-(4.7.9)"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {"nodes": range(2, 8), "next_scaling": ("literal", "norm")}

    def __init__(self, nodes: int = 3, next_scaling: NextScaling = "literal") -> None:
        require_whole(self.name, 2, 7, nodes=nodes)
        self.nodes = np.linspace(-1.0, 1.0, nodes)
        biomass, glycerol, enzyme = nominal_run()
        self.declare(
            EcoliCulture(),
            ORDER + POINTS,
            next_scaling,
            gain=0.3,
            eps=0.1,
            own_parameters=(
                parameter("glycerol_width", "kg/m3", 0.4, "Half-width of the tube of glycerol", min=1e-6),
                parameter("enzyme_width", "kg/m3", 0.04, "Half-width of the tube of enzyme", min=1e-6),
                parameter(
                    "nominal_biomass", "kg/m3", tuple(biomass), "Biomass X of the nominal run, rising", size=NOMINAL
                ),
                parameter("nominal_glycerol", "kg/m3", tuple(glycerol), "Glycerol S0(X) there", size=NOMINAL),
                parameter("nominal_enzyme", "kg/m3", tuple(enzyme), "Enzyme P0(X) there", size=NOMINAL),
            ),
        )
        super().__init__(nodes=nodes, next_scaling=next_scaling)

    def inverted(self, past: Sequence[Array], x: Array, p: Any) -> Inverted:
        """Glycerol and enzyme at the oldest sample, of its biomass and the light of the window."""
        X, count = past[0][0], len(self.nodes)
        target = self.properties(past[1], p.regularisation)
        S0, P0 = (
            enclosed(course, np.stack([X]), p.nominal_biomass, values)[0][0]
            for values in (p.nominal_glycerol, p.nominal_enzyme)
        )
        model = self.model_parameters((), p)
        fields = self._model._fields
        places = [(a, b) for a in self.nodes for b in self.nodes]

        def sample(carry: Any, row: Any, shared: Any) -> Any:
            given, begins = shared[0], row[0][0]
            values = self._model(*(given[i] for i in range(len(fields))))
            X_, S_, P_, wide, narrow = (given[len(fields) + i] for i in range(5))
            start = in_tube(X_, S_ + wide * row[0][1], P_ + narrow * row[0][2])
            now = np.where(begins > 0.5, start, self.moved(carry[0], 1, values)[-1])
            return (now,), (np.stack([self.plant.measured_under(now, values)[1]]),)

        def read(_carry: Any, row: Any, shared: Any) -> Any:
            return (), (self.properties(row[0], shared[0][-1]),)

        def network(shared: Array, target: Array) -> tuple[Array, ...]:
            rows = [(np.array([k == 0, *place], dtype=float),) for place in places for k in range(self.window)]
            light = [found[0] for found in scan(sample, (np.ones(3),), rows, (shared,))[1]]
            windows = [(np.hstack(light[i : i + self.window]),) for i in range(0, len(light), self.window)]
            found = [result[0] for result in scan(read, (), windows, (shared,))[1]]
            table = [np.reshape(np.hstack([r[k] for r in found]), (count, count)) for k in range(2)]
            told = network_inverse(self.nodes, self.nodes, table, target)
            return told.values, np.stack([told.outside])

        shared = vector(
            *(getattr(model, name) for name in fields), X, S0, P0, p.glycerol_width, p.enzyme_width, p.regularisation
        )
        told = Found(*enclosed(network, shared, target))
        state = in_tube(X, S0 + p.glycerol_width * told.values[0], P0 + p.enzyme_width * told.values[1])
        return Inverted(state, told.outside[0])

    def adopted(self, now: Array, u: Any) -> Array:
        """With the biomass as it is measured."""
        return vector(u.measured_biomass, now[1], now[2])

    def properties(self, light: Array, eps: Array) -> Array:
        """Mean abscissa and mean ordinate of the signature: (4.7.8); shape (2, ...).

        Args:
            light: window, shape (N_O, ...). eps: regularisation.
        """
        points = self.points(light, ORDER, eps)
        return np.stack([np.mean(points[0], axis=0), np.mean(points[1], axis=0)])


def in_tube(X: Array, S: Array, P: Array) -> Array:
    """A state with glycerol not negative and some enzyme, shape (3,).

    Args:
        X: biomass. S: glycerol. P: enzyme [kg/m3].
    """
    return vector(X, np.maximum(S, 0.0), np.maximum(P, LEAST_ENZYME))


def course(X: Array, biomass: Array, values: Array) -> tuple[Array]:
    """Value of a nominal run where its biomass is X, linear between places, the end value beyond them; for `enclosed`.

    Args:
        X: [kg/m3], shape (1,). biomass: of the run, rising, shape (k,). values: there, shape (k,).

    Returns:
        The value, shape (1,).
    """
    shares = np.clip((X[0] - biomass[:-1]) / (biomass[1:] - biomass[:-1]), 0.0, 1.0)
    return (np.stack([values[0] + np.sum(shares * (values[1:] - values[:-1]))]),)


def nominal_run(start: Sequence[float] = (0.05, 2.0, 0.01), hours: float = 7.5) -> np.ndarray:
    """Biomass, glycerol and enzyme of a nominal run at places evenly spread in time, shape (3, NOMINAL).

    Args:
        start: biomass, glycerol and enzyme [kg/m3], the printed ones. hours: its length; after 7.6 h there is no
            glycerol left.
    """
    plant = EcoliCulture()
    p = plant.unpack_parameters(plant.start_parameters())
    per, step = 4, hours * HOUR / (4 * (NOMINAL - 1))
    states = [np.array(start)]
    for _ in range(per * (NOMINAL - 1)):
        states.append(rk4_step(lambda t, x: plant.flow(t, x, None, p), 0.0, step, states[-1]))
    return np.array(states[::per]).T
