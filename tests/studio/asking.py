"""Questions to the studio as the page asks them."""

from __future__ import annotations

import json
from typing import Any

from trunnion.studio.answers import answer
from trunnion.studio.message import unpacked


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
