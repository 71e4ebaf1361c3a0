"""The modules of the folder above as a package, for scripts that are run by their path: ``from shared.sheet import
Sheet``.
"""

from pathlib import Path

__path__ = [str(Path(__file__).resolve().parents[1])]
