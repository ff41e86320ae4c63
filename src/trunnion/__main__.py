"""`python -m trunnion`, and what the command `trunnion` runs.

It imports nothing but what Python has loaded anyway: Ctrl-C ends the process in one line before the rest is loaded,
which takes the better part of a second.
"""

import _signal  # type: ignore[import-not-found]  # `signal` itself loads more than all of this
import atexit
import gc
import os
import sys


def _leave(*_: object) -> None:
    os.write(2, b"stopped\n")
    os._exit(130)


def main() -> None:
    """Run the command line, and end the process."""
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:  # else it is not for us
        _signal.signal(_signal.SIGINT, _leave)
    gc.set_threshold(50_000, 20, 50)  # what is loaded stays: looking it through again and again takes a twentieth
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: starting its threads takes longer
    ended: list[object] = []
    atexit.register(_end, ended)  # before any other, so that it is the last to run
    from trunnion.cli.app import main as run

    try:
        run()
    except SystemExit as end:
        ended.append(end.code)
        raise


def _end(ended: list[object]) -> None:
    """End at once when all is written: Python would take down each of a thousand modules first, a fifth of a short run.

    The usual way is left to a fault, to a stream that is gone, and to a profiler or debugger.
    """
    if not ended or not isinstance(ended[0], int) or sys.gettrace() or sys.getprofile():
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError):
        return
    os._exit(ended[0])


if __name__ == "__main__":
    main()
