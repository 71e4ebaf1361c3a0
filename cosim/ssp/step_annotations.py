"""Communication steps in annotations of other tools: SSP itself has no word for them. Reads elements only.

Read are those of OSP (libcosim), Vico and OMSimulator, by the names of their elements: the files do not agree on
namespaces.
"""

from __future__ import annotations

from collections.abc import Iterator

from cosim.ssp.document import Node, find_all, short
from cosim.ssp.lapses import Lapses

FIXED = ("FixedStepAlgorithm", "FixedStepMaster")
VARIABLE = ("VariableStepAlgorithm", "VariableStepMaster", "VariableStepSolver")
LENGTHS = ("baseStepSize", "stepSize")
HOLDERS = ("ssd:DefaultExperiment/ssd:Annotations", "ssd:System/ssd:Annotations", "ssd:Annotations")
"""Where they stand: of the whole run, in the order in which they count. Those of nested systems and of components do
not.
"""


def read_step(root: Node, lapses: Lapses) -> float | None:
    """The communication step that an annotation of a structure asks for [s]; None where none does.

    Args:
        root: the structure. lapses: receives what is asked for and cannot be done.
    """
    for node in _annotated(root):
        name = short(node.tag)
        length = next((node.get(key) for key in LENGTHS if node.get(key) is not None), "")
        if name in VARIABLE:
            lapses.note(
                node, f"the annotation asks for {name}, which is not carried out; the communication step is fixed."
            )
        elif name in FIXED:
            try:
                step = float(length)
            except ValueError:
                step = 0.0
            if 0.0 < step < float("inf"):
                return step
            lapses.note(node, f"the annotation's {name} has the step {length!r}, expected seconds; it is not used.")
    return None


def _annotated(root: Node) -> Iterator[Node]:
    for holder in HOLDERS:
        for annotation in find_all(root, f"{holder}/ssc:Annotation"):
            yield from (node for node in annotation.iter() if isinstance(node.tag, str))
