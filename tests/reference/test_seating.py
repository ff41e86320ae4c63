"""Loaded seats of whole linkages against oracles that share nothing with Trunnion, and against closed forms."""

import copy
import json

import numpy as np
import pytest
from benchmarks.drawn import planar

import trunnion
from brief import brief
from mechanisms import four_bar, model, slider_crank
from mechanisms_parts import body, joined
from mechanisms_space import cardan, closed, rssr
from reference.maximal_space import Drive, in_planes, pose_of
from reference.seat_oracle import clearance, settle, travelling
from trunnion.algebra.panels import ON_GRID
from trunnion.errors import Status
from trunnion.solve.run import prepare
from trunnion.solve.seating import SETTLED, loads_of, seating_of

LINKAGES = {"four-bar": four_bar, "slider-crank": slider_crank}
START = 0.1  # rad: off the positions at which the ideal joints do not slip


def loaded(name, friction=0.0, rho=2e-4, guide=None):
    """A linkage of about 1 m with play in all its joints."""
    data = copy.deepcopy(model(LINKAGES[name](), friction=friction or None))
    data["joint_defaults"]["pin"]["clearance"] = rho
    data["joint_defaults"]["seat"] = "loaded"
    if "guide" in data["joint_defaults"]:
        data["joint_defaults"]["guide"]["clearance"] = rho / 2 if guide is None else guide
    data["drivers"]["A"]["start"] = START
    return data


def analysed(data, steps):
    return brief(trunnion.Mechanism(trunnion=1, **data), steps)


def offsets_of(run, result):
    """The seats of a result as values."""
    found = {}
    for seat in run.seats:
        for key in (key for end in seat.play.model.ends for key in end):
            end, axis = key.split(".")
            if end == "3":
                continue  # no end float here
            found[f"seats.{seat.joint}.{key}"] = np.asarray(
                result.seat_offset.sel(joint=seat.joint).values[int(end) - 1, "xyz".index(axis)], float
            )
    return found


def settled_alike(data, steps, places, limit=2e-6, forces=1e-7, moving=np.inf):
    """Seats to a share of the clearance, links to 1e-9, forces and drive to a share, at some positions. Rounds.

    Forces at the seats as found, with pins held in them: with friction, that a seat travels turns the slip round a
    little earlier or later, and the result has that. moving: limit of what travel adds, as a share of the forces.
    """
    run, result = prepare(trunnion.Mechanism(trunnion=1, **data)), analysed(data, steps)
    flat, (driver,) = data.get("space") != "spatial", data["drivers"]
    other, offsets, rounds = in_planes(data) if flat else data, offsets_of(run, result), list[int]()
    assert int(result.seat_rounds.max()) <= 10
    for i in places:
        if result.status.values[i] != Status.SOLVED:
            continue
        back = run.at(result.time.values[i : i + 1], {path: part[i : i + 1] for path, part in offsets.items()})
        home = {link: pose_of(motion.frame) for link, motion in back.walk.motions.items() if link != "ground"}
        turned = float(result.joint_rotation.sel(joint=driver).values[i])
        settled = settle(other, home, {driver: Drive(turned, data["drivers"][driver]["speed"])})
        rounds.append(settled.rounds)
        for link in set(home) - set(settled.oracle.free):
            np.testing.assert_allclose(home[link].axes, settled.motions[link].frame.axes, rtol=0, atol=1e-9)
        size = max(np.linalg.norm(force) for force in settled.solution.force.values())
        for joint in data["joints"]:
            reaction, expected = back.reactions[joint], settled.solution.force[joint]
            force = [float(np.ravel(n)[0]) for n in (reaction[:2] if flat else reaction.u)]
            np.testing.assert_allclose(force, expected[: len(force)], rtol=0, atol=forces * size)
            written = result.reaction_force.sel(joint=joint).values[:, i]
            assert np.max(np.abs(written - force)) <= moving * size  # with the slip and the inertia of the seats
            if flat:
                axis = settled.oracle.elements(settled.motions, joint)[1].frame.axes[:, 2]
                rubbed = axis @ sum(np.split(settled.friction[joint], 2))
                assert float(np.ravel(back.friction[joint])[0]) == pytest.approx(rubbed, abs=forces * size)
        for joint, ends in settled.offsets.items():
            found = np.nan_to_num(result.seat_offset.sel(joint=joint).values[: len(ends), :, i])
            np.testing.assert_allclose(found, ends[:, : found.shape[1]], rtol=0, atol=limit * clearance(other, joint))
        for seat in run.seats if flat else ():
            for load, expected in zip(loads_of(back, seat), settled.loads[seat.joint], strict=True):
                got, across = np.ravel([part[0] for part in load]), expected[:2] if len(load) == 2 else expected[1:2]
                share = 1e-3 if data["joint_defaults"].get("friction") else 1e-6
                np.testing.assert_allclose(got, across, rtol=0, atol=share * np.linalg.norm(expected) + 1e-8)
        effort = float(np.ravel(back.efforts[driver])[0])
        assert effort == pytest.approx(settled.solution.effort[driver], abs=forces * size)
    assert len(rounds) >= 5
    return max(rounds)


