"""Connection lines: ``source -> target, target`` as pairs of names. Standard library only."""

from __future__ import annotations

from collections.abc import Iterable

from cosim.errors import ScenarioError


def parse_connections(lines: Iterable[str], where: str) -> list[tuple[str, str]]:
    """Pairs (source, target) from lines such as ``driver.effort -> locomotive.effort, observer.effort``.

    Raises:
        ScenarioError: a line has no arrow or an empty side.
    """
    pairs: list[tuple[str, str]] = []
    for number, line in enumerate(lines, start=1):
        source, arrow, targets = (part.strip() for part in line.partition("->"))
        names = [target.strip() for target in targets.split(",")]
        if not arrow or not source or not all(names):
            raise ScenarioError(f"{where}: connections, line {number}: {line!r} is not 'source.signal -> target.signal'.")
        pairs += [(source, name) for name in names]
    return pairs
