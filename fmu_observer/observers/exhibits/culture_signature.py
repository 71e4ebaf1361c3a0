"""Partial inversion with one state measured: the culture of E. coli."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from fmu_observer.formulas.signatures.inversion import Found, network_inverse, polynomial_refinement, weighted_inverse
from fmu_observer.formulas.signatures.pencil import NextScaling
from fmu_observer.observers.generic.signature.signature_observer import InvertedWindow, SignatureObserver
from fmu_observer.observers.parameter_values import Value
from plant_models.exhibits.ecoli_culture import HOUR, EcoliCulture
from plant_models.hybrid import Array, parameter, vector
from plant_models.hybrid.integration import rk4_step
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.scan import enclosed, scan

ORDER, POINTS = 6, 2  # printed N; N_O = 8
NOMINAL = 32
"""Places of the nominal run that are kept."""
_HOURS, _LEAST_GLYCEROL = 7.5, 0.09  # of the nominal run [h], [kg/m3]
_LEAST_ENZYME = 1e-4  # [kg/m3]
FINE = 13  # values an axis of the network as refined for the weights
SHARPNESS = 20.0  # where `look_up_errors` is smallest under noise of 1 %

_RUN_ERROR = 5e-3
"""Of its range, that the end of the nominal run may be off; trapezoids between its places leave 2.8e-3 [ours]."""

_LookUp = Literal["weighted", "cell"]


class CultureSignature(SignatureObserver):
    """Reduced signature observer of `ecoli_culture`: Omar 2012, section 4.7, (4.7.5)-(4.7.9).

    Biomass is measured; glycerol and enzyme are found in the network that the signatures of light make over an
    admissible tube around a nominal run, ``S0(X) +- 0.4`` and ``P0(X) +- 0.04`` (4.7.5), with `nodes` values of each.
    Properties are the mean abscissa and the mean ordinate of the points (4.7.8).

    The network changes steeply with X. The thesis tabulates it over a grid of X whose half-width it does not print;
    here the signatures of the nodes are computed for the X that is measured, so that no table of them is interpolated
    [ours]. S0(X) and P0(X) are a table, which belongs to the parameters of the plant: one of another run than theirs is
    refused, `tabulated` makes it. ``literal`` scaling: with ``norm`` both
    quantities move the properties in nearly one direction.

    How a point is found is not printed in full ("curvilinear"). ``cell`` takes the place in the quadrilateral
    around it, exact without noise. ``weighted`` is the mean of the network, refined to 13 x 13 nodes by the polynomial
    through its own, by ``exp(-mu distance)`` as in (4.6.5); mu is not printed, and is that of the smallest error over
    states of the tube with noise of 1 % (`look_up_errors`) [ours].

    Args:
        nodes: values of glycerol and of enzyme in the network, printed 3. next_scaling: see above. look_up: see above;
            ``cell`` where noise is far below 1 %.

    Raises:
        ValueError: an option is no whole number or out of bounds, or unknown.
    """

    name = "culture_signature"
    description = "Signature observer of the E. coli culture, biomass and light measured"
    source = "Omar 2012, (4.7.5)-(4.7.9)"
    option_choices = {
        "nodes": range(2, 8),
        "next_scaling": ("literal", "norm"),
        "look_up": ("weighted", "cell"),
    }

    def __init__(self, nodes: int = 3, next_scaling: NextScaling = "literal", look_up: _LookUp = "weighted") -> None:
        require_whole(self.name, 2, 7, nodes=nodes)
        require_chosen(self.name, self.option_choices, look_up=look_up)
        self.look_up: _LookUp = look_up
        self.nodes, fine = np.linspace(-1.0, 1.0, nodes), np.linspace(-1.0, 1.0, FINE)
        self._fine_nodes = np.stack(np.meshgrid(fine, fine, indexing="ij"), axis=-1).reshape(-1, 2)
        along = polynomial_refinement(self.nodes, fine)
        self._refinement = np.kron(along, along)
        biomass, glycerol, enzyme = _nominal_run()
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
                parameter("sharpness", "1", SHARPNESS, "Sharpness mu of the weights of the look-up", min=0.0),
            ),
        )
        super().__init__(nodes=nodes, next_scaling=next_scaling, look_up=look_up)

    def tabulated(
        self, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> dict[str, np.ndarray]:
        """The nominal run for other parameters, to be set together with them: while there is as much glycerol as at the
        end of the printed one, 7.5 h at most.

        Args:
            parameters: values by name; those of the plant matter. preset: to start from.

        Raises:
            ValueError: a parameter is unknown, not finite or of another size; or the run has no rising biomass.
        """
        p, hours = self.model_values(parameters, preset), _HOURS
        run = _nominal_run(p=p)
        while run[1][-1] < _LEAST_GLYCEROL and hours > 1.0:
            hours *= 0.95
            run = _nominal_run(hours=hours, p=p)
        biomass, glycerol, enzyme = run
        if not np.all(np.diff(biomass) > 0.0):
            raise ValueError(f"{self.name}: with these parameters biomass does not rise along the nominal run.")
        return {"nominal_biomass": biomass, "nominal_glycerol": glycerol, "nominal_enzyme": enzyme}

    def table_errors(self, p: Any) -> dict[str, Array]:
        """How far glycerol and enzyme end beside the nominal run where they follow the model's slopes over biomass."""
        places = np.stack([p.nominal_biomass, p.nominal_glycerol, p.nominal_enzyme])
        rates = self.plant.rates(places, self.model_parameters((), p))
        grown = p.nominal_biomass[1:] - p.nominal_biomass[:-1]
        offs = []
        for i in (1, 2):
            slope = rates[i] / np.where(np.abs(rates[0]) > 0.0, rates[0], 1e-300)
            lacks = places[i][1:] - places[i][:-1] - 0.5 * (slope[1:] + slope[:-1]) * grown
            size = np.max(places[i]) - np.min(places[i])
            offs.append(np.abs(np.sum(lacks)) / (_RUN_ERROR * np.maximum(size, 1e-300)))
        return {"nominal run": np.max(np.stack(offs))}

    def inverted(self, past: Sequence[Array], x: Any, p: Any) -> InvertedWindow:
        """Glycerol and enzyme at the oldest sample, of its biomass and the light of the window."""
        X = past[0][0]
        target = self.properties(past[1], p.regularisation)
        S0, P0 = (
            enclosed(course, np.stack([X]), p.nominal_biomass, values)[0][0]
            for values in (p.nominal_glycerol, p.nominal_enzyme)
        )
        model = (getattr(self.model_parameters((), p), name) for name in self._model._fields)
        tube = (X, S0, P0, p.glycerol_width, p.enzyme_width)
        found = Found(*enclosed(self._network(), vector(*model, *tube, p.regularisation, p.sharpness), target))
        state = _in_tube(X, S0 + p.glycerol_width * found.values[0], P0 + p.enzyme_width * found.values[1])
        return InvertedWindow(state, found.outside[0])

    def _network(self) -> Callable[[Array, Array], tuple[Array, ...]]:
        """Place in the tube, and how far outside, of what is shared and the properties of a window; for `enclosed`.

        Shared are the parameters of the model, biomass, glycerol and enzyme of the nominal run with their widths,
        regularisation and sharpness.
        """
        count = len(self._model._fields)

        def sample(carry: Any, row: Any, shared: Any) -> Any:
            values = self._model(*(shared[0][i] for i in range(count)))
            X_, S_, P_, wide, narrow = (shared[0][count + i] for i in range(5))
            start = _in_tube(X_, S_ + wide * row[0][1], P_ + narrow * row[0][2])
            now = np.where(row[0][0] > 0.5, start, self.moved(carry[0], 1, values)[-1])
            return (now,), (np.stack([self.plant.measured(self.plant.named(now), values)[1]]),)

        def read(_carry: Any, row: Any, shared: Any) -> Any:
            return (), (self.properties(row[0], shared[0][-2]),)

        def network(shared: Array, target: Array) -> tuple[Array, ...]:
            places = [(a, b) for a in self.nodes for b in self.nodes]
            rows = [(np.array([k == 0, *place], dtype=float),) for place in places for k in range(self.window)]
            light = [found[0] for found in scan(sample, (np.ones(3),), rows, (shared,))[1]]
            windows = [(np.hstack(light[i : i + self.window]),) for i in range(0, len(light), self.window)]
            found = [result[0] for result in scan(read, (), windows, (shared,))[1]]
            place = self.looked_up([np.hstack([r[k] for r in found]) for k in range(2)], target, shared[-1])
            return place.values, np.stack([place.outside])

        return network

    def looked_up(self, network: Sequence[Array], target: Array, sharpness: Array) -> Found:
        """Places of glycerol and enzyme in the tube, from -1 to 1, shape (2,).

        Args:
            network: both properties at the nodes, row by row of glycerol, shape (nodes**2,) each. target: properties
                of the window, shape (2,). sharpness: mu of the weights [1].
        """
        count = len(self.nodes)
        square = [np.reshape(values, (count, count)) for values in network]
        found = network_inverse(self.nodes, self.nodes, square, target)
        if self.look_up == "cell":
            return found
        fine = [self._refinement @ values for values in network]
        return Found(weighted_inverse(self._fine_nodes, fine, (target[0], target[1]), sharpness), found.outside)

    def look_up_errors(
        self, sharpness: Sequence[float], noise: float = 0.01, draws: int = 600, seed: int = 0
    ) -> np.ndarray:
        """Errors of the weighted look-up of single windows, in half-widths of the tube, shape (c, 2).

        States lie evenly in the tube and along the nominal run, not at nodes of the network; biomass and light are read
        with noise. No run enters, so that the best mu is not made for one.

        Args:
            sharpness: candidates of mu [1], c of them. noise: largest share of a reading that it is off, evenly spread.
            draws: states. seed: of the draws.

        Returns:
            Root mean square over the draws, of glycerol and of enzyme.
        """
        p, last = self.model_values(), self.window - 1
        rng = np.random.default_rng(seed)
        X = rng.uniform(p.nominal_biomass[0], p.nominal_biomass[-1], draws)
        true = self._at(X, rng.uniform(-1.0, 1.0, (2, draws)), p)
        light = self._light(true, last, p) * (1.0 + rng.uniform(-noise, noise, (last + 1, draws)))
        read = X * (1.0 + rng.uniform(-noise, noise, draws))
        nodes = np.stack(np.meshgrid(self.nodes, self.nodes, indexing="ij")).reshape(2, -1, 1)
        network = self.properties(self._light(self._at(read, nodes, p), last, p), p.regularisation)
        fine = [self._refinement @ values for values in network]
        target = self.properties(light, p.regularisation)
        widths = np.array([[p.glycerol_width], [p.enzyme_width]])
        errors = []
        for mu in sharpness:
            found = self._at(read, weighted_inverse(self._fine_nodes, fine, (target[0], target[1]), mu), p)
            errors.append(np.sqrt(np.mean(((found - true)[1:] / widths) ** 2, axis=1)))
        return np.array(errors)

    def _at(self, X: np.ndarray, places: np.ndarray, p: Any) -> Array:
        """States at places of the tube, of shape (2, ..., m) from -1 to 1, shape (3, ..., m)."""
        S = np.interp(X, p.nominal_biomass, p.nominal_glycerol) + p.glycerol_width * places[0]
        P = np.interp(X, p.nominal_biomass, p.nominal_enzyme) + p.enzyme_width * places[1]
        return _in_tube(*np.broadcast_arrays(X, S, P))

    def _light(self, start: np.ndarray, last: int, p: Any) -> np.ndarray:
        """Light of windows that begin at these states, the oldest first."""
        return np.stack([self.plant.measured(self.plant.named(x), p)[1] for x in self.moved(start, last, p)])

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