@pytest.mark.spread(1)
@pytest.mark.parametrize("friction", [0.0, 0.12, 0.3])
@pytest.mark.parametrize("name", LINKAGES)
def test_planar_linkage_with_play_in_all_joints(name, friction):
    settled_alike(loaded(name, friction), 36, range(0, 36, 5), forces=1e-8)


def losses(result, joint):
    """Positions at which a joint is said to lose contact."""
    return np.flatnonzero(result.contact_lost.sel(joint=joint).values)


def one_crank():
    """A crank alone with ω² r = g: its bearing carries m g (−cos θ, 1 − sin θ), nothing at 90°, and turns round."""
    r, g = 0.1, 9.81
    link = {**body({"A": [0, 0], "B": [r, 0]}), "centre": [r, 0.0]}
    return {
        "gravity": [0.0, -g],
        "joint_defaults": {"pin": {"radius": 0.01, "clearance": 1e-5}, "seat": "loaded"},
        "links": {"ground": {"points": {"A": [0, 0]}}, "crank": link},
        "joints": joined("ground -A- crank"),
        "drivers": {"A": {"speed": float(np.sqrt(g / r))}},
    }


@pytest.mark.parametrize("steps", [72, 101])
def test_crank_whose_bearing_is_relieved_at_one_angle(steps):
    """Loss of contact at 90°, in closed form, whether a position is there or not, and nowhere else."""
    result = trunnion.analyse(trunnion.Mechanism(trunnion=1, **one_crank()), steps)
    angle = np.degrees(result.joint_rotation.sel(joint="A").values)
    where = losses(result, "A")
    assert len(where) == 1
    assert abs(angle[where[0]] - 90) <= 180 / steps + 1e-9
    assert result.status.values[where[0]] == Status.CONTACT_LOST
    theta = np.radians(angle)
    away = np.abs(angle - 90) > 1
    # m g (−cos θ, 1 − sin θ) in the crank's axes; the seat has its direction
    load = (-np.cos(theta) + 1j * (1 - np.sin(theta))) * np.exp(-1j * theta)
    seat = result.seat_offset.sel(joint="A").values[0]
    np.testing.assert_allclose((seat[0] + 1j * seat[1])[away], (1e-5 * load / np.abs(load))[away], rtol=0, atol=2e-11)
    finding = next(f for f in json.loads(result.attrs["findings"]) if f["code"] == "contact.lost")
    assert finding["severity"] == "warning"
    assert "at 90" in finding["figures"]["at"] or f"at {angle[where[0]]:.4g}" in finding["figures"]["at"]


@pytest.mark.parametrize("friction", [0.0, 0.12])
@pytest.mark.parametrize("name", LINKAGES)
def test_power_of_the_settled_linkage(name, friction):
    """Drive, loads and inertia against what the joints lose, to rounding; a joint without friction loses O(ρ²).

    The way of a seat is along the wall, its load is across but for the inertia of that way, which is another ρ.
    """
    result = analysed(loaded(name, friction), 120)
    scale = float(np.max(np.abs(result.drive_power.values)))
    assert float(np.max(np.abs(result.power_residual.values))) < 1e-12 * max(scale, 1.0)
    lost = result.friction_power.values
    if friction:
        assert np.all(lost > -1e-4 * scale)
    else:
        less = analysed(loaded(name, friction, 5e-5), 120).friction_power.values
        assert np.max(np.abs(lost)) < 5e-4 * scale
        assert np.max(np.abs(less)) < np.max(np.abs(lost)) / 10


