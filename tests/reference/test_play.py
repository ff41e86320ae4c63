"""The play of joints against published-style reference values, derivatives through the engine, and brute force.

Brute force moves the pins in their holes and closes the mechanism exactly: `played.changes`.
"""

import json

import numpy as np
import pytest
from presses import press

import mechanisms
import mechanisms_space
import trunnion
from mechanisms_parts import example, plunger
from played import (
    by_duals,
    by_virtual_load,
    changes,
    four_bar,
    measures_of,
    offsets_of,
    plays,
    pressed_to,
    rssr,
    with_play,
)
from trunnion import Mechanism
from trunnion.joints.clearance import worst_case
from trunnion.measures.measures import named, outputs
from trunnion.results.attributes import findings_of, summary_of
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

NOW = np.zeros(1)


@pytest.mark.parametrize("joint", "ABCD")
def test_four_bar(joint):
    """0.02 mm in any one joint turns the rocker by up to 0.017902° at 60°: the links carry one force, 1/(c sin μ)."""
    mechanism = four_bar(joint)
    at = trunnion.play(mechanism, steps=6).isel(position=0)
    assert np.degrees(float(at["value"].item())) == pytest.approx(95.195700, abs=1e-6)
    assert np.degrees(float(at["worst_case"].item())) == pytest.approx(0.017902, abs=5e-7)
    assert float(at["deviation"].item()) == pytest.approx(float(at["worst_case"].item()) / 2, rel=1e-12)  # a disc
    run = prepare(mechanism)
    (measure,) = outputs(run.system)
    angles = np.linspace(0, 2 * np.pi, 3601)[:, None]
    offsets = {f"seats.{joint}.1.x": 2e-5 * np.cos(angles), f"seats.{joint}.1.y": 2e-5 * np.sin(angles)}
    brute = np.degrees(np.max(np.abs(changes(run, measure, offsets, NOW))))
    assert brute == pytest.approx(0.017902, abs=1e-5)
    assert abs(brute - np.degrees(float(at["worst_case"].item()))) < 3e-4 * brute  # second order in the play


@pytest.mark.parametrize("at", [np.pi / 3, "420 deg"])
def test_one_position_is_that_of_the_cycle(at):
    mechanism = four_bar("B")
    names = ["rotation:D", "effort:A"]
    one, cycle = trunnion.play(mechanism, names, at=at), trunnion.play(mechanism, names, steps=12)
    assert one.sizes["position"] == 1
    turns = (cycle["drive"].values - one["drive"].values[0]) / 360
    here = int(np.argmin(np.abs(turns - np.round(turns))))
    for name in ("value", "worst_case", "deviation", "worst_case_total", "status"):
        np.testing.assert_allclose(one[name].values[..., 0], cycle[name].values[..., here], rtol=1e-9, atol=1e-15)


@pytest.mark.spread(1)
@pytest.mark.parametrize("hole_on", ["rocker", "ground"])
def test_rssr(hole_on):
    """0.044402° by the formula."""
    result = trunnion.play(rssr(hole_on=hole_on), ["rotation:D"], steps=1)
    assert np.degrees(float(result["worst_case"].item())) == pytest.approx(0.044402, abs=5e-7)


def test_ends_and_dimensions_of_a_play_scatter_by_one_rule():
    """Uniform in an interval, a disc, a ball: ρ²/3, ρ²/4, ρ²/5 for a unit load in every joint."""
    seen = set()
    for data in (mechanisms.MODELS["slider-crank"](), mechanisms_space.MODELS["RSSR"]().data):
        result = trunnion.play(with_play(data, 1e-5, 3e-5), steps=1).isel(measure=0, position=0)
        loads, radius = result["sensitivity"].values, result["radius"].values
        count = np.sum(np.isfinite(loads), axis=-1)
        parts = radius**2 * np.nansum(loads**2, axis=-1) / (count + 2)
        seen |= set(count[np.isfinite(radius)].tolist())
        np.testing.assert_allclose(result["deviation"] ** 2, np.nansum(parts, axis=-1), rtol=1e-12)
    assert seen == {1, 2, 3}


def _agree(run, names, time):
    """The unit load says what the derivatives through the closure say, at all ends of all joints."""
    known = plays(run.system, run.values)
    walk = forward(run.system, run.values, run.chosen.assembly, time)
    seen = 0
    for measure in named(run.system.mechanism, names, run.values):
        loads, slopes = by_virtual_load(walk, measure, known), by_duals(run, measure, known, time, FrictionMethod())
        scale = max(1.0, *(float(np.nanmax(np.abs(n), initial=0)) for one in slopes.values() for q in one for n in q))
        for name in known:
            for load, slope in zip(loads[name], slopes[name], strict=True):
                for one, other in zip(load, slope, strict=True):
                    one = np.broadcast_to(one, time.shape)
                    seen += int(np.count_nonzero(np.isfinite(one)))
                    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * scale, err_msg=f"{measure.name} {name}")
    assert seen > 0


