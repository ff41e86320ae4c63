"""Ways to damage a file: of its bytes, of its lines, of the numbers and texts in it, of the entries it states."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from random import Random
from typing import Any

__all__ = ["EXTREMES", "damaged_bytes", "damaged_entries", "damaged_lines", "damaged_texts"]

Entries = dict[str, Any]

# Values that stand where a file has another: extremes of every type, and texts that mean something somewhere.
EXTREMES: tuple[Any, ...] = (
    0, -1, 1, 2, 1e-320, 1e308, -1e308, 10**40, float("nan"), float("inf"), -float("inf"), True, False, None,
    "", " ", "0", "nan", "inf mm", "1e400 m", "1e308 m * 1e308", "0 mm", "-1 mm", "1e-300 mm", "1e300 rad/s", "-3 kg",
    "5 deg", "10 rpm", "1 kN", "60 mm ± 0.05 mm", "1 mm ± 5 mm", "+0.02/-0.01", "1/0", "0/0 m", "sqrt(-1) * 1 m",
    "((((((1))))))", "1 +", "9**9**9**9", "2 ** 1e9", "10**1000 m", "__import__('os')", "lambda: 0", "a.b", "x" * 5000,
    "(" * 3000, "-" * 3000 + "1", "1" * 5000, "+".join(["1"] * 2000), "Grad", "6 Grad", "ä°µ½²", "\u202e\u0000mm",
    "\U0001f600", "=1+1", "@x", "null", "true", "ground", "A", "B", "C", "crank", "way-1", "way-99999999", "drive",
    "t", "drive * 1 mm", "between(drive, 1 deg, 2 deg)", "H7/f7", "16 H7/f7", "9999 ZZ9/a1", "1 m:2 m:3", "0:1:1e9",
    "0 deg:30 deg:100000000", "100 mV/(N m)", "effort:A", "rotation:A", "../../etc/passwd", "/dev/zero", "/dev/null",
    [], {}, [[]], [None], [0], [0, 0], [0, 0, 0], [1e308, 1e308], ["nan", 1], [[0, 0], [0, 1]], [[0, 0], [0, 0]],
    [1, 2, 3, 4, 5, 6, 7], ["A", "A"], {"": 0}, {"x": {}}, {"law": "coulomb"}, {"value": 1}, {"a": {"b": {"c": [{}]}}},
    {"distance": 0, "angle": 0}, {"coefficient": "nan"}, {"speed": 0}, {"from": "pulses"},
)  # fmt: skip
NUMBER = re.compile(r"[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(r"[A-Za-z_][\w-]*")
SIGNS = "\t :;,[]{}()'\"#&*!|>%@`-+=\\/\r\n.?\0\x1b\ufeff\u2028µ½\U0001f600"


# ---- bytes ----------------------------------------------------------------------------------------------------


def damaged_bytes(raw: bytes, rng: Random) -> bytes:
    """Bytes flipped, put in, cut out, doubled, moved, or the whole in another encoding."""
    for _ in range(rng.choice((1, 1, 1, 2, 5, 20))):
        raw = rng.choice(BYTE_WAYS)(raw, rng)
    return raw


def _span(raw: bytes, rng: Random) -> tuple[int, int]:
    begin = rng.randrange(len(raw) + 1)
    return begin, min(len(raw), begin + rng.choice((1, 1, 2, 5, 30, 300, 5000)))


def _flipped(raw: bytes, rng: Random) -> bytes:
    if not raw:
        return b"\xff"
    place = rng.randrange(len(raw))
    return raw[:place] + bytes([raw[place] ^ (1 << rng.randrange(8))]) + raw[place + 1 :]


def _noise(raw: bytes, rng: Random) -> bytes:
    place = rng.randrange(len(raw) + 1)
    return raw[:place] + rng.randbytes(rng.choice((1, 2, 8, 100))) + raw[place:]


def _cut_out(raw: bytes, rng: Random) -> bytes:
    begin, end = _span(raw, rng)
    return raw[:begin] + raw[end:]


def _doubled(raw: bytes, rng: Random) -> bytes:
    begin, end = _span(raw, rng)
    return raw[:end] + raw[begin:end] * rng.choice((1, 1, 3, 20)) + raw[end:]


def _moved(raw: bytes, rng: Random) -> bytes:
    begin, end = _span(raw, rng)
    rest, place = raw[:begin] + raw[end:], rng.randrange(len(raw) + 1)
    return rest[:place] + raw[begin:end] + rest[place:]


def _cut_off(raw: bytes, rng: Random) -> bytes:
    return raw[: rng.randrange(len(raw) + 1)]


def _zeroed(raw: bytes, rng: Random) -> bytes:
    begin, end = _span(raw, rng)
    return raw[:begin] + bytes(end - begin) + raw[end:]


def _encoded(raw: bytes, rng: Random) -> bytes:
    text = raw.decode("utf-8", "replace")
    return text.encode(
        rng.choice(("utf-16", "utf-16-le", "utf-32", "cp1252", "cp437", "utf-7", "utf-8-sig")), "replace"
    )


BYTE_WAYS: tuple[Callable[[bytes, Random], bytes], ...] = (
    _flipped, _flipped, _noise, _cut_out, _doubled, _moved, _cut_off, _zeroed, _encoded,
)  # fmt: skip


# ---- lines and texts ------------------------------------------------------------------------------------------


def damaged_lines(text: str, rng: Random) -> str:
    """Lines left out, doubled, swapped, indented otherwise or brought together."""
    lines = text.split("\n")
    for _ in range(rng.choice((1, 1, 2, 5))):
        k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        match rng.randrange(6):
            case 0:
                del lines[k : k + rng.choice((1, 1, 3, 30))]
            case 1:
                lines[other:other] = lines[k : k + rng.choice((1, 3, 10))]
            case 2:
                lines[k], lines[other] = lines[other], lines[k]
            case 3:
                lines[k] = " " * rng.randrange(6) + lines[k].lstrip(" ")
            case 4:
                lines[k] = (
                    rng.choice(("\t", "- ", "? ", "- - - ", "---", "...", "&a ", "*a ", "<<: ", "!!python ")) + lines[k]
                )
            case _:
                lines[k : k + 2] = ["".join(lines[k : k + 2])]
        lines = lines or [""]
    return "\n".join(lines)


def damaged_texts(text: str, rng: Random) -> str:
    """A number, a word or a sign in the text replaced by another."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        pattern = rng.choice((NUMBER, NUMBER, WORD))
        found = list(pattern.finditer(text))
        if found and rng.random() < 0.8:
            one = rng.choice(found)
            new = rng.choice(found)[0] if rng.random() < 0.3 else as_text(rng.choice(EXTREMES))
            text = text[: one.start()] + new + text[one.end() :]
        else:
            place = rng.randrange(len(text) + 1)
            text = text[:place] + rng.choice(SIGNS) * rng.choice((1, 1, 2, 60)) + text[place + rng.randrange(2) :]
    return text


