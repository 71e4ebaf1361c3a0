"""In a worker process: jobs are done as they come through a pipe, until nobody asks any more."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import tempfile
import threading
import time
from multiprocessing import connection, spawn
from pathlib import Path
from typing import Any

from cosim.process.last_call import LAST_CALL
from cosim.runs import workers
from cosim.runs.job import Ended, Failure, perform

_PAUSE = 1.0
"""How often is looked whether the process that asked is still there [s]."""


def serve(handle: int, page: str, script: dict[str, str]) -> None:
    """Answer until the other end of the pipe is closed.

    Args:
        handle: of the pipe. page: file of the page that shows which call of an FMU is the present one.
        script: where the classes of the script are found that jobs need; empty where they need none.
    """
    LAST_CALL.attach(Path(page))
    LAST_CALL.timed = True
    tempfile.tempdir = str(Path(page).parent)  # what a process that dies leaves behind is removed with it
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one who asks is interrupted, and ends this process
    pipe = _opened(handle)
    if script:
        _run_script(script)
    while True:
        try:
            data = pipe.recv_bytes()
        except (EOFError, ConnectionResetError):
            return
        try:
            pipe.send_bytes(_response(data))
        except (BrokenPipeError, ConnectionResetError):
            return


def _end_with(parent: int) -> None:
    """End this process when the one that asked is gone, whatever it does: nobody else would end a call that hangs."""
    while os.getppid() == parent:
        time.sleep(_PAUSE)
    os._exit(1)


def _run_script(script: dict[str, str]) -> None:
    """As a process of `multiprocessing` does; no runs begin in it."""
    workers.importing_script = True
    try:
        spawn.prepare(dict(script))
    except Exception as error:  # the user's script, whatever it raises
        LAST_CALL.note(f"its process could not run the script again for its classes: {error}")
        sys.exit(1)
    workers.importing_script = False


def _opened(handle: int) -> Any:
    if sys.platform == "win32":
        return connection.PipeConnection(handle)
    return connection.Connection(handle)


def _response(data: bytes) -> bytes:
    try:
        job = pickle.loads(data)
    except Exception as error:  # a class that is not found here, whatever its module raises
        return pickle.dumps(Ended(failure=Failure(f"it cannot be passed to a process of its own: {_named(error)}")))
    ended = perform(job)
    try:
        return pickle.dumps(ended)
    except (TypeError, AttributeError, ValueError, pickle.PicklingError) as error:
        reason = f"its row cannot be passed between processes: {error}"
        return pickle.dumps(Ended(failure=Failure(reason), seconds=ended.seconds))


def _named(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
