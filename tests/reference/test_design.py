"""The designer's figures against closed forms and against the forces of the analysis."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import trunnion
from mechanisms import MODELS, build, five_bar, four_bar, model, slider_crank
from trunnion import Mechanism
from trunnion.solve.forward import forward
from trunnion.solve.run import prepare
from trunnion.studies import design as figures


def test_dead_centres_of_the_case_study() -> None:
    """THEORY: the rocker of Durango's four-bar turns back at 14.361511563° and 212.157208609°."""
    found = figures.design(trunnion.read("examples/durango-fourbar.yaml"))
    np.testing.assert_allclose(np.degrees(found.dead_centres["D"]), [14.361511563, 212.157208609], atol=1e-9)
    assert found.grashof == "crank-rocker"


def test_slider_crank_turns_back_in_line() -> None:
    """r = 50, l = 200, e = 0: at 0 and 180°; the least transmission angle is acos(r/l)."""
    mechanism = trunnion.read("examples/toleranced-slider-crank.yaml")
    found = figures.design(mechanism)
    np.testing.assert_allclose(found.dead_centres["S"], [0.0, np.pi], atol=1e-12)
    assert found.transmission_angle["P-Q-S"] == pytest.approx(np.arccos(50 / 200), abs=1e-12)


@pytest.mark.parametrize(
    ("sides", "type_"),
    [
        ((100, 30, 90, 70), "crank-rocker"),
        ((30, 100, 90, 70), "double crank"),
        ((100, 90, 30, 70), "double rocker"),
        ((100, 70, 90, 30), "rocker-crank"),
        ((100, 60, 70, 65), "triple rocker"),
        ((100, 50, 100, 50), "change point"),
    ],
)
def test_grashof(sides: tuple[float, ...], type_: str) -> None:
    ground, crank, coupler, rocker = (side / 1000 for side in sides)
    assert figures.grashof(build(four_bar(crank, coupler, rocker, ground))) == type_


def test_limits_of_a_rocker_input_by_the_law_of_cosines() -> None:
    """Input 4, coupler 6, output 3, ground 5.5: |BD| between 6 − 3 and 6 + 3."""
    a, b, c, g = 4.0, 6.0, 3.0, 5.5
    found = figures.design(trunnion.read("examples/durango-fourbar.yaml").with_values({"AB": a}))
    low = np.arccos((a * a + g * g - (b - c) ** 2) / (2 * a * g))
    high = np.arccos((a * a + g * g - (b + c) ** 2) / (2 * a * g))
    expected = [(low, high), (2 * np.pi - high, 2 * np.pi - low)]
    np.testing.assert_allclose(found.limits, expected, atol=1e-9)


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "Watt six-bar", "class III"])
def test_shaking_force_is_what_the_joints_pass_to_the_frame(name: str) -> None:
    """Without loads and gravity the frame feels the inertia and nothing else: forces and moments agree."""
    data = MODELS[name]()
    data.pop("loads", None)
    data["gravity"] = [0, 0]
    mechanism = build(data).with_friction("off")
    run = prepare(mechanism)
    time = run.cycle.times(24)
    back = run.solve(time)
    x, y, turn = np.zeros(24), np.zeros(24), np.zeros(24)
    ground = mechanism.fixed_link
    for joint, (_, (first, second)) in run.system.joints.items():
        if ground not in (first, second):
            continue
        sign = -1.0 if first == ground else 1.0  # the reaction is on the second link, by the first
        reaction, at = back.reactions[joint], back.walk.element(second, joint)
        x, y = x + sign * reaction.x, y + sign * reaction.y
        effort = back.efforts.get(joint, 0.0)
        turn = turn + sign * (reaction.m + effort + at.x * reaction.y - at.y * reaction.x)
    (fx, fy), moment = figures.shaking(back.walk)
    size = np.max(np.hypot(fx, fy))
    np.testing.assert_allclose(x, fx, atol=1e-9 * size)
    np.testing.assert_allclose(y, fy, atol=1e-9 * size)
    np.testing.assert_allclose(turn, moment, atol=1e-9 * np.max(np.abs(moment)))


def test_counterweights_cancel_the_shaking_force_of_a_four_bar() -> None:
    """Added as masses they leave no shaking force; their sense is a mass opposite the crank pin."""
    mechanism = build(four_bar())
    run = prepare(mechanism)
    weights, left = figures.counterweights(run)
    assert left < 1e-12
    data = mechanism.data()
    data.pop("loads", None)
    data["gravity"] = [0, 0]
    for weight in weights:
        link = data["links"][weight.link]
        values = mechanism.parameters()
        mass = values[f"links.{weight.link}.mass"]
        x, y = run.system.centre(run.values, weight.link)
        added = 1.0  # kg, at weight / 1 kg from the origin
        link["mass"] = mass + added
        link["centre"] = [(mass * x + weight.x) / (mass + added), (mass * y + weight.y) / (mass + added)]
    plain = figures.design(mechanism).shaking_force
    assert figures.design(trunnion.Mechanism(**data)).shaking_force < 1e-10 * plain


