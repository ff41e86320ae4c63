"""The studio's server: on this machine alone, for the one page that was opened with its token.

Loopback only; Host and Origin are checked; the token of the address becomes a cookie, and without it there is nothing.
Files are models of one folder: names with no way out of it, links resolved. Answers are made in a process of their own
thread, one after another; nothing but the text of a model comes from the page.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import mimetypes
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Lock
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from trunnion.files import whole
from trunnion.studio.page import document, found, script

__all__ = ["Studio"]

COOKIE = "trunnion_studio"
# what a link to a model is opened with by a browser that does not know the token
STRANGER = """<!doctype html><meta charset="utf-8"><title>Trunnion</title>
<body style="font: 16px/1.5 system-ui, sans-serif; max-width: 40em; margin: 4em auto; padding: 0 1em">
<h1 style="font-size: 1.2em">This browser is not let in yet</h1><p>{}</p>
<p>A link that holds a model goes on with <code>#m=</code>. Open that address first; then open the link again, or
paste it under File, Open.</p>"""
FILE_HEADERS = {"X-Content-Type-Options": "nosniff", "Cache-Control": "no-cache"}
MODELS = (".yaml", ".yml")
MOST_BYTES = 2_000_000
MOST_FILES = 500
PATIENCE = 1.0  # s that the rest waits for the page
ANSWERING = Lock()  # one after another: the second about a text finds what was read for the first


@dataclass(frozen=True)
class Studio:
    """folder: whose models can be opened and saved; opened: the one that is opened first; port: of the server."""

    folder: Path
    opened: str | None
    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    seen: Event = field(default_factory=Event)  # that the page has what its first picture is drawn of

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    def app(self) -> Starlette:
        """The web application."""
        routes = [
            Route("/", self._guarded(self._page)),
            Route("/modules.js", self._guarded(self._modules)),
            Route("/files", self._guarded(self._files)),
            Route("/file/{name:path}", self._guarded(self._read)),
            Route("/first/{name:path}", self._guarded(self._first)),
            Route("/thumbnail/{name}", self._guarded(_thumbnail)),
            Route("/file/{name:path}", self._guarded(self._write), methods=["PUT"]),
            Route("/{place:str}/{name:path}", self._guarded(self._asset)),
            WebSocketRoute("/socket", self._socket),
        ]
        return Starlette(routes=routes, lifespan=self._warmed)

    @contextlib.asynccontextmanager
    async def _warmed(self, app: Starlette) -> AsyncIterator[None]:
        """While it runs. What answers is loaded beside, and solves the opened model, while the browser opens."""
        text = ""
        with contextlib.suppress(ValueError, OSError):
            text = self._text(self.opened or "")
        warming = asyncio.get_running_loop().run_in_executor(None, _look, text, self.seen)
        yield
        self.seen.set()
        await warming

    # ---- who may ask ----------------------------------------------------------------------------------------------

    def _refusal(self, connection: HTTPConnection) -> str | None:
        """Why a question is not answered; None if it is."""
        hosts = {f"{name}:{self.port}" for name in ("127.0.0.1", "localhost")}
        if connection.headers.get("host") not in hosts:
            return "The studio answers this machine alone."
        origin = connection.headers.get("origin")
        if origin is not None and origin not in {f"http://{host}" for host in hosts}:
            return "The studio answers its own page alone."
        if not secrets.compare_digest(connection.cookies.get(f"{COOKIE}_{self.port}", ""), self.token):
            return "Open the studio with the address that `trunnion studio` printed."
        return None

    def _guarded(self, handle: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
        async def guarded(request: Request) -> Response:
            given = request.query_params.get("token", "")
            refusal = self._refusal(request)
            hosts = request.headers.get("host") in {f"{name}:{self.port}" for name in ("127.0.0.1", "localhost")}
            if hosts and request.url.path == "/" and given and secrets.compare_digest(given, self.token):
                page = RedirectResponse("/", status_code=303)
                page.set_cookie(f"{COOKIE}_{self.port}", self.token, httponly=True, samesite="strict")
                return page
            if refusal is not None:
                if hosts and request.url.path == "/":
                    return HTMLResponse(STRANGER.format(refusal), status_code=403)
                return PlainTextResponse(refusal, status_code=403)
            return await handle(request)

        return guarded

    # ---- the page -------------------------------------------------------------------------------------------------

    async def _page(self, request: Request) -> Response:
        nonce = secrets.token_urlsafe(16)
        policy = (
            f"default-src 'none'; script-src 'self' 'nonce-{nonce}'; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; "
            "form-action 'none'; frame-ancestors 'none'"
        )
        headers = {"Content-Security-Policy": policy, "Cache-Control": "no-store", "Referrer-Policy": "no-referrer"}
        first = "/first/" + quote(self.opened, "!'()*") if self.opened else ""
        return Response(document(nonce, first), media_type="text/html; charset=utf-8", headers=headers)

    async def _modules(self, request: Request) -> Response:
        return Response(script(), media_type="text/javascript", headers=FILE_HEADERS)

    async def _asset(self, request: Request) -> Response:
        place, name = request.path_params["place"], request.path_params["name"]
        with contextlib.suppress(LookupError, OSError, ValueError):
            content = found(place, name).read_bytes()
            kind = "text/javascript" if name.endswith(".js") else mimetypes.guess_type(name)[0]
            return Response(content, media_type=kind or "application/octet-stream", headers=FILE_HEADERS)
        return PlainTextResponse("There is no such file.", status_code=404)

    # ---- models ---------------------------------------------------------------------------------------------------

    def _model(self, name: str) -> Path:
        """A model of the folder; ValueError for any other file."""
        path = self.folder / name
        plain = Path(name).name == name and "\\" not in name and not name.startswith(".")
        if not plain or path.suffix.lower() not in MODELS:
            raise ValueError(f"'{name[:60]}' is not the name of a model file, such as press.yaml")
        if path.resolve().parent != self.folder.resolve():
            raise ValueError(f"'{name[:60]}' leads out of the folder")
        return path

    async def _files(self, request: Request) -> Response:
        names = sorted(
            one.name for one in self.folder.iterdir() if one.suffix.lower() in MODELS and self._is_model(one.name)
        )
        return JSONResponse({"folder": self.folder.name, "open": self.opened, "files": names[:MOST_FILES]})

    def _is_model(self, name: str) -> bool:
        with contextlib.suppress(ValueError):
            return self._model(name).is_file()
        return False

    def _text(self, name: str) -> str:
        """The text of a model of the folder; ValueError or OSError if it cannot be had."""
        path = self._model(name)
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"'{path.name}' is larger than {MOST_BYTES:,} bytes")
        return path.read_text(encoding="utf-8")

    async def _read(self, request: Request) -> Response:
        try:
            return PlainTextResponse(self._text(request.path_params["name"]))
        except (ValueError, OSError) as error:
            return JSONResponse({"error": _reason(error)}, status_code=404)

    async def _first(self, request: Request) -> Response:
        """A model's text with what its first picture is drawn of, as an answer to a question."""
        try:
            text = self._text(request.path_params["name"])
        except (ValueError, OSError) as error:
            return JSONResponse({"error": _reason(error)}, status_code=404)
        content = await run_in_threadpool(_placed, text)
        self.seen.set()
        return Response(content, media_type="application/octet-stream")

    async def _write(self, request: Request) -> Response:
        try:
            path, content = self._model(request.path_params["name"]), await request.body()
            if len(content) > MOST_BYTES:
                raise ValueError(f"a model of {len(content):,} bytes is not saved; {MOST_BYTES:,} at most")
            with whole(path) as temporary:
                temporary.write_bytes(content)
            return JSONResponse({"saved": path.name})
        except (ValueError, OSError) as error:
            return JSONResponse({"error": _reason(error)}, status_code=400)

    # ---- questions ------------------------------------------------------------------------------------------------

    async def _socket(self, socket: WebSocket) -> None:
        if self._refusal(socket) is not None or socket.headers.get("origin") is None:
            await socket.close(code=4403)
            return
        await socket.accept()
        turn = asyncio.Lock()
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                question = await socket.receive_text()
                async with turn:
                    await socket.send_bytes(await run_in_threadpool(_answered, question))


