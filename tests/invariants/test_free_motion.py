"""What holds of every motion in time: machine code equals walks, where it ends and why, bad numbers are refused."""

import json

import numpy as np
import pytest
from scipy.special import ellipk

from brief import brief
from mechanisms_parts import example, joined
from playing import rattling
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
from trunnion import MechanismError, Status, analyse, simulate
from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.compiled_rates import CompiledRates
from trunnion.dynamics.rates import Walks
from trunnion.dynamics.start import initial_row
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.model.mechanism import Mechanism
from trunnion.solve.run import prepare

LAWS = {
    "coulomb": 0.1,
    "stribeck": {"law": "stribeck", "coefficient": 0.08, "static": 0.12, "stribeck_speed": 0.05, "viscous": 0.1},
    "brown-mcphee": {"law": "brown-mcphee", "coefficient": 0.08, "static": 0.12, "transition_speed": 0.01},
    "lugre": {
        "law": "lugre", "coefficient": 0.08, "static": 0.12, "stribeck_speed": 0.05, "stiffness": 1e4, "damping": 0.01,
    },
}  # fmt: skip


def compared(mechanism, lanes=5):
    """Machine code against walks at random states."""
    motion = FreeMotion.of(prepare(mechanism))
    compiled = CompiledRates(motion)
    walks, rng, pace = Walks(motion), np.random.default_rng(7), float(motion.unit[0]) ** 0.5
    compiled.walks = None  # they are not asked
    for _ in range(lanes):
        q, v = rng.uniform(-10, 10), rng.normal() * pace
        bristles = rng.normal(0, 1e-6, (len(motion.bristles), 1))
        senses = (int(np.sign(v)),) if motion.resisted else ()
        at = Moment(
            np.array([0.1]), np.array([[q]]), np.array([[v]]), np.zeros((1, 1)), bristles, now=0.1, senses=senses
        )
        with np.errstate(all="ignore"):
            wanted, found = walks(at), compiled(at)
        assert found.second == pytest.approx(wanted.second, rel=1e-9)
        rates = 1 + len(bristles)  # of the controller's integral and of the bristles
        assert found.others[:rates] == pytest.approx(wanted.others[:rates], rel=1e-9)
        size = np.max(np.abs(wanted.others[rates:]))
        assert np.abs(found.others - wanted.others)[rates:].max() < 1e-9 * size


@pytest.mark.spread(2)
@pytest.mark.parametrize("law", LAWS)
def test_machine_code_is_what_walks_find(law):
    compared(
        slider_crank(LAWS[law], springs={"damper": {"joint": "S", "stiffness": 200, "free_length": 0.1, "damping": 30}})
    )


def test_near_locking_machine_code_is_what_walks_find():
    """Much friction: weighted norms show that there is one solution where the sum of a row does not."""
    compared(slider_crank(0.8))


DRIVES = {
    "constant": {"kind": "constant", "effort": 5.0},
    "geared": {
        "kind": "linear", "stall_effort": 5, "no_load_speed": 90, "ratio": 3, "efficiency": 0.9, "inertia": 1e-3,
    },
    "controlled": {"kind": "speed-control", "target": 9, "proportional": 0.3, "integral": 0.5, "limit": 8},
    "table": {"kind": "table", "points": [[0, 9], [8, 7], [16, 0]]},
    "braked": {"kind": "constant", "effort": 6, "off_from": 0.05, "brake": 2, "brake_from": 0.06},
}  # fmt: skip


@pytest.mark.spread(5)
@pytest.mark.parametrize("kind", DRIVES)
@pytest.mark.parametrize("name", ["durango-fourbar", "whitworth-quick-return", "jansen"])
def test_machine_code_of_examples_is_what_walks_find(name, kind):
    """Dyads of several kinds, one behind the other, driven by every kind of motor."""
    data = example(name).data()
    next(iter(data["drivers"].values()))["motor"] = DRIVES[kind]
    compared(Mechanism(**data), lanes=3)


