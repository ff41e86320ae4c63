"""The studio's server: on this machine alone, for the one page that was opened with its token.

Loopback only; Host, Origin and Sec-Fetch-Site are checked. Who asks for more than the code of the page names the token
in a header. It is no cookie: browsers send those to every port of a machine. The page has it from the address that
opened it and keeps it in the browser's storage, which belongs to one port. Files are the regular files of one folder
that are models: names with no way out of it, links resolved. Answers are made in threads, one after another but for
those that take long; nothing but the text of a model comes from the page.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import logging
import mimetypes
import os
import secrets
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from trunnion.errors import MechanismError
from trunnion.files import whole
from trunnion.studio.jobs import Jobs
from trunnion.studio.page import document, found, script

SUBPROTOCOL = "trunnion"  # of the socket; the token comes as a second one, for a browser sends no other header there
STRANGER = """<!doctype html><meta charset="utf-8"><title>Trunnion</title>
<body style="font: 16px/1.5 system-ui, sans-serif; max-width: 40em; margin: 4em auto; padding: 0 1em">
<h1 style="font-size: 1.2em">This browser is not let in</h1><p>{}</p>"""
PRINTED = "Open the studio with the address that `trunnion studio` printed."
SPENT = (
    "This address has been used, and lets in one browser once. If that was not yours, end the studio: another "
    f"program has opened it. {PRINTED}"
)
FILE_HEADERS = {"X-Content-Type-Options": "nosniff", "Cache-Control": "no-cache"}
MODELS = (".yaml", ".yml")
MOST_BYTES = 2_000_000
MOST_FILES = 500
MOST_OF_A_QUESTION = 64 << 20  # bytes; a text that is longer than the studio reads is to be told so
Handler = Callable[[Request], Awaitable[Response]]

ANSWERING = Lock()  # one after another: the second about a text finds what was read for the first


@dataclass(frozen=True)
class Studio:
    """folder: whose models can be opened and saved; opened: the one that is opened first; port: of the server.

    forms: the studies that the page can start, see `studio.jobs`.
    """

    folder: Path
    opened: str | None
    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    entrances: set[str] = field(default_factory=set)  # codes of addresses that were not opened yet
    forms: Sequence[Mapping[str, Any]] = ()

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    def entrance(self) -> str:
        """An address that lets in the browser that opens it first: others may read it in the arguments of a process."""
        code = secrets.token_urlsafe(24)
        self.entrances.add(code)
        return f"http://127.0.0.1:{self.port}/?once={code}"

    def server(self) -> uvicorn.Server:
        """What serves it. No pings: an answer may take longer than they wait, and a loopback does not break."""
        return uvicorn.Server(uvicorn.Config(
            self.app(), log_level="warning", ws="websockets-sansio", ws_ping_interval=None,
            ws_max_size=MOST_OF_A_QUESTION,
            ws_per_message_deflate=False,  # nothing is far: to press an answer takes longer than to send it
        ))  # fmt: skip

    def app(self) -> Starlette:
        """The web application."""
        routes = [
            Route("/", self._own(self._page)),
            Route("/modules.js", self._own(self._modules)),
            Route("/files", self._own(self._files, admitted=True)),
            Route("/file/{name:path}", self._own(self._read, admitted=True)),
            Route("/file/{name:path}", self._own(self._write, admitted=True), methods=["PUT"]),
            Route("/import/{name}", self._own(_imported, admitted=True), methods=["PUT"]),
            Route("/jobs", self._own(self._jobs, admitted=True)),
            Route("/jobs", self._own(self._start, admitted=True), methods=["PUT"]),
            Route("/jobs/{number}", self._own(self._stop, admitted=True), methods=["DELETE"]),
            Route("/result/{code}", self._own(self._result)),
            Route("/{place:str}/{name:path}", self._own(self._asset)),
            WebSocketRoute("/socket", self._socket),
        ]
        return Starlette(routes=routes, lifespan=self._warmed)

    @contextlib.asynccontextmanager
    async def _warmed(self, app: Starlette) -> AsyncIterator[None]:
        """While it runs. What answers is loaded beside, and solves the opened model, while the browser opens."""
        text = ""
        with contextlib.suppress(ValueError, OSError):
            text = self._text(self.opened or "")
        warming = asyncio.get_running_loop().run_in_executor(None, _warm, text)
        yield
        self.jobs.close()
        await warming

    # ---- who may ask ----------------------------------------------------------------------------------------------

    def _refusal(self, connection: HTTPConnection) -> str | None:
        """Why a request is not one of the studio's own page; None if it is."""
        hosts = {f"{name}:{self.port}" for name in ("127.0.0.1", "localhost")}
        headers = connection.headers
        if headers.get("host") not in hosts:
            return "The studio answers this machine alone."
        elsewhere = headers.get("sec-fetch-site") in ("cross-site", "same-site")  # another port is the same site
        if (elsewhere and headers.get("sec-fetch-mode") != "navigate") or (
            headers.get("origin") not in {None, *(f"http://{host}" for host in hosts)}
        ):
            return "The studio answers its own page alone."
        return None

    def _knows(self, token: str) -> bool:
        return secrets.compare_digest(token.encode("utf-8", "replace"), self.token.encode())

    def _own(self, handle: Handler, admitted: bool = False) -> Handler:
        """A handler for requests of the own page, admitted: that name the token. What it cannot do is said in words."""

        async def guarded(request: Request) -> Response:
            token = request.headers.get("authorization", "")[len("Bearer ") :]
            refusal = self._refusal(request) or (PRINTED if admitted and not self._knows(token) else None)
            if refusal is not None:
                return PlainTextResponse(refusal, status_code=403)
            try:
                return await handle(request)
            except (ValueError, OSError) as error:
                return JSONResponse({"error": _reason(error)}, status_code=400 if request.method == "PUT" else 404)
            except Exception as error:
                logging.getLogger("uvicorn.error").exception("of %s", request.url.path)
                return JSONResponse({"error": f"The studio made a mistake: {_reason(error)}"}, status_code=500)

        return guarded

    # ---- the page -------------------------------------------------------------------------------------------------

    async def _page(self, request: Request) -> Response:
        """The document: with the token for who names it, or a code that was not used; the page keeps it."""
        token, code = (request.query_params.get(name) for name in ("token", "once"))
        entered = code in self.entrances
        self.entrances.discard(code or "")
        if token is not None and not self._knows(token):
            return HTMLResponse(STRANGER.format(PRINTED), status_code=403)
        if code is not None and not entered:
            return HTMLResponse(STRANGER.format(SPENT), status_code=403)
        nonce = secrets.token_urlsafe(16)
        policy = (
            f"default-src 'none'; script-src 'self' 'nonce-{nonce}'; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' data:; connect-src 'self'; base-uri 'none'; "
            "form-action 'none'; frame-src 'self'; frame-ancestors 'none'"
        )
        headers = {
            "Content-Security-Policy": policy, "Cross-Origin-Opener-Policy": "same-origin",
            "Cache-Control": "no-store", "Referrer-Policy": "no-referrer",
        }  # fmt: skip
        text = document(nonce, self.token if token is not None or entered else "")
        return Response(text, media_type="text/html; charset=utf-8", headers=headers)

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
        """A model of the folder, be it there or not; ValueError for any other file."""
        path = self.folder / name
        plain = Path(name).name == name and name.isprintable() and "\\" not in name and not name.startswith(".")
        if not plain or path.suffix.lower() not in MODELS:
            raise ValueError(f"'{name[:60]}' is not the name of a model file, such as press.yaml")
        if os.path.dirname(os.path.realpath(path)) != os.path.realpath(self.folder):
            raise ValueError(f"'{name[:60]}' leads out of the folder")
        if path.exists() and not path.is_file():
            raise ValueError(f"'{name[:60]}' is no regular file")  # a pipe would be waited for
        return path

    async def _files(self, request: Request) -> Response:
        """The models of the folder; `id` tells it from others of its name."""
        names = []
        for path in self.folder.iterdir():
            with contextlib.suppress(ValueError, OSError):
                names += [path.name] if self._model(path.name).is_file() else []
        return JSONResponse({
            "folder": self.folder.name.encode("utf-8", "replace").decode(),
            "id": hashlib.sha256(os.fsencode(os.path.realpath(self.folder))).hexdigest()[:16],
            "open": self.opened, "files": sorted(names)[:MOST_FILES],
        })  # fmt: skip

    def _text(self, name: str) -> str:
        """The text of a model of the folder; ValueError or OSError if it cannot be had."""
        path = self._model(name)
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"'{path.name}' is larger than {MOST_BYTES:,} bytes")
        return path.read_text(encoding="utf-8")

    async def _read(self, request: Request) -> Response:
        """The text of a model."""
        return JSONResponse({"text": self._text(request.path_params["name"])})

    async def _write(self, request: Request) -> Response:
        """Save `{text, opened, saved, over}` under a name, .yaml where it has no ending.

        opened, saved: the file that the page shows and the text that it has read there or written; over: whether
        another text that is there may be lost. Without that it stays, and the answer says so, 409 with `existing`.
        """
        body, name = json.loads(await request.body()), request.path_params["name"]
        if not isinstance(body, dict) or not isinstance(body.get("text"), str):
            raise ValueError("there is no text to be saved")
        content = body["text"].encode()
        if len(content) > MOST_BYTES:
            raise ValueError(f"a model of {len(content):,} bytes is not saved; {MOST_BYTES:,} at most")
        path = self._model(name if Path(name).suffix else f"{name}.yaml")
        opened = path.name == body.get("opened")
        made = not path.exists()
        if not made and body.get("over") is not True and self._other(path, body["text"], opened and body.get("saved")):
            what = "was changed elsewhere since it was opened" if opened else "is there already, with another text"
            return JSONResponse({"error": f"{path.name} {what}.", "existing": path.name}, status_code=409)
        if made:
            path.touch(exist_ok=False)  # a file that comes meanwhile is not replaced
        try:
            with whole(path) as temporary:
                temporary.write_bytes(content)
        except BaseException:
            if made:
                path.unlink(missing_ok=True)
            raise
        return JSONResponse({"saved": path.name})

    def _other(self, path: Path, *texts: object) -> bool:
        """Whether a file has another text than these, or none that can be read."""
        with contextlib.suppress(ValueError):
            return self._text(path.name) not in texts
        return True

    # ---- studies --------------------------------------------------------------------------------------------------

    @cached_property
    def jobs(self) -> Jobs:
        """The studies that the page has started."""
        return Jobs(self.forms, self.folder)

    async def _jobs(self, request: Request) -> Response:
        return JSONResponse({"forms": list(self.jobs.forms.values()), "jobs": self.jobs.told()})

    async def _start(self, request: Request) -> Response:
        """Start a study of `{text, name, verb, options, mapping}`."""
        body = json.loads(await request.body())
        if not isinstance(body, dict) or not isinstance(body.get("text"), str):
            raise ValueError("there is no model to be studied")
        mapping = self._model(str(body["mapping"])) if body.get("mapping") else None
        return JSONResponse({"id": self.jobs.start(body, str(body.get("name") or "model.yaml"), mapping)})

    async def _stop(self, request: Request) -> Response:
        self.jobs.stop(request.path_params["number"])
        return JSONResponse({})

    async def _result(self, request: Request) -> Response:
        """The report of a study, by a name that only the page was told; it runs in a frame that reaches nothing."""
        policy = (
            "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
            "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; frame-ancestors 'self'"
        )
        headers = {**FILE_HEADERS, "Content-Security-Policy": policy, "Referrer-Policy": "no-referrer"}
        return HTMLResponse(self.jobs.report(request.path_params["code"]), headers=headers)

    # ---- questions ------------------------------------------------------------------------------------------------

    async def _socket(self, socket: WebSocket) -> None:
        protocols = [*socket.scope["subprotocols"], "", ""]
        if self._refusal(socket) is not None or socket.headers.get("origin") is None or not self._knows(protocols[1]):
            await socket.close(code=4403)
            return
        await socket.accept(subprotocol=SUBPROTOCOL)

        async def tell(question: bytes) -> None:
            content = await run_in_threadpool(_answered, question)
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # nobody is there any more
                await socket.send_bytes(content)

        async with asyncio.TaskGroup() as answering:
            with contextlib.suppress(WebSocketDisconnect):
                while (question := await socket.receive())["type"] == "websocket.receive":
                    answering.create_task(tell(question.get("bytes") or (question.get("text") or "").encode()))