@pytest.mark.spread(7)
@pytest.mark.parametrize("name", mechanisms.MODELS)
def test_virtual_load_equals_derivatives_in_the_plane(name):
    """Dyads, general groups, gear pairs, drivers: the same to rounding for every measure."""
    run = prepare(with_play(mechanisms.model(mechanisms.MODELS[name]())))
    _agree(run, measures_of(run), run.cycle.times(5) + 1e-3)


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", [name for name in mechanisms_space.MODELS if name != "platform on six legs"])
def test_virtual_load_equals_derivatives_in_space(name):
    """All pairs; every seventh measure, to save time."""
    run = prepare(with_play(mechanisms_space.MODELS[name]().data, float_=1e-5))
    _agree(run, measures_of(run)[::7], run.cycle.times(3) + 1e-4)


def test_misaligned_holes_and_offset_bearings():
    """The ends lie about the middle of the bearing, in the frame of the hole as it leans."""
    data = rssr().data()
    data["joints"]["D"] |= {"misalignment": {"tilt": "2 deg", "towards": "30 deg", "offset": "0.3 mm"}}
    data["joints"]["D"]["pin"] |= {"offset": "7 mm", "end_float": "0.1 mm"}
    run = prepare(trunnion.Mechanism(**data))
    _agree(run, ["rotation:D", "rocker.C.x", "angle:rocker.y"], run.cycle.times(4))


BRUTE = {
    "four-bar": (mechanisms.MODELS["four-bar"], ["rotation:D", "coupler.E.x"]),
    "slider-crank, guide": (mechanisms.MODELS["slider-crank"], ["slide:C", "piston.H.y", "angle:piston"]),
    "class III": (mechanisms.MODELS["class III"], None),
    "geared five-bar": (mechanisms.MODELS["geared five-bar"], None),
    "RSSR, balls": (lambda: mechanisms_space.MODELS["RSSR"]().data, ["rotation:D", "link-3.grip.x"]),
    "RCCC": (lambda: mechanisms_space.MODELS["RCCC"]().data, ["slide:D", "link-2.grip.y"]),
    "PSUR, guide in space": (lambda: mechanisms_space.MODELS["PSUR"]().data, ["link-2.grip.x"]),
    "Cardan": (mechanisms_space.cardan, ["rotation:output", "slide:output"]),
}


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", BRUTE)
def test_worst_case_is_reached_and_not_passed_but_by_second_order(name):
    """Pins pressed by Qᵢ change y by Σ ρ|Qᵢ|, anywhere else by less; what is missing falls with the square of ρ."""
    make, names = BRUTE[name]
    missed = []
    for clearance in (4e-5, 2e-5):
        run = prepare(with_play(make(), clearance, 2 * clearance))
        known, time = plays(run.system, run.values), run.cycle.times(7)[2:3]
        walk = forward(run.system, run.values, run.chosen.assembly, time)
        chosen = measures_of(run)[-4:] if names is None else names
        rng, worst = np.random.default_rng(3), 0.0
        for measure in named(run.system.mechanism, chosen, run.values):
            loads = by_virtual_load(walk, measure, known)
            most = sum(float(np.ravel(worst_case(loads[joint], play.radii))[0]) for joint, play in known.items())
            pressed = {
                joint: [pressed_to(load, float(r)) for load, r in zip(loads[joint], play.radii, strict=True)]
                for joint, play in known.items()
            }
            there = float(changes(run, measure, offsets_of(known, pressed), time).item())
            worst = max(worst, abs(there - most))
            assert there == pytest.approx(most, rel=0.02)
            anywhere = {}
            for joint, play in known.items():
                ends = []
                for end, radius in zip(play.model.ends, play.radii, strict=True):
                    places = rng.normal(size=(len(end), 300, 1))
                    ends.append(tuple(radius * places / np.linalg.norm(places, axis=0)))
                anywhere[joint] = ends
            found = changes(run, measure, offsets_of(known, anywhere), time)
            assert np.nanmax(np.abs(found)) <= 1.02 * most
        missed.append(worst)
    assert missed[1] < 0.3 * missed[0]


