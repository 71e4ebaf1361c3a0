"""Loading a module changes nothing but what is loaded."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import pytest

from plant_models.module_loading import load_module


@pytest.mark.parametrize("collects", [True, False])
@pytest.mark.parametrize("fails", [True, False])
def test_garbage_is_looked_for_afterwards_as_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, collects: bool, fails: bool
) -> None:
    """Whether it was before or not, and whether the module can be loaded or not; meanwhile it is not."""
    name = f"loaded_{collects}_{fails}"
    (tmp_path / f"{name}.py").write_text(f"import gc\nSEEN = gc.isenabled()\n{'1 / 0' if fails else ''}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        if fails:
            with pytest.raises(ZeroDivisionError):
                load_module(name)
        else:
            assert load_module(name) is sys.modules[name]
            assert sys.modules[name].SEEN is False
        assert gc.isenabled() == collects
    finally:
        (gc.enable if before else gc.disable)()
