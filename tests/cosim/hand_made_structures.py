"""Structures made by hand or at random, for the tests of text, layout and picture."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.coupling.strong import strong_groups
from cosim.structure.run_structure import Structure
from cosim.structure.structure_data import Balises, Link, Part, Port


def structure_of(
    names: Sequence[str],
    links: Sequence[Link],
    *,
    feedthrough: Sequence[tuple[str, str, str]] = (),
    loops: Sequence[tuple[tuple[str, str], ...]] = (),
    balises: Balises | None = None,
    title: str = "By hand",
) -> Structure:
    """A structure of components in the order given, with the ports that their links need and one output more."""
    edges = {(k.source[0], k.target[0]) for k in links}
    if balises is not None:
        edges |= {(balises.plant, name) for name in balises.receivers}
    groups = tuple(tuple(sorted(group, key=list(names).index)) for group in strong_groups(list(names), edges))
    index = {name: i for i, group in enumerate(groups) for name in group}
    parts = []
    for number, name in enumerate(names):
        inputs = dict.fromkeys(k.target[1] for k in links if k.target[0] == name)
        outputs = dict.fromkeys(k.source[1] for k in links if k.source[0] == name)
        direct = {o: tuple(u for c, u, y in feedthrough if (c, y) == (name, o)) for o in outputs}
        ports_in = tuple(Port(u, "m", "Float64", True) for u in inputs)
        ports_out = (
            *(Port(y, None, "Float64", True, direct[y]) for y in outputs),
            Port("more", "N", "Float64", False, ()),
        )
        kind = ("FMU", "block")[number % 2]
        parts.append(Part(name, kind, f"{number % 3 + 1}.0", "model", "file", ports_in, ports_out, (), (), index[name]))
    return Structure("hand", title, 0.0, 1.0, 0.1, tuple(parts), tuple(links), groups, tuple(loops), balises=balises)


def coupled(names: Sequence[str], pairs: Sequence[tuple[int, int, int]], **more: object) -> Structure:
    """Links ``(from, to, output number)`` by position in `names`; one that does not point forward is held."""
    links, inputs = [], dict.fromkeys(names, 0)
    for a, b, output in dict.fromkeys(pairs):
        inputs[names[b]] += 1
        source, target = (names[a], f"output_{output}"), (names[b], f"input_{inputs[names[b]]}")
        links.append(Link(source, target, held=a >= b))
    return structure_of(names, links, **more)  # type: ignore[arg-type]
