"""A studio that runs on a folder while something is tried."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from trunnion.studio.server import Studio


@contextmanager
def served(folder: Path, opened: str | None, port: int = 0, **more: Any) -> Iterator[Studio]:
    """On a port, or one that is free, until it is left."""
    with socket.socket() as bound:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(("127.0.0.1", port))
        studio = Studio(folder, opened, bound.getsockname()[1], **more)
        server = studio.server()
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
        thread.start()
        while not server.started:
            thread.join(0.01)
        yield studio
        server.should_exit = True
        thread.join(10)