def test_slow_motion_is_the_quasi_static_cycle():
    """At a crawl, kept up by a huge flywheel, the reactions are those of `analyse` at a crawl."""
    data = slider_crank().data()
    crank = {**data["links"]["crank"], "inertia": 1e6}
    driver = {"O": {"speed": 0.02, "start": 0.5, "free": True, "initial": {"speed": 0.02}}}
    heavy = Mechanism(**{**data, "links": {**data["links"], "crank": crank}, "drivers": driver})
    result = simulate(heavy, 60.0, 4, 1e-10)
    for row in (1, 2, 3, 4):
        q = float(result["drive_coordinate"].values[0, row])
        still = brief(slider_crank(drivers={"O": {"speed": 0.02, "start": q}}), steps=1)
        wanted = still["reaction_force"].sel(joint="Q").values[:, 0]
        found = result["reaction_force"].sel(joint="Q").values[:, row]
        assert np.abs(found - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_it_stays_where_friction_holds_it():
    """A torque below the friction moves nothing; the reactions are those of one of the possible shares of friction."""
    motor = {"kind": "constant", "effort": 0.05}
    result = simulate(slider_crank(0.3, drivers={"O": {"speed": 1, "start": 0.8, "motor": motor}}, loads={}), 1.0, 4)
    assert np.all(result["drive_coordinate"].values == 0.8)
    assert result["drive_effort"].values[0] == pytest.approx(0.05, abs=1e-9)
    assert [one.code for one in result.trunnion.findings] == ["simulate.stays_at_rest"]


def rocker(friction):
    """A crank-rocker driven at its rocker, which turns round at cos φ = −0.78125, coupler and crank in line."""
    return Mechanism(
        gravity=[0, 0],
        links={
            "ground": {"points": {"A": [0, 0], "D": [0.2, 0]}},
            "crank": {"points": {"A": [0, 0], "B": [0.05, 0]}, "mass": 1, "centre": [0.025, 0], "inertia": 1e-3},
            "coupler": {"points": {"B": [0, 0], "C": [0.18, 0]}, "mass": 0.5, "centre": [0.09, 0], "inertia": 1e-3},
            "rocker": {"points": {"D": [0, 0], "C": [0.12, 0]}, "mass": 0.5, "centre": [0.06, 0], "inertia": 1e-3},
        },
        joints=joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker"),
        joint_defaults={"pin": {"radius": 0.008}, **({"friction": friction} if friction else {})},
        drivers={"D": {"speed": 1, "range": ["110 deg", "150 deg"], "motor": {"kind": "constant", "effort": 2}}},
        assembly={"B": [0.05, 0.02]},
    )


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "close"), [(0.0, 1e-6), pytest.param(0.1, 1e-4, marks=pytest.mark.slow)])
def test_a_driven_joint_ends_at_its_dead_centre(friction, close):
    """It is foreseen, told with its place and time, and reached in some hundred evaluations."""
    motion = FreeMotion.of(prepare(rocker(friction)))
    found = ActiveMotion(motion, Walks(motion), 2.0, 1e-9).run(initial_row(motion))
    assert found.ended.code == "simulate.dead_centre"
    assert found.ended.figures["coordinate"] == pytest.approx(np.arccos(-0.78125), abs=close)
    assert 0.0 < found.ended.time - found.end < 0.05 * found.end
    assert found.asked < 1000


NO_MOTION = [
    {}, {"initial": {"speed": 1}}, {"range": [0, 1], "motor": LINEAR, "initial": {"coordinate": 2}},
    {"motor": {"kind": "table", "points": [[0, 1], [0, 2]]}}, {"motor": {"kind": "linear", "stall_effort": 1}},
    {"motor": {"kind": "steam"}},
    *({"motor": LINEAR | wrong} for wrong in (
        {"inertia": -1}, {"effort": 1}, {"efficiency": 1.2}, {"ratio": 0}, {"brake": 2}, {"no_load_speed": -100})),
]  # fmt: skip


@pytest.mark.parametrize("driver", NO_MOTION)
def test_a_driver_that_cannot_be_let_move_is_refused(driver):
    with pytest.raises(MechanismError) as caught:
        simulate(Mechanism(**{**wheel(LINEAR).data(), "drivers": {"A": {"speed": 1, **driver}}}), 1.0)
    assert {one.code for one in caught.value.findings} == {"input.drivers"}


def test_what_has_no_mass_has_no_acceleration():
    data = wheel(LINEAR).data()
    data["links"]["wheel"]["inertia"] = 0
    with pytest.raises(MechanismError) as caught:
        simulate(Mechanism(**data), 1.0)
    assert caught.value.findings[0].where == "drivers.A"


def test_the_speed_of_a_pendulum_is_largest_between_the_rows():
    """ω² = 2 g (1 − cos 0.5) at the bottom, a quarter of a period from the start."""
    bob = {"points": {"A": [0, 0]}, "mass": 1, "centre": [1, 0]}
    data = {
        "gravity": [0, -9.81],
        "links": {"ground": {"points": {"A": [0, 0]}}, "bob": bob},
        "joints": {"A": {"type": "revolute", "links": ["ground", "bob"]}},
        "drivers": {"A": {"speed": 1, "free": True, "initial": {"coordinate": -np.pi / 2 + 0.5}}},
    }
    quarter = ellipk(np.sin(0.25) ** 2) / np.sqrt(9.81)
    figure = next(
        one for one in simulate(Mechanism(**data), 1.7 * quarter, 2).trunnion.summary if "speed_max" in one.name
    )
    assert figure.value == pytest.approx(-np.sqrt(2 * 9.81 * (1 - np.cos(0.5))), rel=1e-7)
    assert figure.place == f"at {quarter:.4g} s"