def as_text(value: Any) -> str:
    """A value as a file of text would have it."""
    return value if isinstance(value, str) else json.dumps(value)


# ---- entries --------------------------------------------------------------------------------------------------


def damaged_entries(data: Entries, rng: Random) -> Entries:
    """Entries removed, renamed, doubled, of another type or value, exchanged or put elsewhere."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 1, 2, 3, 8))):
        place, key = rng.choice(_places(data) or [(data, "")])
        rng.choice(ENTRY_WAYS)(data, place, key, rng)
    return data


def _places(data: Any) -> list[tuple[Any, Any]]:
    """Every group or list with each of its keys."""
    found: list[tuple[Any, Any]] = []
    held = [data]
    while held:
        one = held.pop()
        for key in list(one) if isinstance(one, dict) else range(len(one)):
            found.append((one, key))
            if isinstance(one[key], (dict, list)):
                held.append(one[key])
    return found


def _replaced(data: Entries, place: Any, key: Any, rng: Random) -> None:
    place[key] = copy.deepcopy(rng.choice(EXTREMES))


def _removed(data: Entries, place: Any, key: Any, rng: Random) -> None:
    if key in place or isinstance(place, list):
        del place[key]


def _renamed(data: Entries, place: Any, key: Any, rng: Random) -> None:
    names = [one for other, one in _places(data) if isinstance(one, str)]
    new = rng.choice((*names, "", "x", "=A1", "ä", "a.b", "\0", "x" * 2000, key))
    if isinstance(place, dict) and key in place:
        place[str(new)] = place.pop(key)
    elif place:
        place[key] = new


def _wrapped(data: Entries, place: Any, key: Any, rng: Random) -> None:
    value = place[key] if isinstance(place, list) else place.get(key)
    for _ in range(rng.choice((1, 1, 2, 40, 200))):
        value = rng.choice(([value], {"x": value}))
    place[key] = value


def _exchanged(data: Entries, place: Any, key: Any, rng: Random) -> None:
    other, own = rng.choice(_places(data) or [(data, "")])
    if own in other or isinstance(other, list):
        place[key] = copy.deepcopy(other[own])


def _scaled(data: Entries, place: Any, key: Any, rng: Random) -> None:
    value = place[key] if isinstance(place, list) else place.get(key)
    factor = rng.choice((0, -1, 1e-9, 1e9, 1e-150, 1e150, 1e-300, 1e300, 0.999, 2, 10))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        place[key] = value * factor
    elif isinstance(value, str):
        place[key] = NUMBER.sub(lambda one: f"{float(one[0].replace(',', '.')) * factor:.6g}", value)


def _repeated(data: Entries, place: Any, key: Any, rng: Random) -> None:
    value = place[key] if isinstance(place, list) else place.get(key)
    for k in range(rng.choice((1, 2, 50))):
        if isinstance(place, list):
            place.append(copy.deepcopy(value))
        else:
            place[f"{key}{k}"] = copy.deepcopy(value)


ENTRY_WAYS: tuple[Callable[[Entries, Any, Any, Random], None], ...] = (
    _replaced, _replaced, _removed, _renamed, _wrapped, _exchanged, _scaled, _scaled, _scaled, _scaled, _repeated,
)  # fmt: skip
