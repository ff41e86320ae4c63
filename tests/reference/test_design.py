"""The designer's figures against closed forms and against the forces of the analysis."""

from itertools import combinations

import numpy as np
import pytest

import trunnion
from mechanisms import MODELS, build, four_bar, model, slider_crank
from mechanisms_parts import bare
from trunnion import Mechanism
from trunnion.solve.forward import forward
from trunnion.solve.run import prepare
from trunnion.studies import design as figures


def test_dead_centres_of_the_case_study():
    """THEORY: the rocker of Durango's four-bar turns back at 14.361511563° and 212.157208609°."""
    found = figures.design(trunnion.read("examples/durango-fourbar.yaml"))
    np.testing.assert_allclose(np.degrees(found.dead_centres["D"]), [14.361511563, 212.157208609], atol=1e-9)
    assert found.grashof == "crank-rocker"


def test_slider_crank_turns_back_in_line():
    """r = 50, l = 200, e = 0: at 0 and 180°; the least transmission angle is acos(r/l)."""
    found = figures.design(trunnion.read("examples/toleranced-slider-crank.yaml"))
    np.testing.assert_allclose(found.dead_centres["S"], [0.0, np.pi], atol=1e-12)
    assert found.transmission_angle["P-Q-S"] == pytest.approx(np.arccos(50 / 200), abs=1e-12)


@pytest.mark.parametrize(
    ("sides", "type_"),
    [
        ((100, 30, 90, 70), "crank-rocker"), ((30, 100, 90, 70), "double crank"), ((100, 90, 30, 70), "double rocker"),
        ((100, 70, 90, 30), "rocker-crank"), ((100, 60, 70, 65), "triple rocker"), ((100, 50, 100, 50), "change point"),
    ],
)  # fmt: skip
def test_grashof(sides, type_):
    ground, crank, coupler, rocker = (side / 1000 for side in sides)
    assert figures.grashof(build(four_bar(crank, coupler, rocker, ground))) == type_


def test_limits_of_a_rocker_input_by_the_law_of_cosines():
    """Input 4, coupler 6, output 3, ground 5.5: |BD| between 6 − 3 and 6 + 3."""
    a, b, c, g = 4.0, 6.0, 3.0, 5.5
    found = figures.design(trunnion.read("examples/durango-fourbar.yaml").with_values({"AB": a}))
    low = np.arccos((a * a + g * g - (b - c) ** 2) / (2 * a * g))
    high = np.arccos((a * a + g * g - (b + c) ** 2) / (2 * a * g))
    expected = [(low, high), (2 * np.pi - high, 2 * np.pi - low)]
    np.testing.assert_allclose(found.limits, expected, atol=1e-9)


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "Watt six-bar", "class III"])
def test_shaking_force_is_what_the_joints_pass_to_the_frame(name):
    """Without loads and gravity the frame feels the inertia and nothing else: forces and moments agree."""
    data = MODELS[name]()
    data.pop("loads", None)
    data["gravity"] = [0, 0]
    mechanism = build(data).with_friction("off")
    run = prepare(mechanism)
    back = run.solve(run.cycle.times(24))
    x, y, turn = np.zeros(24), np.zeros(24), np.zeros(24)
    ground = mechanism.fixed_link
    for joint, entry in run.system.joints.items():
        first, second = entry.links
        if ground not in (first, second):
            continue
        sign = -1.0 if first == ground else 1.0  # the reaction is on the second link, by the first
        reaction = back.reactions[joint]
        x, y = x + sign * reaction.x, y + sign * reaction.y
        turn = turn + sign * (reaction.m + back.efforts.get(joint, 0.0))
    (fx, fy), moment = figures.shaking(back.walk)
    size = np.max(np.hypot(fx, fy))
    np.testing.assert_allclose(x, fx, atol=1e-9 * size)
    np.testing.assert_allclose(y, fy, atol=1e-9 * size)
    np.testing.assert_allclose(turn, moment, atol=1e-9 * np.max(np.abs(moment)))


def test_counterweights_cancel_the_shaking_force_of_a_four_bar():
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
        mass = mechanism.parameters()[f"links.{weight.link}.mass"]
        x, y = run.system.centre(run.values, weight.link)
        added = 1.0  # kg, at weight / 1 kg from the origin
        link["mass"] = mass + added
        link["centre"] = [(mass * x + weight.x) / (mass + added), (mass * y + weight.y) / (mass + added)]
    plain = figures.design(mechanism).shaking_force
    assert figures.design(trunnion.Mechanism(**data)).shaking_force < 1e-10 * plain


