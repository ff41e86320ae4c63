"""Measures and their figures against closed forms, published values and the books of `analyse`."""

import numpy as np
import pytest
from scipy import optimize
from scipy.spatial.transform import Rotation

import trunnion
from measured import figures
from mechanisms import DURANGO, build, four_bar, slider_crank
from mechanisms_parts import corner, example
from mechanisms_space import rssr
from trunnion import Mechanism
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.measures.measures import Measure
from trunnion.measures.positions import plan
from trunnion.results.attributes import MORE_THAN, summary_of
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.run import prepare

R, L, E = 0.3, 1.0, 0.1  # crank, rod, offset of the guide

STROKE = Measure("stroke", "stroke", "C")
FAR = Measure("far", "dead_centre", "C")
NEAR = Measure("near", "dead_centre", "C", statistic="place-of-minimum")
RATIO = Measure("ratio", "time_ratio", "C")


@pytest.fixture(scope="module")
def crank():
    data = slider_crank(R, L, E)
    data["loads"]["press"] = {"joint": "C", "resisting_force": "30 N"}
    data["springs"] = {"coil": {"joint": "P", "stiffness": "20 N m/rad", "free_angle": 0}}
    return prepare(build(data))


@pytest.fixture(scope="module")
def durango():
    return prepare(trunnion.read(DURANGO))


def stroke_of(r=R, length=L, offset=E):
    """From both positions in which crank and rod are in line."""
    return np.sqrt((length + r) ** 2 - offset**2) - np.sqrt((length - r) ** 2 - offset**2)


def far_of(r=R, length=L, offset=E):
    return np.arcsin(offset / (length + r))


def near_of(r=R, length=L, offset=E):
    return np.pi + np.arcsin(offset / (length - r))


def ratio_of(r=R, length=L, offset=E):
    way = near_of(r, length, offset) - far_of(r, length, offset)
    return way / (2 * np.pi - way)


SIZES = {"links.crank.points.B.x": 0, "links.rod.points.P.x": 1, "links.ground.points.C.y": 2}


