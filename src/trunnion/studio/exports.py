"""Files of a solved cycle for the page: table, report, pictures, a script that does the same."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from trunnion.errors import Finding, MechanismError
from trunnion.studio.loaded import Loaded

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["EXPORTS", "exported"]

GIF_IMAGES = 60
GIF_PACE = 50  # ms an image
GIF_SIZE, GIF_DOTS = 600, 100  # dots along the longer side, dots an inch


def exported(state: Loaded, what: str, steps: int) -> dict[str, Any]:
    """Name, type and bytes of a file; MechanismError where the model has no cycle."""
    if what not in EXPORTS:
        raise MechanismError(Finding(f"'{what}' is no file of the studio", remedy=f"use {', '.join(EXPORTS)}"))
    ending, mime, make = EXPORTS[what]
    stem = "".join(sign if sign.isalnum() else "-" for sign in str((state.entries or {}).get("name") or "mechanism"))
    content = make(state, steps)
    return {"name": f"{stem[:60].strip('-') or 'mechanism'}.{ending}", "mime": mime, "bytes": content}


def _result(state: Loaded, steps: int) -> xr.Dataset:
    return state.result(steps, True)


def _csv(state: Loaded, steps: int) -> bytes:
    from trunnion.results.export import frame

    text: str = frame(_result(state, steps), units="model").to_csv(index=False, lineterminator="\n")
    return text.encode()


def _report(state: Loaded, steps: int) -> bytes:
    from trunnion.views.cycle.report import report

    return report(_result(state, steps), state.result(steps, False)).encode()


def _picture(kind: str) -> Callable[[Loaded, int], bytes]:
    def make(state: Loaded, steps: int) -> bytes:
        from trunnion.views.cycle.plots import figure

        stream = io.BytesIO()
        figure(_result(state, steps), "mechanism").savefig(stream, format=kind)
        return stream.getvalue()

    return make


def _animation(state: Loaded, steps: int) -> bytes:
    """The mechanism going round once, of 60 pictures in 3 seconds."""
    from matplotlib.figure import Figure
    from PIL import Image

    from trunnion.views.common.drawing import picture, sketch
    from trunnion.views.space.bodies import is_spatial

    result = _result(state, steps)
    if is_spatial(result):
        raise MechanismError(Finding("is not drawn as GIF in space", remedy="write the report, whose drawing moves"))
    shown = picture(result)
    low_x, low_y, high_x, high_y = shown.box
    margin = 0.09 * shown.size
    width, height = high_x - low_x + 2 * margin, high_y - low_y + 2 * margin
    scale, images = GIF_SIZE / max(width, height), list[Image.Image]()
    dots = max(int(scale * width), 2), max(int(scale * height), 2)
    figure = Figure((dots[0] / GIF_DOTS, dots[1] / GIF_DOTS), dpi=GIF_DOTS)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(low_x - margin, high_x + margin), ylim=(low_y - margin, high_y + margin), aspect="equal")
    axes.axis("off")
    for index in range(0, steps, -(-steps // GIF_IMAGES)):
        for artist in (*axes.lines, *axes.patches, *axes.texts, *axes.collections):  # new axes would take longer
            artist.remove()
        sketch(axes, shown, index)
        drawn = io.BytesIO()
        figure.savefig(drawn, format="rgba", dpi=GIF_DOTS)
        images.append(Image.frombytes("RGBA", dots, drawn.getvalue()).quantize(64, Image.Quantize.FASTOCTREE))
    stream = io.BytesIO()
    images[0].save(stream, "GIF", save_all=True, append_images=images[1:], duration=GIF_PACE, loop=0)
    return stream.getvalue()


def _script(state: Loaded, steps: int) -> bytes:
    """The model and what was asked of it, as Python."""
    lines = [
        '"""The session of the studio as a script: the model, its cycle, a table and a report."""',
        "",
        "from pathlib import Path",
        "",
        "import trunnion",
        "",
        f"MODEL = {state.text!r}",
        "",
        'path = Path("model.yaml")',
        'path.write_text(MODEL, encoding="utf-8")',
        "mechanism = trunnion.read(path)",
        f"result = trunnion.analyse(mechanism, steps={steps})",
        "print(result.trunnion)",
        'trunnion.save(result, "result.csv", units="model")',
        "",
    ]
    return "\n".join(lines).encode()


EXPORTS: dict[str, tuple[str, str, Callable[[Loaded, int], bytes]]] = {
    "csv": ("csv", "text/csv", _csv),
    "report": ("html", "text/html", _report),
    "png": ("png", "image/png", _picture("png")),
    "svg": ("svg", "image/svg+xml", _picture("svg")),
    "gif": ("gif", "image/gif", _animation),
    "script": ("py", "text/x-python", _script),
}
