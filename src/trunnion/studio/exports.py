"""Files of a solved cycle for the page: table, report, pictures."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.studio.loaded import Loaded

__all__ = ["EXPORTS", "exported"]


def exported(state: Loaded, what: str, steps: int, index: int = 0) -> dict[str, Any]:
    """Name, type and bytes of a file; MechanismError where the model has no cycle. index: the position of a picture."""
    if what not in EXPORTS:
        raise MechanismError(Finding(f"'{what}' is no file of the studio", remedy=f"use {', '.join(EXPORTS)}"))
    ending, mime, make = EXPORTS[what]
    stem = "".join(sign if sign.isalnum() else "-" for sign in str((state.entries or {}).get("name") or "mechanism"))
    content = make(state, steps, index)
    return {"name": f"{stem[:60].strip('-') or 'mechanism'}.{ending}", "mime": mime, "bytes": content}


def _csv(state: Loaded, steps: int, _: int) -> bytes:
    from trunnion.results.export import frame

    text: str = frame(state.result(steps, True), units="model").to_csv(index=False, lineterminator="\n")
    return text.encode()


def _report(state: Loaded, steps: int, _: int) -> bytes:
    from trunnion.views.cycle.report import report

    return report(state.result(steps, True), state.result(steps, False)).encode()


def _picture(state: Loaded, steps: int, index: int, kind: str) -> bytes:
    from trunnion.views.cycle.plots import mechanism

    stream = io.BytesIO()
    mechanism(state.result(steps, True), index=index).savefig(stream, format=kind)
    return stream.getvalue()


EXPORTS: dict[str, tuple[str, str, Callable[[Loaded, int, int], bytes]]] = {
    "csv": ("csv", "text/csv", _csv),
    "report": ("html", "text/html", _report),
    "png": ("png", "image/png", partial(_picture, kind="png")),
    "svg": ("svg", "image/svg+xml", partial(_picture, kind="svg")),
}