def test_of_many_samples(crank):
    """The same closed forms with crank, rod and guide of every sample, and with driver speeds of their own."""
    rng = np.random.default_rng(3)
    r, length, offset = (n * (1 + 0.02 * rng.uniform(-1, 1, (50, 1))) for n in (R, L, E))
    changes = dict(zip(SIZES, (r, length, offset), strict=True))
    for speed in ({}, {"drivers.A.speed": -6.0 * (1 + 0.1 * rng.uniform(-1, 1, (50, 1)))}):
        found = figures(crank, [STROKE, FAR, NEAR, RATIO], 180, {**changes, **speed})
        np.testing.assert_allclose(found["stroke"], stroke_of(r, length, offset)[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found["ratio"], ratio_of(r, length, offset)[:, 0], rtol=0, atol=1e-9)
        for name, formula, limit in (("far", far_of, 1e-10), ("near", near_of, 1e-9)):
            np.testing.assert_allclose(np.sin((found[name] - formula(r, length, offset)[:, 0]) / 2), 0, atol=limit / 2)


@pytest.mark.parametrize("path", SIZES)
def test_derivatives_of_stroke_and_dead_centres(crank, path):
    """By dual numbers through the engine, the positions and the search for the extremes; against the closed forms."""
    sizes = np.array([R, L, E])
    found = figures(crank, [STROKE, FAR, NEAR, RATIO], 360, {path: Dual(sizes[SIZES[path]], 1.0)})
    step = 1e-6
    for name, formula in {"stroke": stroke_of, "far": far_of, "near": near_of, "ratio": ratio_of}.items():
        shift = step * np.eye(3)[SIZES[path]]
        slope = (formula(*(sizes + shift)) - formula(*(sizes - shift))) / (2 * step)
        assert float(np.ravel(derivative(found[name]))[0]) == pytest.approx(slope, rel=2e-7, abs=1e-8)


@pytest.mark.parametrize("pivots", [25, 90, 120 / 1.00025, 300])
def test_time_ratio_of_a_quick_return(pivots):
    """Ram in line with the lever's pivot. Inside the crank's circle the lever turns right round (Whitworth) and stands
    along the guide at both ends of the shorter way, φ = 2 acos(d/r) of the crank; outside it rocks, φ = 2 acos(r/d).
    """
    whitworth = example("whitworth-quick-return").with_values({"d": f"{pivots} mm"})
    short = 2 * np.arccos(min(pivots / 120, 120 / pivots))
    joint = "G" if pivots < 120 else "C"
    for law in ({"speed": "40 rpm"}, {"speed": "-3 rad/s", "start": "1 rad"}):
        run = prepare(Mechanism(**{**whitworth.data(), "drivers": {"O": law}}))
        found = figures(run, [Measure("ratio", "time_ratio", joint), Measure("stroke", "stroke", joint)], 60)
        ratio = (2 * np.pi - short) / short
        assert found["ratio"] == pytest.approx(ratio, rel=max(1e-7, 1e-8 * ratio))
        stroke = 200e-3 if pivots < 120 else 2 * np.arcsin(120 / pivots)
        assert found["stroke"] == pytest.approx(stroke, rel=1e-8)


def test_time_ratio_where_the_lever_goes_through_its_pivot():
    """The crank as long as the pivots are apart: the lever jumps by half a turn, and there is no ratio."""
    whitworth = example("whitworth-quick-return").with_values({"d": "120 mm"})
    assert np.isnan(figures(prepare(whitworth), [Measure("ratio", "time_ratio", "G")], 60)["ratio"])


@pytest.mark.parametrize("short", [0.0, 1e-6])
def test_time_ratio_of_a_slider_crank_that_can_just_turn(short):
    """φ = asin(e/(l − r)) − asin(e/(l + r)); as the offset e nears l − r the inner dead centre becomes a sharp one."""
    offset = example("offset-slider-crank")
    r, length = (offset.parameters()[f"dimensions.{name}"] for name in "rl")
    e = (length - r) * (1 - short) if short else 0.5 * (length - r)
    run = prepare(offset.with_values({"e": f"{float(e)!r} m"}))
    turn = np.arcsin(e / (length - r)) - np.arcsin(e / (length + r))
    found = figures(run, [Measure("ratio", "time_ratio", "S"), Measure("stroke", "stroke", "S")], 60)
    assert found["ratio"] == pytest.approx((np.pi + turn) / (np.pi - turn), rel=1e-7)
    ends = np.sqrt((length + r) ** 2 - e**2) - np.sqrt((length - r) ** 2 - e**2)
    assert found["stroke"] == pytest.approx(ends, rel=1e-8)


def test_time_ratio_is_of_a_whole_turn(durango):
    """None of a crank that turns on, nor of a part of a turn; 197.80° and 162.20° of the four-bar."""
    ratio, round_ = Measure("ratio", "time_ratio", "D"), Measure("round", "time_ratio", "A")
    found = figures(durango, [ratio, round_], 720)
    assert found["ratio"] == pytest.approx(197.795697046 / (360 - 197.795697046), rel=1e-9)
    assert np.isnan(found["round"])
    data = {**durango.system.mechanism.data(), "measures": {"ratio": {"time_ratio": "D"}}}
    part = Mechanism(**{**data, "drivers": {"A": {"speed": 1.0, "range": [0, 5]}}})
    (told,) = [one for one in trunnion.analyse(part, 24).trunnion.summary if one.name == "ratio"]
    assert told.value is None


def test_dead_centre_outside_its_window(durango):
    """14.361511563° and 212.157208609°, known to all digits; told from the end of a range, where the motion goes on."""
    inside = Measure("inside", "dead_centre", "D", over=(np.radians(180), np.radians(240)))
    outside = Measure("outside", "dead_centre", "D", over=(np.radians(220), np.radians(300)))
    place = Measure("place", "rotation", "D", over=outside.over, statistic="place-of-maximum")
    least = Measure("least", "dead_centre", "D", statistic="place-of-minimum")
    found = figures(durango, [inside, outside, place, least], 720)
    assert np.degrees(found["inside"]) == pytest.approx(212.157208609, abs=2e-9)
    assert np.degrees(found["least"]) % 360 == pytest.approx(14.361511563, abs=2e-9)
    assert np.isnan(found["outside"])
    assert np.degrees(found["place"]) == pytest.approx(220, abs=1e-9)


def test_rotation_over_whole_turns(durango):
    """The crank gains a turn, from the first position to the end of the cycle; a window from 300° to 60° is 120°."""
    turn = Measure("turn", "rotation", "A", statistic="peak-to-peak")
    third = Measure("third", "rotation", "A", over=(np.radians(300), np.radians(60)), statistic="peak-to-peak")
    found = figures(durango, [turn, third], 90)
    assert found["turn"] == pytest.approx(2 * np.pi, abs=1e-12)
    assert found["third"] == pytest.approx(np.radians(120), abs=1e-12)


def test_deviation_and_path_error(crank):
    """A guide that is 1 mm higher: the piston goes up by it, its slide changes with the angle of the rod."""
    raised = {"links.ground.points.C.y": np.array([[E + 1e-3], [E - 2e-3], [E]])}
    path = Measure("path", "path_error", "piston.P")
    height = Measure("height", "point", "piston.P", "y")
    drift = Measure("drift", "point", "piston.P", "x")
    error = Measure("error", "transmission_error", "C")
    found = figures(crank, [path, height, drift, error], 180, raised)
    np.testing.assert_allclose(found["height"], [1e-3, 2e-3, 0], rtol=0, atol=1e-15)
    q = np.linspace(0, 2 * np.pi, 100_001)

    def x(offset):
        return R * np.cos(q) + np.sqrt(L**2 - (offset - R * np.sin(q)) ** 2)

    changes = [x(E + step) - x(E) for step in (1e-3, -2e-3, 0)]
    np.testing.assert_allclose(found["drift"], [np.max(np.abs(n)) for n in changes], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found["error"], found["drift"], rtol=0, atol=1e-14)
    away = [np.max(np.hypot(n, step)) for n, step in zip(changes, (1e-3, -2e-3, 0), strict=True)]
    np.testing.assert_allclose(found["path"], away, rtol=0, atol=1e-12)


def test_angles_over_the_cut(durango):
    """Where an angle jumps from π to −π its deviation does not."""
    data = four_bar()
    for start in np.linspace(0, 2 * np.pi, 3, endpoint=False):
        data["drivers"] = {"A": {"speed": 2.0, "start": float(start)}}
        run = prepare(build(data))
        measures = [Measure(f"a{link}", "angle", link) for link in ("crank", "coupler", "rocker")]
        found = figures(run, measures, 72, {"links.coupler.points.C.x": np.array([[0.9005], [0.8995]])})
        assert max(np.max(number) for number in found.values()) < 2e-3
        assert min(np.min(number) for name, number in found.items() if name != "acrank") > 1e-4


def width(x, y):
    """Of a path about its least-squares line, found by search."""

    def squares(angle):
        away = (y - np.mean(y)) * np.cos(angle) - (x - np.mean(x)) * np.sin(angle)
        return float(np.sum(away**2))

    best = optimize.minimize_scalar(squares, bracket=(-0.1, 0.1), options={"xtol": 1e-12}).x
    return float(np.ptp((y - np.mean(y)) * np.cos(best) - (x - np.mean(x)) * np.sin(best)))


def test_straightness_of_hoeckens_line():
    """Over the half turn of the crank in which it is nearly straight, by circles intersected at many places."""
    run = prepare(example("hoecken"))
    half = Measure("half", "straightness", "coupler.P", over=(np.pi / 2, 3 * np.pi / 2))
    part = Measure("part", "straightness", "coupler.P", over=(np.radians(100), np.radians(233.3)))
    found = figures(run, [half, part], 720)
    for name, ends in {"half": (90, 270), "part": (100, 233.3)}.items():
        b = 0.04 * np.exp(1j * np.radians(np.linspace(*ends, 200_001)))
        point = b + 2 * (corner(b, 0.08, 0.1, 0.1, -1) - b)
        assert found[name] == pytest.approx(width(point.real, point.imag), rel=2e-4)


def test_straightness_of_a_circle_and_of_a_line(crank):
    """As wide as it is long; and the path of the piston, which is straight."""
    pin = Measure("pin", "straightness", "crank.B")
    found = figures(crank, [pin, Measure("piston", "straightness", "piston.P")], 90)
    assert found["pin"] == pytest.approx(2 * R, rel=1e-6)
    assert found["piston"] == pytest.approx(0, abs=1e-15)


def test_derivative_of_a_straightness():
    """By dual numbers and by two figures, in the plane and of the same mechanism in space."""
    run = prepare(build(four_bar()))
    path = "links.coupler.points.C.x"
    line = Measure("line", "straightness", "coupler.E", over=(1.0, 2.5))
    slope = float(np.ravel(derivative(figures(run, [line], 90, {path: Dual(0.9, 1.0)})["line"]))[0])
    ends = figures(run, [line], 90, {path: np.array([[0.9 + 1e-6], [0.9 - 1e-6]])})["line"]
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)


