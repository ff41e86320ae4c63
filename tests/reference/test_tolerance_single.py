"""Samples analysed together in batches against each of them built as a mechanism of its own and analysed alone."""

import numpy as np
import pytest

import mechanisms
import mechanisms_space
import trunnion
from mechanisms_parts import EXAMPLES
from toleranced import alone, sampler, varied
from trunnion.algebra.dual import primal
from trunnion.measures.many import figures_of
from trunnion.measures.measures import coordinate_unit
from trunnion.measures.positions import moved
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import has_useful_work
from trunnion.solve.run import prepare
from trunnion.statistics.distributions import uniforms
from trunnion.studies.tolerance.linear import study

STEPS = 25
DENSE = 5_000  # positions at which a largest deviation is as good as found


def planar(name, **options):
    return lambda: mechanisms.model(mechanisms.MODELS[name](), **options)


def spatial(name):
    return lambda: mechanisms_space.MODELS[name]().data | {"joint_defaults": {"friction": 0.05}}


def example(name):
    def data():
        found = trunnion.read(EXAMPLES / f"{name}.yaml").data()
        plain = {key: value for key, value in found.items() if key not in ("measures", "tolerances", "costs")}
        sizes = found.get("dimensions", {}).items()
        return plain | {"dimensions": {name: str(size).partition("±")[0] for name, size in sizes}}

    return data


CASES = {
    **{name: planar(name) for name in mechanisms.MODELS},
    **{f"{law} friction": planar("slider-crank", friction=mechanisms.law_named(law))
       for law in ("stribeck", "brown-mcphee", "viscous", "dahl", "lugre")},
    **{name: spatial(name) for name in ("RSSR", "RCCC", "RCSC, two drivers", "two loops in one group")},
    "Cardan": mechanisms_space.cardan,
    "lamp": example("spring-balanced-lamp"),
    "Cardan's circles": example("cardan-gears"),
    "press": example("toggle-press"),
    "table": example("swash-plate-pump"),
}  # fmt: skip


def measures_of(run):
    """Of every kind, as far as the mechanism has it."""
    mechanism = run.system.mechanism
    joints, driver = run.system.joints, next(iter(mechanism.drivers))
    turning = [name for name, joint in joints.items() if joint.type == "revolute" and name not in mechanism.drivers]
    sliding = [name for name, joint in joints.items() if joint.type in ("prismatic", "cylindrical")]
    link, point = [one for one in run.system.points if one[0] != mechanism.fixed_link][-1]
    found = [f"{statistic}:effort:{driver}" for statistic in ("maximum", "minimum", "rms", "mean", "largest")]
    found += ["efficiency:cycle"] * has_useful_work(mechanism)
    found += [f"effort:{driver}", f"path_error:{link}.{point}", f"straightness:{link}.{point}"]
    found += [f"rms:path_error:{link}.{point}", f"{link}.{point}.x", f"maximum:{link}.{point}.y"]
    for joint in turning[-1:] + sliding[:1]:
        found += [f"transmission_error:{joint}", f"peak-to-peak:transmission_error:{joint}", f"stroke:{joint}"]
        found += [f"reaction:{joint}", f"maximum:reaction:{joint}", f"mean:reaction:{joint}.x"]
    for joint in turning[:1]:
        found += [f"rotation:{joint}", f"peak-to-peak:rotation:{joint}"]
        if coordinate_unit(run.system, run.values) != "s":  # where a driver dwells, a largest value has no one place
            found += [f"place-of-maximum:rotation:{joint}"]
    return found