def test_instant_centres_lie_where_the_velocities_agree_and_in_line() -> None:
    """Kennedy: the three centres of any three links are collinear; the joints are centres themselves."""
    run = prepare(build(four_bar()))
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(7)[1:])
    links = list(run.system.mechanism.links)
    centres = {pair: figures.instant_centre(walk, *pair) for pair in combinations(links, 2)}
    for one, two, three in [(links[0], links[1], links[2]), (links[1], links[2], links[3])]:
        a, b, c = centres[one, two], centres[two, three], centres[one, three]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        span = np.hypot(b[0] - a[0], b[1] - a[1]) * np.hypot(c[0] - a[0], c[1] - a[1])
        assert np.all(np.abs(area) < 1e-9 * span)


def test_the_path_of_a_crank_pin_bends_by_one_over_its_radius() -> None:
    run = prepare(build(slider_crank()))
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(9))
    (crank,) = run.system.plan.modules[0].links
    pins = list(run.system.mechanism.links[crank].points)
    radii = {name: np.hypot(*walk.point(crank, name).place) for name in pins}
    moving = next(name for name in pins if name not in run.system.mechanism.drivers)
    base = walk.point(crank, next(iter(run.system.mechanism.drivers))).place
    place = walk.point(crank, moving).place
    radius = np.hypot(place[0] - base[0], place[1] - base[1])
    assert radii
    np.testing.assert_allclose(np.abs(figures.curvature(walk, crank, moving)), 1 / radius, rtol=1e-12)


def test_flywheel_of_a_sinusoidal_torque() -> None:
    """A hanging pendulum crank: T = m g r cos θ, so the energy swings by 2 m g r."""
    crank = {"points": {"A": [0, 0]}, "mass": 2.0, "centre": [0.3, 0]}
    mechanism = trunnion.Mechanism(
        gravity=[0, -9.81],
        links={"ground": {"points": {"A": [0, 0]}}, "crank": crank},
        joints={"A": {"type": "revolute", "links": ["ground", "crank"]}},
        drivers={"A": {"speed": 5.0}},
    )
    found = figures.design(mechanism)
    assert found.energy_swing == pytest.approx(2 * 2.0 * 9.81 * 0.3, rel=1e-5)
    assert found.flywheel(0.02) == pytest.approx(2 * 2.0 * 9.81 * 0.3 / (0.02 * 25), rel=1e-5)
    with pytest.raises(trunnion.MechanismError):
        found.flywheel(0.0)


def test_two_drivers_and_no_driver() -> None:
    assert figures.design(build(five_bar())).grashof == ""


def test_a_driver_between_two_moving_links_has_no_type() -> None:
    """And says so; its range of assembly is that of its own motion."""
    data = model(four_bar())
    data["drivers"] = {"B": {"range": ["60 deg", "70 deg"], "speed": 1.0}}
    rows = {row.name: row for row in figures.report_figures(Mechanism(**data))}
    assert rows["transmission_angle"].value is None
    assert "B drives two moving links" in rows["transmission_angle"].note
    assert "grashof" not in rows
    assert rows["limits"].aspect
    assert "transmission_angle" not in {row.name for row in figures.report_figures(build(four_bar()))}


def test_design_with_gaps_returns_and_no_mass() -> None:
    """What has no answer is left out: a drive that turns back has no flywheel, a link without mass no balance."""
    gaps = Mechanism(**model(four_bar(2.0, 1.5, 1.5, 4.0)))
    assert any("counterweight" in row.name for row in figures.report_figures(gaps))
    data = model(four_bar())
    data["drivers"] = {"A": {"law": "harmonic", "mean": 1.0, "amplitude": 0.7, "period": 0.5}}
    swinging = Mechanism(**data)
    found = figures.design(swinging)
    np.testing.assert_allclose(found.limits, [(0.3, 1.7)], rtol=1e-9)
    assert np.isnan(found.flywheel(0.05))
    assert "flywheel" not in [row.name for row in figures.report_figures(swinging)]
    bare = model(four_bar(), friction=None)
    for link in bare["links"].values():
        for key in ("mass", "centre", "inertia"):
            link.pop(key, None)
    assert not any("counterweight" in row.name for row in figures.report_figures(Mechanism(**bare)))


def test_work_that_cancels_gives_no_efficiency() -> None:
    """A constant force over a closed path does no net work, whatever the sampling leaves of it."""
    data = model(four_bar(), friction=None)
    data["drivers"] = {"A": {"law": "polynomial-345", "range": [0.0, 1.5], "duration": 0.5, "dwell": 0.1}}
    result = trunnion.analyse(Mechanism(**data), 360)
    assert np.isnan(result["efficiency"])


def test_a_link_at_rest_does_not_turn_back() -> None:
    """A drive that rises, dwells, returns and dwells over a part of the stroke stops the slide, at no dead centre."""
    data = slider_crank()
    (driver,), (slide,) = data["drivers"], (n for n, one in data["joints"].items() if one["type"] == "prismatic")
    data["drivers"][driver] = {"law": "modified-sine", "range": [0.4, 1.2], "duration": 0.2, "dwell": 0.1}
    found = figures.dead_centres(prepare(build(data)))
    assert found[slide] == ()