def test_straightness_in_space():
    """A path in a plane of space is as straight as in the plane, if it lies evenly about its line."""
    run = prepare(example("fourbar-in-space"))
    link, point = next((link, point) for link, point in run.system.points if link != run.system.mechanism.fixed_link)
    found = figures(run, [Measure("line", "straightness", f"{link}.{point}")], 180)["line"]
    times = run.cycle.times(180)
    xyz = np.array([np.broadcast_to(n, times.shape) for n in run.solve(times).walk.point(link, point).place])
    centred = xyz - xyz.mean(axis=1, keepdims=True)
    along = np.linalg.svd(centred)[0][:, 0]
    rest = centred - np.outer(along, along @ centred)
    assert found == pytest.approx(2 * np.max(np.linalg.norm(rest, axis=0)), rel=1e-4)


@pytest.mark.slow
def test_locking_margin():
    """The least of the analysis to where it is looked for; no derivative, rather than a silent 0."""
    run = prepare(build(slider_crank(R, L, E), friction=0.4, radius=0.08))
    least = float(np.nanmin(trunnion.locking(run.system.mechanism, 90)["locking_margin"].values))
    assert least < MARGIN
    margin = Measure("margin", "locking_margin", "mechanism")
    found = figures(run, [margin], 90)["margin"]
    assert least * 0.99 < found <= least
    slope = figures(run, [margin], 90, {"links.crank.points.B.x": Dual(R, 1.0)})["margin"]
    assert np.isnan(np.ravel(derivative(slope))[0])
    assert float(np.ravel(primal(slope))[0]) == pytest.approx(found, rel=1e-12)


