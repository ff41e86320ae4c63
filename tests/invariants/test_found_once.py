"""What is found once and kept, or looked for at many places at once, is what it would be without."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from trunnion.errors import Severity
from trunnion.model.checks.values import check_values
from trunnion.model.parameters import ParameterSet
from trunnion.solve import assembly
from trunnion.solve.run import prepare
from trunnion.solve.track import Track

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


def test_a_mechanism_is_prepared_once_and_a_copy_of_it_by_itself() -> None:
    mechanism = example("toleranced-fourbar")
    run = prepare(mechanism)
    assert prepare(mechanism) is run
    for other in (copy.copy(mechanism), copy.deepcopy(mechanism), mechanism.with_values({"gravity.y": 0.0})):
        assert prepare(other) is not run
        assert prepare(other).system.mechanism is other
    assert copy.deepcopy(mechanism) == mechanism
    assert not copy.deepcopy(mechanism).worked_out


@pytest.mark.parametrize("name", ["durango-fourbar", "fourbar-with-play", "rssr"])
def test_an_analysis_again_is_that_of_a_mechanism_read_anew(name: str) -> None:
    mechanism = example(name)
    trunnion.analyse(mechanism, 12)
    again, anew = trunnion.analyse(mechanism, 36), trunnion.analyse(example(name), 36)
    assert again.identical(anew)


WRONG: list[dict[str, Any]] = [
    {"links.crank.mass": -1.0},
    {"joints.B.pin.radius": 0.0},
    {"joints.B.friction.coefficient": -0.1, "links.coupler.mass": -2.0},
    {"drivers.A.speed": 0.0},
    {"links.coupler.inertia": -1.0},
    {"links.coupler.points.C.x": 0.0, "links.coupler.points.C.y": 0.0},
    {"AB": float("inf"), "joint_defaults.friction.coefficient": 7.0},
]
SOUND: list[dict[str, Any]] = [{"AB": 1.9}, {"AB": float("nan")}]


@pytest.mark.parametrize("change", [*WRONG, *SOUND], ids=lambda change: " ".join(change))
def test_errors_of_changed_numbers_are_found_among_these_alone(change: dict[str, Any]) -> None:
    mechanism = example("durango-fourbar")
    numbers: ParameterSet = copy.copy(mechanism.parameter_set)
    before = dict(numbers.nominal)
    numbers.nominal = mechanism.parameters(change)
    changed = [path for path, value in numbers.nominal.items() if value is not before[path]]
    with np.errstate(all="ignore"):
        whole, own = (
            [one for one in check_values(mechanism, numbers, only) if one.severity is Severity.ERROR]
            for only in (None, changed)
        )
    assert {str(one) for one in own} == {str(one) for one in whole}
    assert bool(own) == any(change is one for one in WRONG)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rssr", "double-butterfly", "open"])
def test_wide_steps_along_a_branch_come_to_what_narrow_ones_do(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # with a longer crank the linkage comes apart on the way
    change = {"a": "80 mm"} if name == "open" else {}
    mechanisms = [example("rssr" if name == "open" else name).with_values(change) for _ in range(2)]
    wide = prepare(mechanisms[0]).chosen.assembly
    monkeypatch.setattr(assembly, "STRIDE", 1)
    narrow = prepare(mechanisms[1]).chosen.assembly
    tracks = [pair for pair in zip(wide, narrow, strict=True) if isinstance(pair[0], Track)]
    assert tracks
    for one, other in tracks:
        assert np.any(np.isfinite(one.coordinates))
        assert np.all(np.isfinite(one.coordinates)) == (name != "open")
        assert one.coordinates == pytest.approx(other.coordinates, abs=1e-12, nan_ok=True)
        assert one.orientation == other.orientation
        assert np.array_equal(one.again, other.again)