@pytest.mark.sample(8)
@pytest.mark.spread(1)
@pytest.mark.parametrize("name", CASES)
def test_batches_against_mechanisms_of_their_own(name):
    """Every kind of measure and statistic: the same figure of each sample, or none for both."""
    mechanism = varied(CASES[name](), most=6 if CASES[name]().get("space") == "spatial" else 12)
    found = study(mechanism, measures_of(prepare(mechanism)))
    batch = sampler(found)
    u = uniforms(11, 0, batch.inputs.dims, 2)
    part = batch.figures(u)
    figures, status = part["figure"], part["status"]
    values = batch.inputs.values(u)
    measures, orders, table = found.measures, found.orders, found.table(STEPS)
    seen, size = 0, float(np.ravel(primal(found.run.system.size(found.run.values)))[0])
    for i in (1,) if mechanism.space == "spatial" else (0, 1):
        run, backs = prepare(alone(mechanism, values, i)), None
        apart = [order.measure for order in orders if not order.against]
        exact = figures_of(run, apart, FrictionMethod())
        for k, measure in enumerate(measures):
            known = orders[k]
            scale = max(abs(known.nominal), np.max(np.abs(table.curves[k]), initial=0.0))
            scale = max(scale, size) if measure.of.against or measure.kind == "path_error" else scale
            if known.against:
                backs = backs or solved(found.run, run)
                least, most = deviations(*backs, found.run, measure)
                own = np.sqrt(np.mean(most**2)) if measure.rule == "rms" else np.max(most) - np.min(least)
                own = own if measure.rule in ("rms", "peak-to-peak") else max(np.max(most), -np.min(least))
                more = np.inf if measure.of.of_forces else 1e-6 * scale  # a jump is moved by less than a step
                assert -1e-5 * scale <= figures[k, i] - own <= more, measure.name
                continue
            own = exact[measure.name]
            if measure.rule.startswith("place"):
                own = own + 2 * np.pi * np.rint((figures[k, i] - own) / (2 * np.pi))
            close = 1e-7 if measure.of_motion else 1e-6
            assert figures[k, i] == pytest.approx(own, rel=close, abs=close * scale + 1e-13, nan_ok=True), measure.name
            seen += np.isfinite(own)
    assert seen > len(measures) / 3
    assert np.all(status < 7)


def solved(nominal, other):
    """Both at many positions."""
    time = nominal.cycle.times(DENSE)
    if nominal.cycle.periodic:  # not at dead centres, where a jump has no value
        time = time + nominal.cycle.duration * 0.37 / DENSE
    one, two = (run.solve(moved(nominal, run.values, time)) for run in (nominal, other))
    return one, two


def deviations(one, two, nominal, measure):
    """Least and largest of what a course is off the nominal one at many positions: of a path its distance, twice."""
    courses = [
        np.array([np.broadcast_to(np.asarray(part, float), DENSE) for part in measure.curve(back)])
        for back in (one, two)
    ]
    change = courses[1] - courses[0]
    if measure.kind == "path_error":
        change = np.sqrt(np.sum(change**2, axis=0))
        return change, change
    if measure.turning(nominal.system):
        change = (change + np.pi) % (2 * np.pi) - np.pi
    return change[0], change[0]


SMOOTH = ("mean", "rms", "maximum", "minimum", "efficiency", "peak-to-peak", "stroke", "straightness")


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    "name", ["four-bar", "class III", "geared five-bar", "Cardan", "lamp", "RCCC", "lugre friction"]
)
def test_derivatives_against_samples(name):
    """∂y/∂p of figures that have a derivative: by dual numbers, and by samples on both sides."""
    mechanism = varied(CASES[name](), most=5)
    wanted = [one for one in measures_of(prepare(mechanism)) if one.startswith(SMOOTH) and "error" not in one]
    if name == "geared five-bar":  # its point runs on a circle, which has no line
        wanted = [one for one in wanted if not one.startswith("straightness")]
    found = study(mechanism, wanted)
    batch = sampler(found)
    count = len(found.inputs.tolerances)
    shares = 0.5 + 1e-3 * np.eye(count)  # a number alone, to either side by a thousandth of its limits
    u = np.concatenate([shares, 1 - shares], axis=1)
    moves = np.array([np.ravel(batch.inputs.values(u)[one.path]) - one.nominal for one in found.inputs.tolerances])
    figures = batch.figures(u)["figure"]
    assert np.max(np.abs(moves)) > 0
    for k, of in enumerate(found.orders):
        for i in range(count):
            width = moves[i, i] - moves[i, count + i]
            slope = (figures[k, i] - figures[k, count + i]) / width
            size = max(np.abs(of.nominal), 1e-3) / abs(found.inputs.tolerances[i].nominal)
            assert of.figure.sensitivity[i] == pytest.approx(slope, rel=1e-4, abs=2e-4 * size), (of.measure.name, i)
