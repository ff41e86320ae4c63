"""A model spoken of as on the sheet: "mass of link crank" for `links.crank.mass`, and remedies likewise."""

from __future__ import annotations

import re

from trunnion.results.variables import VARIABLES

__all__ = ["remedied", "spoken"]

NOUNS = {
    "links": "link", "joints": "joint", "loads": "load", "springs": "spring", "drivers": "driver", "gears": "gear pair",
    "dimensions": "dimension", "loop": "joint", "measures": "measure", "tables": "table",
}  # fmt: skip
NESTED = re.compile(r"\b([a-z_]+): \{([a-z_]+): ([^{},]*)\}")
STATED = re.compile(r"\b([a-z_]+): (?=-?\d|…)")
PATH = re.compile(r"[^\s.,]+(\.[^\s.,]+)+")


def spoken(where: str) -> str:
    """A path of the file in words; what is no path stays as it is."""
    if not PATH.fullmatch(where):
        return where
    section, *rest = where.split(".")
    if section == "joint_defaults":
        return f"{_plain(rest)} of all joints"
    if section == "assembly":
        return f"start of {'.'.join(rest)}"
    if section not in NOUNS:
        return _plain([section, *rest])
    name, *inner = rest
    part = f"{NOUNS[section]} {name}" if section != "dimensions" or inner else name
    if section == "links" and inner[:1] == ["points"]:
        _, *inner = inner
        if not inner:
            return f"points of {part}"
        point, *deeper = inner
        letters = dict(zip("012", "xyz", strict=True))  # "x of point P" where it is typed alone
        inner = [letters.get(key, key) for key in deeper if key not in ("x", "y", "z", "at")]
        part = f"point {point} of {part}"
    return f"{_plain(inner)} of {part}" if inner else part


def remedied(remedy: str) -> str:
    """A remedy without the signs of the file: "state pin radius" where it says `state pin: {radius: …}`."""
    if " --" in remedy and "trunnion " not in remedy:  # options: the page has none; whole commands stay
        remedy = re.sub(r"[,;][^,;]* --.*", "", remedy)
    if (" --" in remedy and "trunnion " not in remedy) or any("_" in name and name in remedy for name in VARIABLES):
        return ""  # it names columns of the result, or is about an option alone
    plain = STATED.sub(r"\1 ", NESTED.sub(r"\1 \2 \3", remedy))
    return plain.replace(": {…}", "").replace(" …", "")


def _plain(keys: list[str]) -> str:
    return " ".join(keys).replace("_", " ")
