"""A clutch between a motor and its mechanism, against closed forms and against the same motion without one."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from timed import slider_crank, wheel
from trunnion import MechanismError, simulate
from trunnion.dynamics.compiled_rates import CompiledRates
from trunnion.dynamics.measured import figures_in_time
from trunnion.dynamics.rates import Walks
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute
from trunnion.solve.run import prepare

WHEEL = 0.05  # kg m², of `timed.wheel`
ROTOR = 0.02
RUN_UP: dict[str, Any] = {"kind": "constant", "effort": 4, "off_from": 0.5, "inertia": ROTOR}


def events(result: Any) -> list[tuple[str, float]]:
    rows = attribute(result, "events")
    return [(row[0], float(time)) for row, time in zip(rows, result["event_time"].values, strict=True)]


def last(result: Any, name: str) -> float:
    return float(np.ravel(result[name].values)[-1])


def balanced(result: Any, turned_over: float) -> None:
    assert float(np.max(np.abs(result["energy_residual"].values))) < 1e-8 * abs(turned_over)


def loaded(motor: dict[str, Any], moment: str) -> Mechanism:
    """The wheel under a moment that changes with time."""
    data = wheel(motor, drag=0.0).model_dump(exclude_unset=True)
    data["loads"] = {"work": {"link": "wheel", "moment": moment}}
    return Mechanism(**data)


@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_two_inertias_join(ratio: float) -> None:
    """By momentum, with the wheel seen through the gear; ½ J₁ J₂/(J₁ + J₂) Δω² is lost in the clutch."""
    motor = {**RUN_UP, "ratio": ratio, "clutch": 3, "clutch_from": 0.6}
    result = simulate(wheel(motor, drag=0.0), 2.0, 20, 1e-11)
    seen, top = WHEEL / ratio**2, 4 * 0.5 / ROTOR
    common, slipping = ROTOR * top / (ROTOR + seen), top / 3 / (1 / ROTOR + 1 / seen)
    assert last(result, "drive_rate") == pytest.approx(common / ratio, rel=1e-10)
    assert last(result, "rotor_speed") == pytest.approx(common, rel=1e-10)
    lost = 0.5 * ROTOR * seen / (ROTOR + seen) * top**2
    assert last(result, "work_clutch") == pytest.approx(lost, rel=1e-9)
    assert last(result, "work_drive") == pytest.approx(lost + 0.5 * WHEEL * (common / ratio) ** 2, rel=1e-9)
    assert events(result) == [
        ("motor-off", 0.5), ("clutch-slips", 0.6), ("clutch-holds", pytest.approx(0.6 + slipping, rel=1e-10)),
    ]  # fmt: skip
    balanced(result, lost)


def test_before_it_engages_they_move_apart() -> None:
    """The rotor by its motor alone, the wheel by its drag; so they do after it opens, with nothing lost in it."""
    motor = {**RUN_UP, "clutch": 50, "clutch_from": 0.0, "clutch_until": 0.25}
    result = simulate(wheel(motor, initial={"speed": 10.0}), 1.0, 4, 1e-11)
    together = 10.0 + (4 - 0.6) * 0.25 / (WHEEL + ROTOR)
    rotor, rate = result["rotor_speed"].values[0], result["drive_rate"].values[0]
    assert rotor[:2] == pytest.approx([10.0, together], rel=1e-10)
    assert rate[2:] == pytest.approx(together - 0.6 / WHEEL * np.array([0.25, 0.5, 0.75]), rel=1e-10)
    assert rotor[2:] == pytest.approx(together + 4 / ROTOR * 0.25, rel=1e-10)
    assert [kind for kind, _ in events(result)] == ["clutch-opens", "motor-off"]
    assert last(result, "work_clutch") == 0.0


def test_an_overload_makes_it_slip() -> None:
    """T − J₁ (T − L)/(J₁ + J₂) reaches C under L = a t; from then on the slip is a (t − t*)²/(2 J₂)."""
    effort, most, slope = 4.0, 5.0, 10.0
    result = simulate(loaded({**RUN_UP, "off_from": 5, "clutch": most}, "-10 N m/s * time"), 1.5, 3, 1e-11)
    begins = (most * (ROTOR + WHEEL) - WHEEL * effort) / ROTOR / slope
    assert events(result) == [("clutch-slips", pytest.approx(begins, rel=1e-9))]
    slip = result["rotor_speed"].values[0] - result["drive_rate"].values[0]
    assert slip[:2] == pytest.approx(0.0, abs=1e-9)
    assert slip[-1] == pytest.approx(slope * (1.5 - begins) ** 2 / (2 * WHEEL), rel=1e-9)
    assert last(result, "work_clutch") == pytest.approx(most * slope * (1.5 - begins) ** 3 / (6 * WHEEL), rel=1e-8)
    balanced(result, last(result, "work_drive"))


def test_after_an_overload_it_holds_again() -> None:
    """A load that swings: the clutch slips and holds in turn, and every stretch of slip loses C ∫ s dt."""
    motor = {"kind": "linear", "stall_effort": 4, "no_load_speed": 150, "inertia": ROTOR, "clutch": 2.5}
    result = simulate(loaded(motor, "-6 N m * sin(8 rad/s * time)"), 3.0, 30_000, 1e-10)
    kinds = [kind for kind, _ in events(result)]
    assert kinds[:4] == ["clutch-slips", "clutch-holds"] * 2
    assert all(one != other for one, other in pairwise(kinds))
    slip, time = result["rotor_speed"].values[0] - result["drive_rate"].values[0], result["time"].values
    assert last(result, "work_clutch") == pytest.approx(2.5 * np.trapezoid(np.abs(slip), time), rel=1e-5)
    # of the motor's work, by its characteristic at the speed of its rotor, the rotor keeps ½ J ω²
    rotor = result["rotor_speed"].values[0]
    given = np.trapezoid(4 * (1 - rotor / 150) * rotor, time) - 0.5 * ROTOR * rotor[-1] ** 2
    assert last(result, "work_drive") == pytest.approx(given, rel=1e-5)
    balanced(result, last(result, "work_drive"))


def test_it_holds_what_is_just_its_capacity() -> None:
    """T − J₁ T/(J₁ + J₂), without a load: it carries the whole of C, by rounding more, and holds."""
    result = simulate(wheel({**RUN_UP, "off_from": 5, "clutch": 4 - ROTOR * 4 / (ROTOR + WHEEL)}, drag=0.0), 1.0, 2)
    assert events(result) == []
    assert last(result, "drive_rate") == pytest.approx(4 / (ROTOR + WHEEL), rel=1e-9)


def test_the_rotor_turns_while_the_load_holds_the_mechanism() -> None:
    """1 N m comes through the clutch, 3 N m are needed: the wheel rests, and the rotor gets faster by 3 N m."""
    result = simulate(wheel({**RUN_UP, "clutch": 1}, drag=3.0), 0.4, 4, 1e-11)
    assert np.all(result["drive_rate"].values == 0.0)
    assert result["rotor_speed"].values[0] == pytest.approx(3 / ROTOR * result["time"].values, rel=1e-10, abs=1e-12)
    assert result["drive_effort"].values[0] == pytest.approx(1.0)
    assert last(result, "work_clutch") == pytest.approx(0.5 * 3 / ROTOR * 0.4**2, rel=1e-9)
    (note,) = [one.what for one in result.trunnion.findings if one.code == "simulate.stays_at_rest"]
    assert "1 N m act" in note
    assert "from 3 N m on" in note
    balanced(result, last(result, "work_clutch"))


def crank(duration: float, **clutch: Any) -> Any:
    motor = {"kind": "linear", "stall_effort": 6, "no_load_speed": 100, "inertia": 0.01, "efficiency": 0.9, **clutch}
    data = slider_crank().model_dump(exclude_unset=True)
    data["drivers"]["O"]["motor"] = motor
    return simulate(Mechanism(**data), duration, 10, 1e-10)


def test_a_clutch_that_never_slips_is_none() -> None:
    """With friction, a gear's loss and a start from rest."""
    plain, other = crank(0.1), crank(0.1, clutch=100)
    assert other["drive_rate"].values == pytest.approx(plain["drive_rate"].values, rel=1e-8)
    assert last(other, "work_clutch") == 0.0
    assert "work_clutch" not in plain