@pytest.mark.parametrize("options", [{"duration": -1.0}, {"duration": 1.0, "steps": 0}, {"tolerance": 1.0}])
def test_numbers_without_sense_are_refused(options):
    with pytest.raises(MechanismError):
        simulate(wheel(LINEAR), **options)


def ended(result, code):
    """The figures of the one finding that tells the end, which is the last row."""
    (figures,) = [one.figures for one in result.trunnion.findings if one.code == f"simulate.{code}"]
    assert result["time"].values[-1] == pytest.approx(figures["time"], rel=1e-12)
    assert figures["time"] < result.attrs["duration"]
    assert np.all(np.isfinite(result["drive_coordinate"].values))
    assert not np.any(result["status"].values == Status.NOT_CONVERGED)
    return dict(figures)


def test_the_figures_at_the_end_are_of_the_end():
    """A wheel under a constant torque: ω = √(2 T θ / J) at the end of its range."""
    data = wheel(LINEAR, drag=0.0).data()
    data["drivers"] = {"A": {"speed": 1, "range": [0, 2], "motor": {"kind": "constant", "effort": 4}}}
    found = {one.name: one.value for one in simulate(Mechanism(**data), 1.0, 1).trunnion.summary}
    assert found["A.speed_end"] == pytest.approx(np.sqrt(2 * 4 * 2 / 0.05), rel=1e-8)
    assert found["work_drive"] == pytest.approx(8.0, rel=1e-8)


# ranges
@pytest.mark.slow
@pytest.mark.parametrize(
    ("space", "first", "compiled"), [("planar", True, True), ("planar", False, False), ("spatial", False, True)]
)
def test_a_range_ends_the_motion_of_several_drivers(space, first, compiled, monkeypatch):
    """θ = θ₀ + T t²/(2 J), of the one that gets there first, driven either way."""
    if not compiled:
        monkeypatch.setattr("trunnion.dynamics.simulate.rates_of", Walks)
    flat = space == "planar"
    kind = PARALLELOGRAM[0], [0.875, -0.273]  # at the start of the range
    data = beside(driven_four_bar(space, *kind, range=[-2.0, 1.7 if first else 2.9])).data()
    data["drivers"]["W"] |= {"range": [-1.0, 2.0], "speed": 1, "initial": {"coordinate": 0.0, "speed": -3}}
    figures = ended(simulate(Mechanism(**data), 1.0, 40), "range")
    assert figures["driver"] == ("A" if first else "W")
    assert figures["coordinate"] == pytest.approx(1.7 if first else -1.0, abs=1e-12)
    time = np.sqrt(2 * 0.7 * INERTIA / 2.0)
    assert figures["time"] == pytest.approx(time if first else 1 / 3, rel=1e-8), flat


def test_a_range_that_is_left_and_entered_within_a_step_ends_the_motion():
    """The swing of a spring goes beyond the range by a millionth of itself."""
    data = two_wheels({"kind": "constant", "effort": 0.0}).data()
    for joint in data["joints"].values():
        del joint["losses"]
    data["springs"] = {"hold": {"joint": "W", "stiffness": 0.05, "free_angle": 0}}
    data["drivers"]["W"] |= {"range": [-2.0, 1.0 - 1e-6], "initial": {"coordinate": 0.0, "speed": 1.0}}
    figures = ended(simulate(Mechanism(**data), 3.0, 30), "range")
    assert figures["time"] == pytest.approx(np.arcsin(1.0 - 1e-6), abs=1e-6)


# change points
def folding(mechanism):
    """The same, to fold over at its change points."""
    data = mechanism.data()
    data["assembly"]["rocker"] = "folds"
    return Mechanism(**data)


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("space", ["planar", pytest.param("spatial", marks=pytest.mark.slow)])
def test_a_motion_ends_at_a_change_point(space, several):
    """Where links that fold over would jump: θ = 1 + T t²/(2 J) up to all links in line."""
    mechanism = folding(driven_four_bar(space, *PARALLELOGRAM))
    assert "assembly.change_point" in {one.code for one in analyse(mechanism, 12).trunnion.findings}
    result = simulate(beside(mechanism) if several else mechanism, 1.0, 40)
    figures = ended(result, "change_point")
    assert figures["coordinate"] == pytest.approx(np.pi, abs=1e-7)
    assert figures["time"] == pytest.approx(np.sqrt(2 * (np.pi - 1) * INERTIA / 2.0), rel=1e-7)
    assert figures["links"] == ["coupler", "rocker"]
    assert not any("reaction" in one.name for one in result.trunnion.summary)