async def _thumbnail(request: Request) -> Response:
    """The small picture of an example, as an answer to a question."""
    from trunnion.studio.answers import examples

    text = examples().get(request.path_params["name"])
    if text is None:
        return PlainTextResponse("There is no such example.", status_code=404)
    headers = {"Cache-Control": "max-age=3600"}
    content = await run_in_threadpool(_small, text)
    return Response(content, media_type="application/octet-stream", headers=headers)


def _small(text: str) -> bytes:
    from trunnion.studio.message import packed
    from trunnion.studio.thumbnails import thumbnail

    with ANSWERING:
        return packed(thumbnail(text))


def _look(text: str, seen: Event) -> None:
    """Load what answers, the first picture before the rest, and have the model solved before the page asks for it."""
    _placed(text)
    seen.wait(PATIENCE)  # to load the rest beside would hold up the page
    import trunnion.studio.answers  # noqa: F401  # not while answers are being made: the page may ask for the picture

    _answered(json.dumps({"ask": "model", "text": text}))


def _placed(text: str) -> bytes:
    from trunnion.studio.message import packed
    from trunnion.studio.placed import placed

    with ANSWERING:
        return packed(placed(text))


def _answered(question: str) -> bytes:
    """The answer to a question; what it takes is loaded with the first."""
    from trunnion.studio.answers import answer

    with ANSWERING:
        return answer(question.encode())


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error)
    return f"{text[:1].upper()}{text[1:]}."
