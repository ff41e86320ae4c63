"""Names in any script: what no font at hand can draw is written as its code, so that a figure never shows boxes."""

from __future__ import annotations

import io
from functools import cache
from typing import TYPE_CHECKING
from unicodedata import category

from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, fontManager, get_font
from matplotlib.text import Text

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

__all__ = ["Sheet", "plain"]

HOME = "DejaVu Sans"  # comes with matplotlib
# Common fonts for the scripts it lacks; those that are installed are asked in this order.
OTHERS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans SC", "Noto Sans JP", "Noto Sans KR", "Source Han Sans SC",
    "Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "PingFang SC", "Hiragino Sans", "Apple SD Gothic Neo",
    "WenQuanYi Zen Hei", "WenQuanYi Micro Hei", "Droid Sans Fallback", "Noto Sans Devanagari", "Noto Sans Thai",
    "Arial Unicode MS",
)  # fmt: skip


class Sheet(Figure):
    """A figure whose texts find their signs in whichever of the installed fonts has them."""

    _lettered = False  # since the last drawing

    def draw(self, renderer: RendererBase) -> None:
        """Give every text the fonts, then draw.

        Matplotlib draws a figure that has a layout twice, the first time with the renderer's methods replaced by
        empty ones. That pass only has to arrange the figure; all its paths would be prepared for nothing.
        """
        if not self._lettered:
            for text in self.findobj(Text):
                text.set_fontfamily(list(families()))
        engine = self.get_layout_engine()
        self._lettered = engine is not None and "draw_path" in vars(renderer)
        if self._lettered and engine is not None:
            engine.execute(self)
            for axes in self.axes:
                axes.apply_aspect()
        else:
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """What a notebook shows; matplotlib tells it only of figures that pyplot has made."""
        found = io.BytesIO()
        self.savefig(found, format="png", dpi=100)
        return found.getvalue()


@cache
def families() -> tuple[str, ...]:
    """The fonts to look in, in order."""
    installed = {font.name for font in fontManager.ttflist}
    return (HOME, *(name for name in OTHERS if name in installed))


@cache
def _signs() -> frozenset[int]:
    """All signs that can be drawn both upright and bold."""
    return frozenset().union(*(_charmap(name, "normal") & _charmap(name, "bold") for name in families()))


def _charmap(family: str, weight: str) -> set[int]:
    return set(get_font(findfont(FontProperties(family=family, weight=weight))).get_charmap())


def plain(name: str) -> str:
    r"""A name that matplotlib shows as it is: `$` starts no formula, a leading `_` hides no legend entry.

    A sign that no font has, or that is invisible, is told by its code: \u66f2, as YAML and JSON write it too.
    """
    text = "".join(sign if _drawable(sign) else _code(sign) for sign in name).replace("$", r"\$")
    return f"\u2009{text}" if text.startswith("_") else text


def _drawable(sign: str) -> bool:
    return ord(sign) in _signs() and category(sign)[0] != "C"


def _code(sign: str) -> str:
    return f"\\u{ord(sign):04x}" if ord(sign) < 0x10000 else f"\\U{ord(sign):08x}"
