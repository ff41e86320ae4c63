"""The moving mechanism alone, as a page or in a notebook: the drawing and the player of the report."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.files import whole
from trunnion.views.common.bundle import bundle, web_text
from trunnion.views.cycle.report import embedded
from trunnion.views.cycle.scene import scene
from trunnion.views.page import hashed

if TYPE_CHECKING:
    import xarray as xr
    from jinja2 import Template

__all__ = ["Animation", "animation"]

HEIGHT = 760  # of the frame in a notebook, px: drawing, player, figures of the position


@dataclass(frozen=True)
class Animation:
    """A moving drawing that a notebook shows in its place.

    page: all of it as one HTML file that needs no network; height: of its frame in a notebook, px.
    """

    page: str
    height: int = HEIGHT

    def _repr_html_(self) -> str:
        """The page in a frame of its own, which has no access to the notebook around it."""
        frame = 'sandbox="allow-scripts" title="Moving mechanism" width="100%" style="border:0"'
        return f'<iframe {frame} height="{self.height}" srcdoc="{escape(self.page)}"></iframe>'

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page, whole or not at all; MechanismError where it cannot be written."""
        target = Path(path)
        with whole(target) as temporary:
            temporary.write_text(self.page, encoding="utf-8")
        return target


def animation(result: xr.Dataset, ideal: xr.Dataset | None = None, height: int = HEIGHT) -> Animation:
    """The mechanism of a cycle moving through its positions, with reactions, player and figures of the position.

    ideal: the same run without friction, whose reactions are drawn beside; height: of the frame, px. Raises ValueError
    if `ideal` has other positions.
    """
    from markupsafe import Markup

    shown = scene(result, ideal)
    style, script = web_text("report.css"), bundle("report.js")
    context = {
        "name": shown["name"] or "Mechanism", "version": result.attrs.get("trunnion_version", ""),
        "style": Markup(style), "style_hash": hashed(style), "script": Markup(script), "script_hash": hashed(script),
        "scene": Markup(embedded(shown)),
    }  # fmt: skip
    return Animation(_template().render(context), height)


@cache
def _template() -> Template:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    return environment.from_string(web_text("animation.html.j2"))