def test_effort_with_friction_against_brute_force():
    """Drive torque of a slider-crank with friction and mass: derivatives through the settled friction."""
    run = prepare(with_play(mechanisms.model(mechanisms.slider_crank(), friction=0.1), 1e-5))
    known, time = plays(run.system, run.values), run.cycle.times(8)[1:2] + 0.01
    (measure,) = named(run.system.mechanism, ["effort:A"], run.values)
    slopes = by_duals(run, measure, known, time, FrictionMethod())
    base = float(run.solve(time).efforts["A"].item())
    for joint, play in known.items():
        most = float(worst_case(slopes[joint], play.radii).item())
        pressed = [pressed_to(load, float(r)) for load, r in zip(slopes[joint], play.radii, strict=True)]
        back = run.at(time, offsets_of(known, {joint: pressed}))
        assert float(back.efforts["A"].item()) - base == pytest.approx(most, rel=2e-3)


def test_end_float():
    """A rocker that can shift along its axis by half the float either way, against brute force."""
    mechanism = rssr(clearance=1e-9, float_=1e-4)
    run = prepare(mechanism)
    result = trunnion.play(mechanism, ["rotation:D"], steps=1)
    (measure,) = named(mechanism, ["rotation:D"], run.values)
    brute = float(changes(run, measure, {"seats.D.3.z": np.asarray(5e-5)}, NOW).item())
    assert float(result["sensitivity"].values[0, 0, 2, 2, 0]) * 5e-5 == pytest.approx(brute, rel=1e-3)
    assert float(result["worst_case"].item()) == pytest.approx(abs(brute), rel=1e-3)
    # a ball shifted along the axis by e acts as a change of s₄
    assert float(result["sensitivity"].values[0, 0, 2, 2, 0]) == pytest.approx(-6.11075, abs=1e-4)


@pytest.mark.slow
def test_totals_and_attributes():
    mechanism = example("toleranced-slider-crank")
    result = trunnion.play(mechanism, steps=36)
    assert list(result["measure"].values) == ["stroke-position", "drive-torque"]
    assert result["measure_unit"].values.tolist() == ["m", "N m"]
    parts = result["worst_case"]
    np.testing.assert_allclose(result["worst_case_total"], parts.sum("joint"), rtol=1e-12)
    np.testing.assert_allclose(result["rss"], np.sqrt((parts**2).sum("joint")), rtol=1e-12)
    np.testing.assert_allclose(result["deviation_total"] ** 2, (result["deviation"] ** 2).sum("joint"), rtol=1e-12)
    ideal = trunnion.analyse(mechanism, 36)
    place = ideal["point_position"].sel(point="piston.Q", axis="x")
    np.testing.assert_allclose(result["value"].values[0], place.values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result["value"].values[1], ideal["drive_effort"].values[0], rtol=1e-9)
    assert "stroke-position.worst_case" in [figure.name for figure in summary_of(result)]


def test_driven_joints_have_play_too():
    """The pin of the driver moves the crank's point B as it moves itself."""
    result = trunnion.play(four_bar("A"), ["crank.B.x"], steps=8)
    np.testing.assert_allclose(result["worst_case"].values, 2e-5, rtol=1e-9)


@pytest.mark.parametrize("place", [{}, {"at": "30 deg"}, {"as": "maximum"}])
def test_limit(place):
    """The worst case there decides, on either side of it."""
    data = four_bar("C").data() | {"measures": {"swing": {"rotation": "D", **place}}}
    worst = np.rad2deg(trunnion.play(trunnion.Mechanism(**data), steps=72)["extreme_worst_case"].values.sum())
    for factor, code in ((0.999, "limit.exceeded"), (1.001, "limit.kept")):
        data["measures"]["swing"]["limit"] = f"{factor * worst} deg"
        result = trunnion.play(trunnion.Mechanism(**data), steps=72)
        assert [one.code for one in result.trunnion.findings if one.where == "measures.swing.limit"] == [code]


@pytest.mark.slow
def test_redundant_constraints_make_it_a_bound():
    mechanism = example("fourbar-in-space")
    if mechanism.over_constraint == "refuse":
        mechanism = trunnion.Mechanism(**{**mechanism.data(), "over_constraint": "minimum-norm"})
    result = trunnion.play(with_play(mechanism.data()), steps=12)
    assert any(row["code"] == "play.redundant" for row in json.loads(result.attrs["findings"]))


STEPS, TRIALS = 24, 4000
LARGE = 9.5e-3  # m: play at which the second order shows