def test_a_linkage_with_friction_is_started_by_its_clutch() -> None:
    """It rests in friction until then."""
    result = crank(0.06, clutch=8, clutch_from=0.03)
    kinds = [kind for kind, _ in events(result)]
    assert kinds[-1] == "clutch-holds"
    assert "clutch-slips" in kinds
    assert "break-away" in kinds
    balanced(result, last(result, "work_drive"))


@pytest.mark.parametrize("slips", [-1.0, 0.0, 1.0])
def test_machine_code_and_walks_agree_while_it_slips(slips: float) -> None:
    motor = {"kind": "linear", "stall_effort": 6, "no_load_speed": 100, "inertia": 0.01, "efficiency": 0.9, "clutch": 3}
    data = slider_crank().model_dump(exclude_unset=True)
    data["drivers"]["O"]["motor"] = motor
    motion = FreeMotion.of(prepare(Mechanism(**data)))
    compiled, walks = CompiledRates(motion), Walks(motion)
    compiled.walks = None  # they are not asked
    one = np.ones((1, 1))
    at = Moment(np.zeros(1), 0.7 * one, 12.0 * one, 0.0 * one, np.empty((0, 1)), slip=slips * one, slips=slips)
    found, wanted = compiled(at), walks(at)
    assert found.second == pytest.approx(wanted.second, rel=1e-10)
    assert found.works == pytest.approx(wanted.works, rel=1e-10)


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        ({"clutch": -3}, "clutch", "give a value above 0"),
        ({"clutch_from": 2, "clutch_until": 1}, "clutch_until", "give a time after clutch_from"),
        ({"clutch": None, "clutch_from": 1}, "clutch_from", "add clutch"),
        ({"inertia": None}, "clutch", "add inertia"),
        ({"inertia": 0}, "inertia", "give a number above 0"),
    ],
)
def test_a_clutch_that_cannot_be(change: dict[str, Any], path: str, words: str) -> None:
    motor = {key: value for key, value in {**RUN_UP, "clutch": 3, **change}.items() if value is not None}
    with pytest.raises(MechanismError) as caught:
        wheel(motor).parameters()
    (finding,) = caught.value.findings
    assert finding.where == f"drivers.A.motor.{path}"
    assert words in finding.remedy


