"""What a hand does to a drawing, as changes of the model's plain data: one function for each gesture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.studio.acting import bar_mass, centre, driver, gear, load, spring
from trunnion.studio.changing import add_row, delete, put_value, rename
from trunnion.studio.group import group
from trunnion.studio.sketch import Sketch
from trunnion.studio.strokes import add_point, join, link, lock, move, pinned, slide
from trunnion.studio.wiring import block

__all__ = ["GESTURES", "Gesture", "done"]

Given = Mapping[str, Any]
Gesture = Callable[[Sketch, Given], str]


def done(sketch: Sketch, given: Given) -> str:
    """Do a gesture; what it is called. MechanismError if it cannot be done."""
    gesture = GESTURES.get(str(given.get("do")))
    if gesture is None:
        raise MechanismError(Finding(f"'{given.get('do')}' is no gesture", "studio", f"use {', '.join(GESTURES)}"))
    try:
        said = gesture(sketch, given)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        if isinstance(error, MechanismError):
            raise
        what = f"the gesture '{given['do']}' does not fit the model ({error})"
        raise MechanismError(Finding(what, "studio", "undo, or correct the text of the model")) from error
    sketch.forget()
    return said


GESTURES: dict[str, Gesture] = {
    "link": link,
    "pin": pinned,
    "join": join,
    "slide": slide,
    "add-point": add_point,
    "driver": driver,
    "load": load,
    "spring": spring,
    "gear": gear,
    "block": block,
    "bar-mass": bar_mass,
    "centre": centre,
    "move": move,
    "group": group,
    "lock": lock,
    "set": put_value,
    "delete": delete,
    "rename": rename,
    "add-row": add_row,
}
