"""Mechanisms of very many links: what is asked of them takes time and memory in proportion."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import pytest

import trunnion
from trunnion import Mechanism
from trunnion.studies.design import report_figures

JANSEN = Path(__file__).parents[2] / "examples" / "jansen.yaml"
LEGS, MOST = 12, 125e6  # bytes


def legs(count: int) -> Mechanism:
    """Jansen's leg some times on one crank: the same joints again with a number behind their names."""
    data: dict[str, Any] = trunnion.read(JANSEN).model_dump(by_alias=True, exclude_unset=True)

    def numbered(name: str, k: int) -> str:
        return name if name in ("O", "foot", "ground", "crank") else f"{name}n{k}"

    links: dict[str, Any] = {name: {**data["links"][name], "points": {}} for name in ("ground", "crank")}
    joints, loads, hints = {}, {}, {}
    for k in range(count):
        for name, link in data["links"].items():
            points = {numbered(point, k): place for point, place in link["points"].items()}
            own = links.setdefault(numbered(name, k), {**link, "points": {}})
            own["points"] = own["points"] | points
        for name, joint in data["joints"].items():
            joints[numbered(name, k)] = {**joint, "links": [numbered(link, k) for link in joint["links"]]}
        loads[f"weight{k}"] = {**data["loads"]["weight"], "link": numbered("shank", k)}
        hints |= {numbered(point, k): place for point, place in data["assembly"].items()}
    return Mechanism(**data | {"links": links, "joints": joints, "loads": loads, "assembly": hints})


@pytest.mark.slow
def test_many_legs_ask_for_as_many_times_the_effort_in_bounded_memory() -> None:
    one = {row.name: row.value for row in report_figures(legs(1))}
    mechanism = legs(LEGS)
    assert len(mechanism.links) == 6 * LEGS + 2
    tracemalloc.start()
    many = {row.name: row.value for row in report_figures(mechanism)}
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < MOST
    for name in ("energy_swing", "shaking_force", "mean_power"):
        assert many[name] == pytest.approx(LEGS * one[name], rel=0.05)  # but for the one crank
