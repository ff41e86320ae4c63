"""Texts of findings as HTML: what stands in backticks becomes code."""

from __future__ import annotations

import re
from html import escape

__all__ = ["with_code"]

CODE = re.compile(r"`([^`]+)`")


def with_code(text: str) -> str:
    """The text escaped for HTML, with `…` as code: "see `trunnion play`" has no backtick left."""
    return CODE.sub(r"<code>\1</code>", escape(str(text)))
