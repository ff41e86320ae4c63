"""Questions to the studio as the page asks them, and what `analyse` has of the same models."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

import trunnion
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.studio.answers import answer

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = {path.stem: path.read_text("utf-8") for path in (ROOT / "examples").glob("*.yaml")}
FLOAT = 1e-6  # columns are float32


def model_of(text: str) -> Mechanism:
    """The mechanism of a text."""
    return Mechanism(**entries_of(text)[0])


def analysed(text: str, steps: int = 360, friction: bool = True) -> Any:
    """What `analyse` has of it."""
    mechanism = model_of(text)
    return trunnion.analyse(mechanism if friction else mechanism.with_friction("off"), steps)


def column(values: Any) -> Any:
    """Numbers of an answer; None is NaN."""
    return np.array(values, float)


def near(found: Any, expected: Any) -> None:
    """A column is that of an analysis, as far as float32 has digits for its peak."""
    expected = np.asarray(expected, float)
    np.testing.assert_allclose(column(found), expected, atol=3 * FLOAT * np.nanmax(np.abs(expected)), rtol=0)


def sound(kind: str, text: str, **question: Any) -> dict[str, Any]:
    """The answer alone to a question about a text that has one."""
    found = unpacked(answer(json.dumps({"ask": kind, "text": text, "revision": 1} | question).encode()))
    assert "error" not in found, found
    return found


def ask(**question: Any) -> dict[str, Any]:
    """The answer to a question; of one about a model that moves also the figures of its cycle, as the page asks."""
    found = unpacked(answer(json.dumps(question | {"revision": 1}).encode()))
    if question.get("ask") == "model" and found.get("solved"):
        return found | ask(**question | {"ask": "cycle"}) | {"ask": "model"}
    return found


def edited(text: str, places: dict[str, Any], *gestures: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Text and places after some gestures, one question each."""
    for gesture in gestures:
        found = ask(ask="edit", text=text, places=places, gestures=[gesture])
        assert "error" not in found, found
        text, places = found["text"], found["places"]
    return text, places


def solved(text: str) -> dict[str, Any]:
    """The answer about a model that has one."""
    found = ask(ask="model", text=text)
    assert found["solved"], (found["findings"], text)
    return found


def unpacked(answer: bytes) -> dict[str, Any]:
    """The header of an answer with its columns as lists (None where there is no number) and its files as bytes."""
    (length,) = struct.unpack_from("<I", answer)
    header, body = json.loads(answer[4 : 4 + length]), answer[4 + length :]

    def whole(value: Any) -> Any:
        if isinstance(value, list):
            return [whole(one) for one in value]
        if not isinstance(value, dict):
            return value
        if value.keys() == {"bytes"}:
            first, count = value["bytes"]
            return body[first : first + count]
        if value.keys() in ({"column"}, {"sum"}):
            ((kind, (first, count)),) = value.items()
            parts = 2 if kind == "sum" else 1
            columns = np.frombuffer(body, "<f4", parts * count, 4 * first).reshape(parts, count)
            numbers = columns.astype(float).sum(axis=0)
            return [float(one) if np.isfinite(one) else None for one in numbers]
        if "grid" in value:
            (first, count), names = value["grid"], value["names"]
            starts = iter(range(first, first + count * len(names or "1") * len(value["keys"]), count))
            column = lambda: whole({"column": [next(starts), count]})  # noqa: E731
            return {key: {name: column() for name in names} if names else column() for key in value["keys"]}
        return {key: whole(one) for key, one in value.items()}

    found: dict[str, Any] = whole(header)
    return found