def test_instant_centres_lie_where_the_velocities_agree_and_in_line():
    """Kennedy: the three centres of any three links are collinear; the joints are centres themselves."""
    run = prepare(build(four_bar()))
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(7)[1:])
    links = list(run.system.mechanism.links)
    centres = {frozenset(one.pair): (one.x, one.y) for one in figures.instant_centres(walk, 6, len(links))}
    for one, two, three in [(links[0], links[1], links[2]), (links[1], links[2], links[3])]:
        a, b, c = (centres[frozenset(pair)] for pair in combinations((one, two, three), 2))
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        span = np.hypot(b[0] - a[0], b[1] - a[1]) * np.hypot(c[0] - a[0], c[1] - a[1])
        assert np.all(np.abs(area) < 1e-9 * span)


def test_work_that_cancels_gives_no_efficiency():
    """A constant force over a closed path does no net work, whatever the sampling leaves of it."""
    data = model(four_bar(), friction=None)
    data["drivers"] = {"A": {"law": "polynomial-345", "range": [0.0, 1.5], "duration": 0.5, "dwell": 0.1}}
    assert np.isnan(trunnion.analyse(Mechanism(**data), 360)["efficiency"])


def test_a_link_at_rest_does_not_turn_back():
    """A drive that rises, dwells, returns and dwells over a part of the stroke stops the slide, at no dead centre."""
    data = slider_crank()
    (driver,), (slide,) = data["drivers"], (n for n, one in data["joints"].items() if one["type"] == "prismatic")
    data["drivers"][driver] = {"law": "modified-sine", "range": [0.4, 1.2], "duration": 0.2, "dwell": 0.1}
    assert figures.dead_centres(prepare(build(data)))[slide] == ()


DYADS = ["four-bar", "four-bar, other branch", "slider-crank", "inverted slider-crank", "Scotch yoke", "elliptic bar",
         "tangent drive"]  # fmt: skip


def angles(mechanism, steps=24):
    run = prepare(mechanism)
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(steps))
    return run, walk, figures.pressure_angles(walk)


def forwards(r, length, offset):
    """A slider-crank that turns counterclockwise from 0."""
    return {**slider_crank(r, length, offset), "drivers": {"A": {"speed": 1.0}}}


@pytest.mark.parametrize("offset", [0.0, 0.1, -0.2])
def test_slider_crank(offset):
    """sin φ = (e − r sin θ)/l for a slide along x."""
    r, length = 0.3, 1.0
    _, _, found = angles(build(forwards(r, length, offset)))
    ((name, angle),) = found.items()
    theta = np.arange(24) * (np.pi / 12)
    np.testing.assert_allclose(np.sin(angle), (offset - r * np.sin(theta)) / length, atol=1e-14)
    extremes = figures.design(build(forwards(r, length, offset))).pressure_angle[name]
    np.testing.assert_allclose(np.sin(extremes[::2]), [(offset - r) / length, (offset + r) / length], atol=1e-12)
    np.testing.assert_allclose(extremes[1::2], [np.pi / 2, 3 * np.pi / 2], atol=1e-12)


@pytest.mark.parametrize("name", DYADS)
@pytest.mark.parametrize("loaded", [1, 0])
def test_it_is_between_the_force_and_the_velocity_of_the_analysis(name, loaded):
    """Massless, no friction, loads on one link of the dyad alone: the other is a two-force link."""
    mechanism = build({**bare(MODELS[name]()), "gravity": [0, 0]}).with_friction("off")
    module = next(one for one in prepare(mechanism).system.plan.modules if len(one.links) == 2)
    if module.kind == "RPP" and loaded == 0:
        return  # the second link passes a couple and no force
    driven = module.links[loaded]
    point = next(iter(mechanism.links[driven].points))
    load = {"link": driven, "at": point, "force": [30.0, -70.0], "moment": 11.0}
    mechanism = Mechanism(**{**mechanism.data(), "loads": {"F": load}})
    run, walk, found = angles(mechanism)
    b, c, d = module.joints
    # the force acts on the driven link in C, but by a slide through the outer pin of the two-force link
    acts_at, holder_at = (c if run.system.joints[c].type == "revolute" else (b, d)[1 - loaded]), (b, d)[loaded]
    holder = next(link for link in run.system.joints[holder_at].links if link != driven)
    place = walk.element(run.system.joints[acts_at].links[0], acts_at)
    reaction = run.solve(run.cycle.times(24)).reactions[c]

    def velocity(link):
        twist = walk.motions[link].twist
        return twist.x - twist.w * place.y, twist.y + twist.w * place.x

    (x, y), (hx, hy) = velocity(driven), velocity(holder)
    x, y = x - hx, y - hy
    size = np.hypot(reaction.x, reaction.y) * np.hypot(x, y)
    good = size > 1e-6 * np.max(size)
    assert np.count_nonzero(good) > 12
    cosine = np.abs(reaction.x * x + reaction.y * y)[good] / size[good]
    expected = np.broadcast_to(np.cos(found["-".join(module.joints)]), size.shape)[good]
    np.testing.assert_allclose(cosine, expected, atol=1e-9)
