"""`python -m trunnion`, and what the command `trunnion` runs.

It imports nothing but what Python has loaded anyway: Ctrl-C ends the process in one line before the rest is loaded,
which takes the better part of a second.
"""

import _signal  # type: ignore[import-not-found]  # `signal` itself loads more than all of this
import os


def _leave(*_: object) -> None:
    os.write(2, b"stopped\n")
    os._exit(130)


def main() -> None:
    """Run the command line."""
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:  # else it is not for us
        _signal.signal(_signal.SIGINT, _leave)
    from trunnion.cli.app import main as run

    run()


if __name__ == "__main__":
    main()