def _in_tube(X: Array, S: Array, P: Array) -> Array:
    """A state with glycerol not negative and some enzyme, shape (3,).

    Args:
        X: biomass. S: glycerol. P: enzyme [kg/m3].
    """
    return vector(X, np.maximum(S, 0.0), np.maximum(P, _LEAST_ENZYME))


def course(X: Array, biomass: Array, values: Array) -> tuple[Array]:
    """Value of a nominal run where its biomass is X, linear between places, the end value beyond them; for `enclosed`.

    Args:
        X: [kg/m3], shape (1,). biomass: of the run, rising, shape (k,). values: there, shape (k,).

    Returns:
        The value, shape (1,).
    """
    shares = np.clip((X[0] - biomass[:-1]) / (biomass[1:] - biomass[:-1]), 0.0, 1.0)
    return (np.stack([values[0] + np.sum(shares * (values[1:] - values[:-1]))]),)


def _nominal_run(start: Sequence[float] = (0.05, 2.0, 0.01), hours: float = _HOURS, p: Any = None) -> np.ndarray:
    """Biomass, glycerol and enzyme of a nominal run at places evenly spread in time, shape (3, NOMINAL).

    Args:
        start: biomass, glycerol and enzyme [kg/m3], the printed ones. hours: its length; after 7.6 h there is no
            glycerol left. p: parameters of the plant; None for its own.
    """
    plant = EcoliCulture()
    p = plant.unpack_parameters(plant.start_parameters()) if p is None else p
    per, step = 4, hours * HOUR / (4 * (NOMINAL - 1))
    states = [np.array(start)]
    for _ in range(per * (NOMINAL - 1)):
        states.append(rk4_step(lambda _t, x: plant.rates(x, p), 0.0, step, states[-1]))
    return np.array(states[::per]).T
