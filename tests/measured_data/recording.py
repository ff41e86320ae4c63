"""A recording of a rig that never was: torque and speed on both sides of a joint, an encoder, and what goes wrong."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trunnion.rig.reading.measurement import Condition, Measurement
from trunnion.rig.reading.read import read_measured

Array = NDArray[np.float64]
Columns = dict[str, Any]

RATE, RPM, PER_TURN, IDLE, ZERO = 5000.0, 600.0, 60, 0.2, 0.37
MAPPING: dict[str, Any] = {
    "trunnion-data": 1,
    "name": "rig",
    "time": {"column": "t", "unit": "s"},
    "angle": {"from": "pulses", "column": "encoder", "per_turn": PER_TURN},
    "positions": 90,
    "channels": {
        "torque-in": {
            "column": "T1",
            "measures": "effort:input",
            "unit": "V",
            "gain": "100 mV/(N m)",
            "zero": {"over": ["0 s", "0.19 s"]},
        },
        "speed-in": {"column": "n1", "measures": "rate:input", "unit": "rpm"},
        "brake": {"column": "T2", "measures": "load:brake", "unit": "N m"},
        "speed-out": {"column": "n2", "measures": "rate:output", "unit": "rpm"},
    },
}


def torque(angle: Array) -> Array:
    """What the torque into it is, N m."""
    return np.asarray(20 + 5 * np.sin(angle) + 2 * np.cos(2 * angle))


def recorded(turns: float = 20.0, noise: float = 0.05, seed: int = 1, rate: float = RATE, rpm: float = RPM) -> Columns:
    """Columns of a run that stands for `IDLE` seconds, then turns at once at its speed."""
    rng = np.random.default_rng(seed)
    count = int((IDLE + turns * 60 / rpm) * rate)
    t = np.arange(count) / rate
    angle = np.where(t < IDLE, 0.0, rpm * np.pi / 30 * (t - IDLE)) + ZERO
    runs = t >= IDLE
    return {
        "t": t,
        "T1": 0.1 * (np.where(runs, torque(angle), 0.0) + noise * rng.normal(size=count)) + 0.05,
        "T2": np.where(runs, 18 + 4 * np.sin(angle + 0.3), 0.0) + noise * rng.normal(size=count),
        "n1": np.where(runs, rpm, 0.0) + 0.05 * rng.normal(size=count),
        "n2": np.where(runs, rpm * (1 + 0.05 * np.cos(2 * angle)), 0.0) + 0.05 * rng.normal(size=count),
        "encoder": np.floor(angle / (2 * np.pi) * PER_TURN),
        "angle": angle,
    }


def mapping(changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The mapping with entries changed by their paths; None removes one."""
    found = copy.deepcopy(MAPPING)
    for path, value in (changes or {}).items():
        *parts, key = path.split("/")
        place = found
        for part in parts:
            place = place[part]
        if value is None:
            place.pop(key, None)
        else:
            place[key] = value
    return found


def text_of(columns: Columns | pd.DataFrame, separator: str = ",", decimal: str = ".") -> str:
    """Columns as pandas writes them as CSV; each number is made a text once for all tests that have the column."""
    arrays = {str(name): np.asarray(columns[name]) for name in columns}
    plain = all(one.dtype in (np.float64, np.int64) for one in arrays.values())
    if not plain or any(separator in name or '"' in name for name in arrays):
        return str(pd.DataFrame(columns).to_csv(index=False, sep=separator, decimal=decimal))
    texts = [_texts(one.tobytes(), one.dtype.char, decimal) for one in arrays.values()]
    return "\n".join([separator.join(arrays), *map(separator.join, zip(*texts, strict=True)), ""])


@lru_cache(maxsize=64)
def _texts(raw: bytes, kind: str, decimal: str) -> tuple[str, ...]:
    numbers = np.frombuffer(raw, kind).tolist()
    return tuple("" if one != one else repr(one).replace(".", decimal) for one in numbers)


def read(columns: Columns | pd.DataFrame, folder: Path, changes: Mapping[str, Any] | None = None) -> Measurement:
    """The measurement of columns that are written as a CSV file."""
    path = folder / "run.csv"
    path.write_text(text_of(columns), "utf-8")
    return read_measured(mapping(changes), [path])


def codes(measurement: Measurement) -> set[str]:
    """What the findings are about."""
    return {one.code for one in measurement.findings}


def off(condition: Condition, channel: str = "torque-in") -> float:
    """Largest difference of a mean course from the torque that was."""
    return float(np.nanmax(np.abs(condition.courses[channel].mean - torque(2 * np.pi * condition.phase))))
