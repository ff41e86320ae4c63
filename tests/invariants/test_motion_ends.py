"""Where a motion in time ends before its time: at the end of a range, at a change point, or where it takes too long."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from timed import (
    ANTIPARALLELOGRAM,
    DELTOID,
    INERTIA,
    LINEAR,
    PARALLELOGRAM,
    beside,
    driven_four_bar,
    slider_crank,
    swinging,
    two_wheels,
    wheel,
)  # fmt: skip
from trunnion import Mechanism, MechanismError, Status, analyse, simulate
from trunnion.dynamics import compiled_rates
from trunnion.results.attributes import attribute


def ended(result: Any, code: str) -> dict[str, Any]:
    """The figures of the one finding that tells the end, which is the last row."""
    (figures,) = [one.figures for one in result.trunnion.findings if one.code == f"simulate.{code}"]
    assert result["time"].values[-1] == pytest.approx(figures["time"], rel=1e-12)
    assert figures["time"] < result.attrs["duration"]
    assert np.all(np.isfinite(result["drive_coordinate"].values))
    assert not np.any(result["status"].values == Status.NOT_CONVERGED)
    return dict(figures)


def figures(mechanism: Mechanism, steps: int) -> dict[str, tuple[Any, str]]:
    result = simulate(mechanism, 1.0, steps)
    return {one.name: (one.value, one.place) for one in result.trunnion.summary}


@pytest.mark.slow
@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_figures_are_of_the_motion_and_not_of_its_rows(space: str) -> None:
    """Extremes between the rows, and what there is at the end of a motion that ends between them."""
    flat = space == "planar"
    mechanism = driven_four_bar(space, *PARALLELOGRAM, range=[0.5, 3.0]) if flat else swinging(space, stiffness=40.0)
    few, many = figures(mechanism, 3), figures(mechanism, 400)
    assert few.keys() == many.keys()
    assert any(name.endswith("reaction_max") for name in few)
    for name, (value, place) in few.items():
        assert value == pytest.approx(many[name][0], rel=1e-9), name
        assert place == many[name][1], name


def test_the_figures_at_the_end_are_of_the_end() -> None:
    """A wheel under a constant torque: ω = √(2 T θ / J) at the end of its range."""
    data = wheel(LINEAR, drag=0.0).data()
    data["drivers"] = {"A": {"speed": 1, "range": [0, 2], "motor": {"kind": "constant", "effort": 4}}}
    found = figures(Mechanism(**data), 1)
    assert found["A.speed_end"][0] == pytest.approx(np.sqrt(2 * 4 * 2 / 0.05), rel=1e-8)
    assert found["work_drive"][0] == pytest.approx(8.0, rel=1e-8)


# ---- ranges -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("space", "first", "compiled"), [("planar", True, True), ("planar", False, False), ("spatial", False, True)]
)
def test_a_range_ends_the_motion_of_several_drivers(
    space: str, first: bool, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """θ = θ₀ + T t²/(2 J), of the one that gets there first, driven either way."""
    if not compiled:
        monkeypatch.setattr(compiled_rates, "compilable", lambda motion: False)
    flat = space == "planar"
    kind = PARALLELOGRAM[0], [0.875, -0.273]  # at the start of the range
    data = beside(driven_four_bar(space, *kind, range=[-2.0, 1.7 if first else 2.9])).data()
    data["drivers"]["W"] |= {"range": [-1.0, 2.0], "speed": 1, "initial": {"coordinate": 0.0, "speed": -3}}
    result = simulate(Mechanism(**data), 1.0, 40)
    figures = ended(result, "range")
    assert figures["driver"] == ("A" if first else "W")
    assert figures["coordinate"] == pytest.approx(1.7 if first else -1.0, abs=1e-12)
    time = np.sqrt(2 * 0.7 * INERTIA / 2.0)
    assert figures["time"] == pytest.approx(time if first else 1 / 3, rel=1e-8), flat


def test_a_range_that_is_left_and_entered_within_a_step_ends_the_motion() -> None:
    """The swing of a spring goes beyond the range by a millionth of itself."""
    data = two_wheels({"kind": "constant", "effort": 0.0}).data()
    for joint in data["joints"].values():
        del joint["losses"]
    data["springs"] = {"hold": {"joint": "W", "stiffness": 0.05, "free_angle": 0}}
    data["drivers"]["W"] |= {"range": [-2.0, 1.0 - 1e-6], "initial": {"coordinate": 0.0, "speed": 1.0}}
    figures = ended(simulate(Mechanism(**data), 3.0, 30), "range")
    assert figures["time"] == pytest.approx(np.arcsin(1.0 - 1e-6), abs=1e-6)


def test_a_range_beside_a_prescribed_driver_ends_the_motion() -> None:
    data = two_wheels(LINEAR).data()
    data["joints"]["A"]["losses"] = data["joints"]["W"]["losses"] = {"viscous": 1e-9}
    data["drivers"] = {
        "A": {"speed": 1, "motor": {"kind": "constant", "effort": 4}, "range": [0, 2]}, "W": {"speed": 3}
    }  # fmt: skip
    figures = ended(simulate(Mechanism(**data), 1.0, 20, 1e-11), "range")
    assert figures["time"] == pytest.approx(np.sqrt(2 * 2 * 0.05 / 4), rel=1e-6)


def test_several_drivers_begin_within_their_ranges() -> None:
    data = beside(driven_four_bar("planar", *PARALLELOGRAM)).data()
    data["drivers"]["W"] |= {"range": [1, 2], "initial": {"coordinate": 3}}
    with pytest.raises(MechanismError, match=r"drivers\.W\.initial: begins at 3 \(SI\), outside its range from 1 to 2"):
        simulate(Mechanism(**data), 1.0)


# ---- change points ----------------------------------------------------------------------------------------------


def folding(mechanism: Mechanism) -> Mechanism:
    """The same, to fold over at its change points."""
    data = mechanism.data()
    data["assembly"]["rocker"] = "folds"
    return Mechanism(**data)


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("space", ["planar", pytest.param("spatial", marks=pytest.mark.slow)])
def test_a_motion_ends_at_a_change_point(space: str, several: bool) -> None:
    """Where links that fold over would jump: θ = 1 + T t²/(2 J) up to all links in line."""
    mechanism = folding(driven_four_bar(space, *PARALLELOGRAM))
    assert "assembly.change_point" in {one.code for one in analyse(mechanism, 12).trunnion.findings}
    result = simulate(beside(mechanism) if several else mechanism, 1.0, 40)
    figures = ended(result, "change_point")
    assert figures["coordinate"] == pytest.approx(np.pi, abs=1e-7)
    assert figures["time"] == pytest.approx(np.sqrt(2 * (np.pi - 1) * INERTIA / 2.0), rel=1e-7)
    assert figures["links"] == ["coupler", "rocker"]
    assert not any("reaction" in one.name for one in result.trunnion.summary)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("kind", "places"), [(ANTIPARALLELOGRAM, (np.pi, 0.0)), (DELTOID, (2 * np.pi, 0.0))])
def test_other_linkages_end_at_theirs(kind: Any, places: tuple[float, float], sense: float) -> None:
    moved = driven_four_bar("planar", *kind, motor={"kind": "constant", "effort": sense * 2.0})
    figures = ended(simulate(folding(moved), 3.0, 60), "change_point")
    assert figures["coordinate"] == pytest.approx(places[0 if sense > 0 else 1], abs=1e-7)


def test_a_change_point_that_is_not_reached_ends_nothing() -> None:
    result = simulate(driven_four_bar("planar", *PARALLELOGRAM, range=[0.5, 3.0]), 1.0, 20)
    assert [one.code for one in result.trunnion.findings] == ["simulate.range"]


@pytest.mark.parametrize("several", [False, True])
def test_no_motion_begins_at_a_change_point(several: bool) -> None:
    mechanism = driven_four_bar("planar", *PARALLELOGRAM, start=np.pi)
    with pytest.raises(MechanismError, match=r"drivers\.A\.initial: begins at a change point"):
        simulate(beside(mechanism) if several else mechanism, 1.0)


@pytest.mark.parametrize("several", [False, True])
def test_change_points_are_passed(several: bool) -> None:
    mechanism = driven_four_bar("planar", *PARALLELOGRAM)
    result = simulate(beside(mechanism) if several else mechanism, 1.0, 2)
    (figures,) = [one.figures for one in result.trunnion.findings if one.code == "simulate.passed"]
    assert figures["time"] == pytest.approx(np.sqrt(2 * (np.pi - 1) * INERTIA / 2.0), rel=1e-6)
    assert figures["times"] == [row[0] for row in attribute(result, "events")].count("change-point")
    assert result["drive_coordinate"].values[0, -1] == pytest.approx(1.0 + 2.0 / INERTIA / 2.0, rel=1e-6)
    assert not any("reaction" in one.name for one in result.trunnion.summary)


# ---- evaluations ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("space", ["planar", pytest.param("spatial", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("spring", "constant", "name"),
    [({"stiffness": 1e12}, np.sqrt(INERTIA / 1e12), "stiffness"), ({"damping": 1e9}, INERTIA / 1e9, "damping")],
)
def test_what_makes_a_motion_stiff_is_named(space: str, spring: dict[str, float], constant: float, name: str) -> None:
    """√(J/k) of a spring and J/c of a damper; the motion until then is there."""
    result = simulate(swinging(space, **spring), 1.0, 20, evaluations=2000)
    figures = ended(result, "evaluations")
    assert figures["count"] == 2000
    assert figures["constant"] == pytest.approx(constant, rel=0.02)
    assert any(f"springs.stop.{name} = {spring[name]:.4g}" in cause for cause in figures["causes"])


@pytest.mark.slow
def test_evaluations_suffice_or_the_motion_ends() -> None:
    """Their number is that of the integration: one more than is needed changes nothing."""
    whole = simulate(slider_crank(), 0.05, 5)
    again = simulate(slider_crank(), 0.05, 5, evaluations=100_000)
    np.testing.assert_array_equal(again["drive_rate"], whole["drive_rate"])
    assert ended(simulate(slider_crank(), 0.05, 50, evaluations=50), "evaluations")["count"] == 50
    with pytest.raises(MechanismError, match="cannot do 0 evaluations"):
        simulate(slider_crank(), 0.05, evaluations=0)


def test_progress_is_the_share_of_the_duration() -> None:
    seen: list[float] = []
    simulate(wheel(LINEAR), 5.0, 5, progress=seen.append)
    assert seen == sorted(seen)
    assert 0.0 < seen[0] < seen[-1] == 1.0
