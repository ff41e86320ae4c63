"""`trunnion studio`: draw a mechanism in the browser, drag it, watch its forces."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import Annotated

import typer

from trunnion.cli.files import verb
from trunnion.cli.terminal import line
from trunnion.errors import Finding, MechanismError

__all__ = ["studio"]

USUAL = 8765


@verb()
def studio(
    file: Annotated[Path | None, typer.Argument(help="Model to open, or the folder of models.")] = None,
    port: Annotated[
        int | None, typer.Option("--port", help="Port on this machine; default: 8765, or any if that is taken.")
    ] = None,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the browser.")] = True,
) -> None:
    """Draw a mechanism in the browser, drag it, watch its forces."""
    from trunnion.cli.forms import forms

    try:
        from trunnion.studio.server import Studio
    except ImportError:
        what = "the studio is not installed"
        raise MechanismError(Finding(what, remedy="install it: pip install 'trunnion[studio]'")) from None
    path = Path(os.path.realpath(file or Path()))  # a link in a circle stays one, and does not exist
    if file is not None and not path.exists():
        raise MechanismError(Finding("does not exist", str(file), "name a model file or a folder"))
    folder, opened = (path, None) if path.is_dir() else (path.parent, path.name)
    bound = _usual() if port is None else _bound(port)
    own = Studio(folder, opened, bound.getsockname()[1], forms=forms())
    line(f"studio: {own.address}")
    line("It answers this machine alone. Ctrl-C ends it.")
    if open_:
        import webbrowser

        webbrowser.open(own.entrance())
    own.server().run(sockets=[bound])


def _usual() -> socket.socket:
    """A socket on the usual port, where the browser finds unsaved work again; on any if that is taken."""
    try:
        return _bound(USUAL)
    except MechanismError:
        return _bound(0)


def _bound(port: int) -> socket.socket:
    """A socket on the loopback; MechanismError if the port is taken."""
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind(("127.0.0.1", port))
        found.listen(128)  # a browser that comes before the server runs waits instead of being refused
    except (OSError, OverflowError) as error:
        found.close()
        reason = getattr(error, "strerror", None) or str(error)
        raise MechanismError(
            Finding(f"port {port} cannot be had: {reason}", "--port", "choose another, or 0")
        ) from None
    return found
