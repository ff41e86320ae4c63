"""What is to be held out, as it is asked for: a share of the turns, conditions by name, file or setting."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.measurement import Condition, Measurement

__all__ = ["HoldOut", "held_out"]

HoldOut = float | str | Sequence[str] | None
MOST_NAMED = 6
SAME = 1e-6  # of a setting


def held_out(mechanism: Mechanism, measurement: Measurement, wanted: HoldOut) -> tuple[frozenset[str], float]:
    """Names of the conditions to hold out, and the share of the turns of the others.

    A condition is named by its name, the name of its file without extension, a setting such as `misalignment=15 deg`,
    or its value as it stands in the names, which may be that of several, or a part of its name that no other has.
    MechanismError for what names none.
    """
    if wanted is None:
        return frozenset(), 0.0
    if isinstance(wanted, (int, float)):
        if not 0 < wanted < 1:
            what = f"a share of {wanted:g} of the turns cannot be held out"
            raise MechanismError(Finding(what, "hold_out", "give a share between 0 and 1, or names of conditions"))
        return frozenset(), float(wanted)
    found: set[str] = set()
    for text in [wanted] if isinstance(wanted, str) else wanted:
        named = [one.name for one in measurement.conditions if _is_named(one, text)]
        named = named or _set(mechanism, measurement, text)
        named = named or [one.name for one in measurement.conditions if _has(one.name, text.strip())]
        part = [one.name for one in measurement.conditions if text.strip() and text in one.name]
        if not named and len(part) > 1:
            some = "; ".join(part[:MOST_NAMED]) + ("; …" if len(part) > MOST_NAMED else "")
            what = f"'{text}' is in the names of {len(part)} conditions"
            raise MechanismError(Finding(what, "hold_out", f"name one of {some}; or a setting as NAME=VALUE"))
        named = named or part
        if not named:
            names = [one.name for one in measurement.conditions]
            some = "; ".join(names[:MOST_NAMED]) + ("; …" if len(names) > MOST_NAMED else "")
            remedy = f"name one of {some}; or a file, or a setting as NAME=VALUE"
            raise MechanismError(Finding(f"there is no condition '{text}'", "hold_out", remedy))
        found |= set(named)
    return frozenset(found), 0.0


def _is_named(condition: Condition, text: str) -> bool:
    return condition.name == text or text in {PurePath(one).stem for one in condition.files}


def _has(name: str, text: str) -> bool:
    """Whether a name, such as `misalignment 25 deg, input.speed 100 rpm`, has a setting of this value."""
    return bool(text) and any(one == text or one.endswith(f" {text}") for one in name.split(", "))


def _set(mechanism: Mechanism, measurement: Measurement, text: str) -> list[str]:
    """Conditions with a setting."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals:
        return []
    path = mechanism.path_of(name)
    wanted = float(np.ravel(mechanism.with_values({path: _plain(value)}).parameters()[path])[0])
    found = []
    for one in measurement.conditions:
        own = {mechanism.path_of(key): number for key, number in one.values.items()}
        if path in own and abs(own[path] - wanted) <= SAME * max(abs(wanted), abs(own[path])):
            found.append(one.name)
    return found


def _plain(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