def test_what_a_clutch_is_not_solved_with() -> None:
    """Several free coordinates, and a steady cycle: one finding each."""
    motor = {**RUN_UP, "off_from": None, "clutch": 3}
    motor = {key: value for key, value in motor.items() if value is not None}
    data = wheel(motor).model_dump(exclude_unset=True)
    data["links"]["second"] = {"points": {"B": [0, 0]}, "inertia": 0.1}
    data["links"]["ground"]["points"]["B"] = [1, 0]
    data["joints"]["B"] = {"type": "revolute", "links": ["ground", "second"]}
    data["drivers"]["B"] = {"speed": 1, "free": True}
    with pytest.raises(MechanismError, match="one free coordinate, and 2 coordinates are free"):
        simulate(Mechanism(**data), 1.0)
    with pytest.raises(MechanismError, match="steady cycle"):
        simulate(wheel(motor), 1.0, steady=True)


def test_motions_with_a_clutch_are_taken_one_by_one() -> None:
    """Among samples of the capacity: the peak effort is that capacity where it slips."""
    motor = {"kind": "linear", "stall_effort": 9, "no_load_speed": 100, "inertia": ROTOR, "clutch": 6}
    run = prepare(wheel(motor))
    values = {**run.values, "drivers.A.motor.clutch": np.array([[5.0], [100.0]])}
    peaks = figures_in_time(run, "A", values, 2, 0.2)["peak_effort"]
    assert peaks == pytest.approx([5.0, 0.6 + WHEEL * (9 - 0.6) / (WHEEL + ROTOR)], rel=1e-9)