@pytest.mark.slow
@pytest.mark.parametrize("name", LINKAGES)
def test_reactions_of_a_result_are_those_of_the_whole_motion(name):
    """Inertia by the accelerations of the settled places: as the oracle's, to what its differences leave."""
    for rho in (1e-4, 2.5e-5):
        data = loaded(name, rho=rho)
        result, run = analysed(data, 24), prepare(trunnion.Mechanism(trunnion=1, **data))
        ideal = run.solve(result.time.values).walk.motions
        miss = changed = 0.0
        for i in range(0, 24, 4):
            home = {link: pose_of(motion.frame, i) for link, motion in ideal.items() if link != "ground"}
            turned = float(result.joint_rotation.sel(joint="A").values[i])
            whole = travelling(in_planes(data), home, "A", turned, data["drivers"]["A"]["speed"])
            for joint in data["joints"]:
                written = result.reaction_force.sel(joint=joint).values[:, i]
                miss = max(miss, float(np.hypot(*(written - whole.solution.force[joint][:2]))))
                changed = max(changed, float(np.hypot(*result.reaction_force_change.sel(joint=joint).values[:, i])))
        assert miss < 2e-5 * changed


@pytest.mark.parametrize("name", LINKAGES)
def test_rates_are_the_derivatives_of_the_offsets(name):
    """Velocities and accelerations of every point, beside the inertia of the ideal motion: against its own places."""
    run = prepare(trunnion.Mechanism(trunnion=1, **loaded(name, 0.12)))
    seating, step = seating_of(run), 1e-4 * run.cycle.duration
    middle = np.linspace(0.05, 0.95, 7) * run.cycle.duration
    point = {"four-bar": ("rocker", "C"), "slider-crank": ("piston", "P")}[name]
    before, here, after = (seating.at(middle + k * step).back.walk.point(*point) for k in (-1, 0, 1))
    for axis in range(2):
        rate = (after.place[axis] - before.place[axis]) / (2 * step)
        second = (after.velocity[axis] - before.velocity[axis]) / (2 * step)
        np.testing.assert_allclose(here.velocity[axis], rate, rtol=0, atol=1e-6)
        np.testing.assert_allclose(here.acceleration[axis], second, rtol=0, atol=1e-5)


@pytest.mark.slow
def test_pins_lie_at_their_walls_between_many_bends():
    """Seats of four pins that bend in more places than most: none is the polynomial of a panel that is too wide."""
    seating = seating_of(prepare(trunnion.Mechanism(**planar.seated(90022)[1])))
    panels = seating.courses.states == SETTLED
    offsets = seating.courses.on_nodes(panels)
    between = seating.courses.coefficients[panels] @ ON_GRID
    for end in seating.loads.ends:
        assert np.allclose(np.linalg.norm(offsets[end.rows], axis=0), end.radius, rtol=1e-12, atol=0.0)
        assert np.allclose(np.linalg.norm(between[:, end.rows], axis=1), end.radius, rtol=1e-9, atol=0.0)


def test_where_a_pin_crosses_or_lifts_off_does_not_depend_on_the_positions():
    """At 90° of the crank in closed form; a pin that its load cannot hold on its way lifts off in the same stretch."""
    crank = prepare(trunnion.Mechanism(trunnion=1, **one_crank()))
    (crossing,) = seating_of(crank).loads.crossings
    assert crossing.time / crank.cycle.duration == pytest.approx(0.25, abs=1e-9)
    assert crossing.low < crossing.time < crossing.high
    slider = trunnion.Mechanism(trunnion=1, **loaded("slider-crank", 0.12, 4e-3))
    found = [trunnion.analyse(slider, steps).trunnion.findings for steps in (24, 101)]
    first, second = ([one.figures for one in rows if one.code == "contact.lifted"] for rows in found)
    assert first
    assert first == second


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.1, 0.4])
def test_rssr_with_play_in_all_joints(friction):
    """Tilted pins and balls under inertia, weight and a brake."""
    data = copy.deepcopy(rssr(start=START, friction=friction).data)
    data["assembly"] = {"D": 1.3}
    data["joint_defaults"] |= {"pin": {**data["joint_defaults"]["pin"], "clearance": 2e-5}, "seat": "loaded"}
    assert settled_alike(data, 60, range(5, 60, 9), moving=5e-3) <= 8


@pytest.mark.slow
def test_cardan_with_play_in_all_joints():
    """Table II of Pezzuti et al. with 0.01 mm all over, friction 0.42, pins that slide along."""
    start = 0.3
    drawn = closed(cardan(), start)
    data = copy.deepcopy(drawn.data)
    data["drivers"]["input"]["start"] = start
    data["joint_defaults"] |= {"pin": {**data["joint_defaults"]["pin"], "clearance": 1e-5}, "seat": "loaded"}
    data["assembly"] = {
        f"{link}.{name}": [float(n) for n in frame.place + frame.axes @ np.array(at["at"])]
        for link, frame in drawn.home.items()
        for name, at in data["links"][link]["points"].items()
    }
    settled_alike(data, 72, (0, 15, 31, 50, 65), 1e-6)
