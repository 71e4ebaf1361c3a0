"""The fixture `fmu_regression`: run, compare with the baseline of the test, fail with a table and a picture.

What runs and compares is imported inside the calls, so that pytest starts as fast as without this plugin.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cosim.errors import CosimError
from cosim.pytest_plugin import options
from cosim.pytest_plugin.records import Records, RegressionRecord, Status

if TYPE_CHECKING:
    from cosim.baselines import Regression
    from cosim.baselines.call import Call
    from cosim.scenario.scenario_tables import Isolate
import re
from hashlib import sha256

from plant_models.missing_package import is_installed, missing_package

UPDATE = "If the new outputs are right, accept them with: pytest --fmu-baseline=update"


_LONGEST = 120
"""Characters of a name; some file systems end at 255, with folders and endings."""


def _baseline_name(node: str, call: str = "") -> str:
    """The name of a baseline, without folder and ending.

    Args:
        node: of the test behind its file: ``test_brakes[wet]``, ``TestDrive::test_start``.
        call: name or number of the call in a test that makes several; empty for the first without a name.

    Returns:
        ``test_brakes-wet``, ``TestDrive.test_start``, ``test_brakes-wet@second``. Where characters had to be replaced,
        some characters of a digest follow, so that two tests never share a baseline.
    """
    plain = re.sub(r"\[(.*)\]$", r"-\1", node, flags=re.DOTALL).replace("::", ".")
    name = _safe(plain) + (f"@{_safe(call)}" if call else "")
    return name if len(name) <= _LONGEST else f"{name[:_LONGEST]}-{_digest(node + call)}"


def _safe(text: str) -> str:
    safe = re.sub(r"[^A-Za-z0-9._-]", "_", text)
    return safe if safe == text and not text.endswith(".") else f"{safe}-{_digest(text)}"


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]


class FmuRegression:
    """Runs an FMU or a scenario and compares its outputs with the baseline of the test.

    A test may call it more than once; the baselines are then numbered, or named with `name`.

    Args:
        request: of the test.
    """

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self._node = request.node
        self._config = request.config
        self._file = Path(request.node.path)
        self._calls: list[str] = []

    def __call__(
        self,
        what: Any,
        *,
        stop: float | None = None,
        step: float | None = None,
        start: float | None = None,
        inputs: Mapping[str, Any] | str | Path | None = None,
        parameters: Mapping[str, Any] | None = None,
        record: Sequence[str] = (),
        overrides: Mapping[str, Any] | None = None,
        interpolation: str | Mapping[str, str] | None = None,
        units: Mapping[str, Any] | None = None,
        signals: Sequence[str] | None = None,
        every: float | None = None,
        tolerance: Any = None,
        tolerances: Mapping[str, Any] | None = None,
        ignore: Iterable[str] = (),
        name: str | None = None,
        isolate: Isolate | None = None,
    ) -> Regression:
        """Run and compare.

        Args:
            what: path of an FMU; name or path of a scenario; a `Scenario`; an `Outcome` or a `Result` of a run made
                already. Relative paths start at the test file.
            start, stop, step: of the run [s]; of an FMU alone those of its default experiment where not given.
            inputs: of an FMU alone: constants by name, or a table (CSV) with a column for each.
            parameters: start values of an FMU alone. record: its variables to record besides the outputs.
            interpolation: of the columns of a table of inputs: ``hold`` or ``linear``, for all or for some by name.
            units: what is known of the variables of an FMU alone and not declared: ``{"vIst": "km/h"}``.
            overrides: of a scenario: ``{"locomotive.mass": 70e3}``.
            signals: names or patterns of the signals to keep and compare; None for all.
            every: least spacing of the rows kept [s]; None for at most about 2000 rows.
            tolerance: for all signals: a number (share of the range), a `Tolerance` or a mapping with its keys.
            tolerances: for single signals, by name or pattern. ignore: names or patterns of signals not to compare.
            name: of this call, where a test makes several.
            isolate: ``run`` for a process of the run, the default for FMUs of others, ``component`` for one of each
                FMU, ``no`` for this one; where a scenario says something itself, that holds.

        Returns:
            The comparison, with `outcome` and `actual`: what ran.
        """
        from cosim.baselines.call import Call  # noqa: PLC0415 - pytest must start fast

        path, reason = self._path(name), ""
        compared: dict[str, Any] = {"signals": signals, "every": every, "ignore": ignore}
        compared |= {"tolerance": tolerance, "tolerances": tolerances}
        run: dict[str, Any] = {"start": start, "stop": stop, "step": step, "overrides": overrides, "units": units}
        run |= {"inputs": inputs, "parameters": parameters, "record": record, "interpolation": interpolation}
        try:
            call = Call.run(what, self._file.parent, path, isolate=isolate, **compared, **run)
            return self._update(call) if options.mode(self._config) == "update" else self._check(call)
        except (CosimError, ModuleNotFoundError) as error:
            reason = str(error) if isinstance(error, CosimError) else missing_package(error)
            if not reason:
                raise
            self._keep(path, *(("error", [reason]) if path.exists() else ("missing", [])))
        pytest.fail(f"fmu_regression: {reason}", pytrace=False)  # outside of the handler: no traceback of ours

    def _path(self, name: str | None) -> Path:
        """Path of this call's baseline."""
        call = name or (str(len(self._calls) + 1) if self._calls else "")
        if call in self._calls:
            pytest.fail(
                f"fmu_regression: this test has a baseline named {call!r} already; give another name=...", pytrace=False
            )
        self._calls.append(call)
        node = self._node.nodeid.partition("::")[2] or self._node.name
        return options.baseline_folder(self._config, self._file) / f"{_baseline_name(node, call)}.json"

    def _check(self, call: Call) -> Regression:
        """Compare; a missing baseline or a difference fails the test, unless all differences were asked for."""
        tolerant = options.mode(self._config) == "diff"
        if tolerant and not call.path.exists():
            self._keep(call.path, "missing")
            return call.without_baseline()
        found = call.check()
        if found.equal:
            self._keep(call.path, "equal", list(found.notes), headlines=call.headlines(found))
            # of an earlier run: it would not speak of this one
            shutil.rmtree(self._artifacts(call.path), ignore_errors=True)
            return found
        files = self._draw(found, call.path)
        self._keep(call.path, "differs", call.worst(found), files, headlines=call.headlines(found))
        if not tolerant:
            pytest.fail(self._explanation(call, found, files), pytrace=False)
        return found

    def _update(self, call: Call) -> Regression:
        """Leave what is to be written for the end of the session."""
        update = call.update()
        staged = ""
        if update.texts:
            folder = Records.of(self._config).stage()
            for kind, text in update.texts.items():
                (folder / kind).write_text(text, encoding="utf-8", newline="\n")
            staged = str(folder)
        lines = [] if update.before is None else call.worst(update.before)
        self._keep(call.path, update.change, [*update.notes, *lines], staged=staged)
        return update.after

    def _explanation(self, call: Call, found: Regression, files: Mapping[str, str]) -> str:
        from cosim.comparison.comparison_text import comparison_text  # noqa: PLC0415 - only for what differs

        files = {"baseline": options.shown(call.path, self._config), **files}
        where = [f"{kind:>8}: {path}" for kind, path in files.items()]
        return "\n".join([comparison_text(found).rstrip(), "", *where, UPDATE])

    def _draw(self, found: Regression, path: Path) -> dict[str, str]:
        """Page and pictures of a difference; where they cannot be made, why."""
        folder = self._artifacts(path)
        try:
            from cosim.report.page.comparison import write_comparison  # noqa: PLC0415 - plotting only for what differs

            root = options.artifacts_folder(self._config)
            root.mkdir(parents=True, exist_ok=True)
            (root / ".gitignore").write_text("*\n", encoding="utf-8")
            drawn = is_installed("matplotlib")  # the page shows the same, to be explored
            files = write_comparison(found, folder, pictures=drawn)
            return {kind: options.shown(file, self._config) for kind, file in files.items()}
        except Exception as error:  # the difference must be reported, whatever happens to its picture
            return {"picture": f"could not be made: {missing_package(error) or error}"}

    def _artifacts(self, path: Path) -> Path:
        return options.artifacts_folder(self._config) / self._file.stem / path.stem

    def _keep(
        self,
        path: Path,
        status: Status,
        lines: Sequence[str] = (),
        files: Mapping[str, str] | None = None,
        staged: str = "",
        headlines: Mapping[str, str] | None = None,
    ) -> None:
        """Keep what was found for the end of the session, and as properties of the test for a JUnit file."""
        place = str(self._file), self._node.location[1] + 1
        kept = list(lines), dict(files or {}), staged, dict(headlines or {})
        record = RegressionRecord(self._node.nodeid, str(path), status, *kept, *place)
        Records.of(self._config).add(record)
        self._node.user_properties.extend(record.properties())