async def _imported(request: Request) -> Response:
    return JSONResponse(await run_in_threadpool(_import, request.path_params["name"], await request.body()))


def _import(name: str, content: bytes) -> dict[str, Any]:
    """The text of a model made of a dropped file of another program, `{text, says}`."""
    from trunnion.exchange.formats import import_file
    from trunnion.exchange.model_file import model_text

    with tempfile.TemporaryDirectory(prefix="trunnion-import-") as folder:
        path = Path(folder) / f"dropped{Path(name).suffix}"
        path.write_bytes(content)
        try:
            draft = import_file(path)
        except MechanismError as error:
            reasons = [f"{row.what} ({row.remedy})" if row.remedy else row.what for row in error.findings[:3]]
            raise ValueError(f"{name[:80]} {'; '.join(reasons)}") from None
    draft.source, draft.name = name, Path(name).stem if draft.name == "dropped" else draft.name
    return {"text": model_text(draft), "says": [f"{finding.where}: {finding.what}" for finding in draft.findings]}


def _warm(text: str) -> None:
    """Load what answers, and have the model solved before the page asks for it."""
    for ask in ("model", "cycle"):
        _answered(json.dumps({"ask": ask, "text": text}).encode())


def _answered(question: bytes) -> bytes:
    """The answer to a question; what it takes is loaded with the first."""
    from trunnion.studio.answers import answer

    return answer(question, ANSWERING)


def _reason(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error)
    return f"{text[:1].upper()}{text[1:]}."