@pytest.mark.spread(2)
@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("kind", "places"), [(ANTIPARALLELOGRAM, (np.pi, 0.0)), (DELTOID, (2 * np.pi, 0.0))])
def test_other_linkages_end_at_theirs(kind, places, sense):
    moved = driven_four_bar("planar", *kind, motor={"kind": "constant", "effort": sense * 2.0})
    figures = ended(simulate(folding(moved), 3.0, 60), "change_point")
    assert figures["coordinate"] == pytest.approx(places[0 if sense > 0 else 1], abs=1e-7)


@pytest.mark.parametrize("several", [False, True])
def test_no_motion_begins_at_a_change_point(several):
    mechanism = driven_four_bar("planar", *PARALLELOGRAM, start=np.pi)
    with pytest.raises(MechanismError, match=r"drivers\.A\.initial: begins at a change point"):
        simulate(beside(mechanism) if several else mechanism, 1.0)


# evaluations
def test_a_motion_ends_where_its_evaluations_are_used_up():
    """The motion until then is there."""
    result = simulate(swinging("planar", stiffness=1e12), 1.0, 20, evaluations=2000)
    assert ended(result, "evaluations")["count"] == 2000


def test_at_rest_at_the_end_of_its_range_and_driven_out_of_it():
    motor = {"kind": "constant", "effort": 3.0}
    driver = {"free": True, "speed": 5, "range": [0.3, 1.0], "initial": {"coordinate": 1.0, "speed": 0}, "motor": motor}
    result = simulate(slider_crank(0.0, drivers={"O": driver}), 0.5, 10)
    assert [one.code for one in result.trunnion.findings] == ["simulate.range"]


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.06])
def test_a_start_where_no_mass_moves_is_refused(friction):
    """A piston that is the only mass, at its dead centre; not with a rotor, nor beside the dead centre."""
    data = example("flywheel-press").data()
    for link in ("crank", "rod"):
        data["links"][link] = {"points": data["links"][link]["points"]}
    data["joint_defaults"], data["loads"] = {"friction": friction}, {}
    motor = {"kind": "constant", "effort": 50}

    def begun(start, **more):
        simulate(Mechanism(**{**data, "drivers": {"O": {"speed": 10, "start": start, "motor": motor | more}}}), 1e-4, 1)

    with pytest.raises(MechanismError, match="nothing moves that has a mass"):
        begun(np.pi / 2)
    begun(np.pi / 2, inertia=0.02)
    begun(np.pi / 2 + 0.3)


@pytest.mark.slow
def test_a_driven_joint_in_space_ends_at_its_dead_centre():
    """The rocker of an RSSR moves by itself up to the end of its swing, which a cycle driven by the crank tells."""
    data = example("rssr").data()
    swing = brief(Mechanism(**data), 720)["joint_rotation"].sel(joint="D").values
    k = int(np.argmax(swing))
    low, top, high = swing[k - 1], swing[k], swing[(k + 1) % len(swing)]
    end = float(top + (low - high) ** 2 / (8 * (2 * top - low - high)))  # of the parabola through them
    start = {"coordinate": float(swing[0]), "speed": 30.0}
    data["drivers"] = {"D": {"speed": 1, "free": True, "range": [float(swing[0]), end + 1], "initial": start}}
    found = simulate(Mechanism(**data).with_friction("off"), 3.0, 3)
    (ended,) = [one for one in found.trunnion.findings if one.code == "simulate.dead_centre"]
    assert ended.figures["coordinate"] == pytest.approx(end, abs=3e-6)
    assert [row[0] for row in json.loads(found.attrs["events"])] == ["dead-centre"]


@pytest.mark.slow
def test_a_load_that_may_hold_a_joint_stands_beside_rigid_bodies_in_play():
    """The slider rests until the pin strikes, and the load takes a force times the way."""
    loads = {"drag": {"joint": "S", "resisting_force": 1}}
    found = simulate(rattling({"law": "rigid", "restitution": 0.4}, loads=loads), 6e-4, 60)
    slide, torn = found["joint_slide"].sel(joint="S").values, found["event_time"].values
    kinds = [row[:2] for row in json.loads(found.attrs["events"])]
    assert kinds[:3] == [["stick", "S"], ["impact", "Q"], ["break-away", "S"]]
    assert torn[1] == torn[2] > 0.0
    assert float(found["work_loads"][-1]) == pytest.approx(-abs(slide[-1] - slide[0]), rel=1e-9)
    assert float(abs(found["energy_residual"]).max()) < 1e-8 * float(abs(found["work_drive"]).max())