def test_exact_figure_bounds_pins_at_the_rims_of_their_holes():
    """No random place of all pins at the rims moves the link further, and the best of them comes close."""
    mechanism = with_play(mechanisms.four_bar(), LARGE)
    link = [name for name in mechanism.effective_links if name != mechanism.fixed_link][-1]
    result = trunnion.play(mechanism, [f"angle:{link}"], STEPS)
    (found,) = [one.figures for one in findings_of(result) if one.code == "play.beyond_first_order"]
    first, exact = found["first"], max(-found["low"], found["high"])
    assert first == pytest.approx(float(result["extreme_worst_case"].sum()))
    assert first >= float(result["worst_case_total"].max()) * (1 - 1e-14)  # the place lies beside one of the positions
    assert 1e-2 < exact / first - 1 < 0.2
    run, rng = prepare(mechanism), np.random.default_rng(7)
    measure = named(mechanism, [f"angle:{link}"], run.values)[0]
    reached = 0.0
    for _ in range(STEPS):
        time = np.full(TRIALS, float(result["extreme_time"].item()))
        places = {}
        for joint in mechanism.effective_joints:
            angle = rng.uniform(0, 2 * np.pi, TRIALS)
            rim = (LARGE * np.cos(angle), LARGE * np.sin(angle))
            places |= offsets_of(plays(run.system, run.values), {joint: [rim]})
        reached = max(reached, float(np.nanmax(np.abs(changes(run, measure, places, time)))))
    assert reached <= exact * (1 + 1e-9)
    assert reached > 0.9 * exact


def pressed(depth, play):
    """A slider-crank, in line where it presses on a spring most deeply, with play between rod and slider alone."""
    spring = {"between": ["ground.W", "ram.B"], "stiffness": 1e6, "free_length": 0.08 + depth, "only": "push"}
    return Mechanism(
        **plunger(0.03, 0.09, {"B": {"pin": {"radius": 0.005, "clearance": play}}}),
        drivers={"O": {"speed": 1.0, "range": [-0.5, 0.5]}},
        springs={"work": spring},
        measures={"force": {"spring_force": "work", "at": 0.0}},
    )


@pytest.mark.parametrize("play", [2e-5, 5e-4])
def test_pins_move_the_corner_of_a_largest_effort(play):
    """A press whose force begins at x = 115 mm, passed both ways: M = F r sin(θ + φ)/cos φ there, of the crank
    that play leaves, by the pins at both its ends, and of the place of the rod's end, by that of the ram. Before and
    behind the dead centre the effort is as large, so that a ram off the line to either side raises it."""
    mechanism = press(
        {"l": 0.1},
        joint_defaults={"pin": {"radius": 0.005, "clearance": play}, "friction": 0},
        drivers={"O": {"speed": 6.0}},
        loads={"press": {"joint": "S", "resisting_force": "1000 N * between(S.slide, 115 mm, 200 mm)"}},
        measures={"top": {"effort": "O", "as": "maximum"}},
    )
    result = trunnion.play(mechanism, ["top"])
    by_crank, by_x, by_y = (
        (moment(*(np.array(PRESSED) + step)) - moment(*(np.array(PRESSED) - step))) / 2e-7 for step in 1e-7 * np.eye(3)
    )
    ram = np.hypot(by_x, by_y)
    effects = play * np.array([abs(by_crank), abs(by_crank), ram])
    assert result["extreme_worst_case"].values.ravel() == pytest.approx(effects, rel=1e-5)
    ways = play * np.array([(2 * way, way * by_x / ram, to * by_y / ram) for way in (1, -1) for to in (1, -1)])
    reached = np.reshape([moment(*(PRESSED + way)) for way in ways], (2, 2)).max(axis=1)
    exact = np.max(np.abs(reached - moment(*PRESSED)))
    found = [one.figures for one in findings_of(result) if one.code.endswith("_first_order")]
    off = np.abs(reached - moment(*PRESSED)) / np.sum(effects) - 1
    assert bool(found) == (np.max(np.abs(off)) > 0.01)
    angle, to = np.linspace(0, 2 * np.pi, 3601), np.array([[1], [-1]])
    rims = play * np.cos(angle), to * play * np.sin(angle)
    anywhere = [moment(PRESSED[0] + way * 2 * play, PRESSED[1] + rims[0], rims[1]).max(axis=0) for way in (1, -1)]
    most = np.max(np.abs(np.array(anywhere) - moment(*PRESSED)))
    assert all(exact * (1 - 1e-4) <= max(-one["low"], one["high"]) <= most * (1 + 1e-9) for one in found)


PRESSED = (0.03, 0.115, 0.0)  # m: crank, and where the force begins


def moment(crank, x, y):
    """Drive moment, N m, of a slider-crank whose slider is pressed on, with the end of its rod at (x, y)."""
    rod, force = 0.1, 1000.0
    away = np.hypot(x, y)
    angle = np.arctan2(y, x) + np.arccos((crank**2 + away**2 - rod**2) / (2 * crank * away))
    lean = np.arcsin((crank * np.sin(angle) - y) / rod)
    return force * crank * np.sin(angle + lean) / np.cos(lean)