@pytest.mark.slow
def test_a_locking_margin_beyond_what_is_looked_for_is_infinite():
    """In a result, a sweep and samples; the summary says "more than"; its place does not exist."""
    statistics = ["minimum", "mean", "place-of-minimum"]
    measures = {name: {"locking_margin": "mechanism", "as": name} for name in statistics}
    measures["minimum"]["at_least"] = 2
    data = four_bar()
    mechanism = build({**data, "measures": measures}, friction=0.05)
    result = trunnion.analyse(mechanism, 12)
    np.testing.assert_array_equal(result["measure_figure"], [np.inf, np.inf, np.nan])
    assert np.all(np.isinf(result["measure_value"]))
    rows = {row.name: row for row in summary_of(result)}
    assert [(rows[name].value, rows[name].aspect) for name in statistics[:2]] == [(MARGIN, MORE_THAN)] * 2
    mass = f"links.{next(name for name, link in data['links'].items() if 'mass' in link)}.mass"
    swept = trunnion.sweep(mechanism, {mass: [1.0, 1.1]}, 12, measures=["minimum"])
    assert np.all(np.isinf(swept["minimum"]))
    studied = trunnion.tolerance(mechanism.with_values({mass: "1 kg ± 0.1 kg"}), ["minimum"], samples=20)
    assert (studied["nominal"][0], studied["yield"][0]) == (np.inf, 1)


@pytest.mark.parametrize("scale", [1.0, 1e-7])
def test_turn_of_a_link_in_space(scale):
    """About each global axis the component of the rotation vector from the nominal attitude, however far it is."""
    run = prepare(Mechanism(**rssr().data))
    link = next(name for name in run.system.mechanism.links if run.system.mechanism.drivers and "rocker" in name)
    measures = [Measure(axis, "angle", link, axis, at=1.0) for axis in "xyz"]
    path = next(path for path in run.values if path.startswith(f"links.{link}.points.") and run.values[path] > 0.01)
    value = float(run.values[path])
    changes = value * (1 + scale * np.array([[0.0], [0.01], [-0.1]]))
    positions = plan(run, measures, 36)
    found = figures(run, measures, 36, {path: changes})
    walk = run.solve(positions.times, run.system.mechanism.parameters({path: changes})).walk
    axes = np.array([[np.broadcast_to(n, (3, 1)) for n in axis] for axis in walk.motions[link].frame[:3]])
    frames = np.moveaxis(axes[..., 0], 2, 0).swapaxes(1, 2)  # columns are the axes
    for k in range(3):
        vector = Rotation.from_matrix(frames[k] @ frames[0].T).as_rotvec()
        turned = [float(found[axis][k]) for axis in "xyz"]
        np.testing.assert_allclose(turned, vector, rtol=1e-7 if scale < 1 else 1e-10, atol=1e-14)
    slopes = figures(run, measures, 36, {path: Dual(value, 1.0)})
    for axis in "xyz":
        step = 1e-6 * value
        ends = figures(
            run, [Measure(axis, "angle", link, axis, at=1.0)], 36, {path: value + np.array([[step], [-step]])}
        )
        slope = (ends[axis][0] - ends[axis][1]) / (2 * step)
        assert float(np.ravel(derivative(slopes[axis]))[0]) == pytest.approx(slope, rel=1e-6, abs=1e-7)


def test_place_of_a_law_that_is_not_steady():
    """The time at which a rise has a coordinate, and the coordinate at which the slide is shortest."""
    rise = {"law": "cycloidal", "range": [2.0, 4.4], "duration": 2.0, "returns": False}
    run = prepare(build({**slider_crank(R, L, E), "drivers": {"A": rise}}))
    found = figures(run, [Measure("at", "rotation", "A", at=2.7), NEAR], 360)
    assert found["at"] == pytest.approx(2.7, abs=1e-13)
    assert found["near"] == pytest.approx(near_of(), abs=1e-9)
