"""From observers, gaps and connections to the certificates of gains, with warnings of what speaks against them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from cosim.run.certificates import check_certificates
from cosim.run.checked_tables import Stated
from cosim.run.conditions import check_conditions, deaf_receivers, left_working_points, other_plants
from cosim.run.coupled import Coupled
from cosim.run.expected_gaps import Sources
from cosim.run.remarks import Remarks
from cosim.run.task import RunTask

Certificates = dict[str, dict[str, Any]]
"""As plain data, by component."""


def check_observers(
    task: RunTask, coupled: Coupled, stated: Stated, receivers: Collection[str], remarks: Remarks
) -> Certificates:
    """Judge the observers before the run.

    Args:
        task: of the run. coupled: its components and network. stated: layout and connections.
        receivers: components that take telegrams. remarks: of the run.

    Returns:
        Certificates of those that offer one.

    Raises:
        CertificateError: the scenario requires certificates, and not all hold.
    """
    tables, mode, where = task.table.components, task.table.certificates, task.where
    certificates: Certificates = {}
    of_gaps: list[str] = []
    if mode != "ignore":
        network = coupled.network
        sources = Sources(task.table, coupled.components, stated.links, stated.layout, receivers, network, where)
        certificates, of_gaps = check_certificates(tables, sources.gaps(), mode, where)
    others = deaf_receivers(tables, receivers, stated.links, where)
    others += other_plants(tables, where)
    others += left_working_points(tables, stated.links, where)
    remarks.warn(*of_gaps, *check_conditions(tables, mode, where), *others)
    return certificates
