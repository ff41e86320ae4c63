"""The motion in time as a unit for co-simulation: what it gives is what `simulate` gives."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from trunnion.dynamics.simulate import Continued, simulate
from trunnion.errors import MechanismError
from trunnion.exchange import export_model
from trunnion.model.mechanism import Mechanism, read_mechanism

fmpy = pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu3")

EXAMPLES = Path(__file__).parents[2] / "examples"
MODEL = """
trunnion: 1
name: Four-bar
space: planar
gravity: [0, -9.81 m/s^2]
dimensions: {r: 60 mm, twice: r * 2}
links:
  frame: {points: {O: [0, 0], C: [200 mm, 0]}}
  crank: {points: {O: [0, 0], A: [r, 0]}, mass: 0.4 kg, centre: [30 mm, 0], inertia: 2e-4 kg m^2}
  rod: {points: {A: [0, 0], B: [180 mm, 0]}, mass: 0.5 kg, centre: [90 mm, 0], inertia: 1e-3 kg m^2}
  rocker: {points: {C: [0, 0], B: [150 mm, 0], T: [100 mm, 0]}, mass: 0.6 kg, centre: [75 mm, 0], inertia: 1e-3 kg m^2}
ground: frame
joints:
  O: {type: revolute, links: [frame, crank]}
  A: {type: revolute, links: [crank, rod]}
  B: {type: revolute, links: [rod, rocker]}
  C: {type: revolute, links: [frame, rocker]}
drivers: {O: {speed: 60 rpm, start: 40 deg, free: true, initial: {speed: 20 rad/s}}}
loads: {pull: {link: rocker, at: T, force: [3 N, 0]}}
assembly: {B: [150 mm, 140 mm]}
"""


@pytest.fixture(scope="module")
def four_bar(tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / "model.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return read_mechanism(path)


@pytest.fixture(scope="module")
def unit(four_bar, tmp_path_factory):
    """The class that runs in the unit, over a folder with the model."""
    from trunnion.exchange.fmu import MODEL as NAME
    from trunnion.exchange.fmu import Linkage

    folder = tmp_path_factory.mktemp("unit")
    four_bar.write(folder / NAME)
    return SimpleNamespace(make=lambda: Linkage(instance_name="one", resources=str(folder)), folder=folder)


def run(unit, times, inputs=None, **parameters):
    """Outputs at times, stepped by hand. inputs: by the time at which a step begins."""
    slave, rows = unit.make(), []
    slave.setup_experiment(0.0)
    slave.values.update({path.replace("__", "."): value for path, value in parameters.items()})
    slave.values.update(inputs(0.0) if inputs else {})
    slave.exit_initialization_mode()
    rows.append(dict(slave.values))
    for begin, end in pairwise(times):
        slave.values.update(inputs(begin) if inputs else {})
        assert slave.do_step(begin, end - begin).status == 0
        rows.append(dict(slave.values))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def agrees(found, wanted, rows=slice(None), within=1e-6):
    """Coordinate, rate and reactions are those of `simulate`."""
    close(found["O.coordinate"][rows], wanted["drive_coordinate"].values[0][rows], within)
    close(found["O.rate"][rows], wanted["drive_rate"].values[0][rows], within)
    for joint in wanted["joint"].values:
        for axis in "xy":
            reaction = wanted["reaction_force"].sel(joint=joint, axis=axis).values
            close(found[f"{joint}.reaction_force_{axis}"][rows], reaction[rows], within)


ROUNDING = 1e-12  # N or N m: of a force that is 0 in the press nothing else is left


def close(found, wanted, within):
    assert np.max(np.abs(found - wanted)) <= within * np.max(np.abs(wanted)) + ROUNDING


@pytest.mark.parametrize(
    ("name", "duration"),
    [
        ("", 0.1),
        pytest.param("flywheel-press", 0.1, marks=pytest.mark.slow),
        pytest.param("andrews-squeezer-in-time", 0.03, marks=pytest.mark.slow),
    ],
)
def test_a_unit_passes_its_validation_and_gives_what_simulate_gives(name, duration, four_bar, tmp_path):
    from fmpy.validation import validate_fmu

    mechanism = read_mechanism(EXAMPLES / f"{name}.yaml") if name else four_bar
    path, steps = tmp_path / "unit.fmu", 10
    (finding,) = export_model(mechanism, path)
    assert finding.code == "exchange.fmu_needs"
    assert validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    outputs = [variable.name for variable in description.modelVariables if variable.causality == "output"]
    rows = fmpy.simulate_fmu(str(path), stop_time=duration, output_interval=duration / steps, output=outputs)
    found = {key: np.asarray(rows[key]) for key in outputs}
    wanted = simulate(mechanism, duration, steps)
    agrees(found, wanted)
    if name:  # else nothing drives it
        close(found["O.effort"][1:], wanted["drive_effort"].values[0][1:], 1e-6)


def test_steps_of_any_length_give_the_motion_of_simulate(unit, four_bar):
    wanted = simulate(four_bar, 0.3, 30)
    times = np.linspace(0.0, 0.3, 31)
    agrees(run(unit, times), wanted)
    uneven = np.unique([*times[::7], *times[::5]])
    rows = np.searchsorted(times, uneven - 1e-9)
    close(run(unit, uneven)["O.coordinate"], wanted["drive_coordinate"].values[0][rows], 1e-6)


def test_an_effort_from_outside_acts_like_a_motor(unit, four_bar):
    data = four_bar.data()
    data["drivers"]["O"].pop("free")
    data["drivers"]["O"]["motor"] = {"kind": "constant", "effort": "0.8 N m", "off_from": "0.2 s"}
    wanted = simulate(Mechanism(**data), 0.4, 20)
    times = np.linspace(0.0, 0.4, 21)
    found = run(unit, times, lambda begin: {"drivers.O.applied": 0.8 if begin < 0.2 - 1e-9 else 0.0})
    agrees(found, wanted, np.flatnonzero(abs(times - 0.2) > 1e-9))  # there the effort jumps


def test_loads_and_parameters_are_taken_over(unit, four_bar):
    changed = four_bar.with_values({"loads.pull.force.x": -2.0, "dimensions.r": 0.05, "drivers.O.initial.speed": 15.0})
    times = np.linspace(0.0, 0.3, 31)
    others = {"dimensions__r": 0.05, "drivers__O__initial__speed": 15.0}
    agrees(run(unit, times, lambda _: {"loads.pull.force.x": -2.0}, **others), simulate(changed, 0.3, 30))
    assert set(unit.make().parameters) == {"dimensions.r", "drivers.O.initial.speed"}  # not what follows from others


def test_it_asks_for_the_end_where_the_motion_ends(unit, four_bar, tmp_path):
    from trunnion.exchange.fmu import Linkage

    data = four_bar.data()
    data["drivers"]["O"]["range"] = ["0 deg", "90 deg"]
    Mechanism(**data).write(tmp_path / "model.yaml")
    slave = Linkage(instance_name="one", resources=str(tmp_path))
    slave.exit_initialization_mode()
    ends = [slave.do_step(0.05 * k, 0.05).terminateSimulation for k in range(4)]
    assert ends == [False, True, True, True]
    assert slave.values["O.coordinate"] == pytest.approx(np.pi / 2, abs=1e-9)
    assert "end of its stated range" in slave.log_queue[0].msg
    slave.values["drivers.O.applied"] = np.nan
    assert slave.do_step(0.2, 0.05).status == 3


def test_names_are_those_that_the_standard_allows(tmp_path):
    from fmpy.validation import validate_fmu

    (tmp_path / "odd.yaml").write_text(MODEL.replace("C: ", '"1 Gelenk-ö": '), encoding="utf-8")
    odd = read_mechanism(tmp_path / "odd.yaml")
    export_model(odd, tmp_path / "odd.fmu")
    assert validate_fmu(str(tmp_path / "odd.fmu")) == []
    names = [variable.name for variable in fmpy.read_model_description(str(tmp_path / "odd.fmu")).modelVariables]
    assert "_1_Gelenk__.reaction_force_x" in names


@pytest.mark.parametrize("name", ["four-bar", "slider-crank-with-play"])
def test_what_cannot_be_let_move_is_refused(name, four_bar, tmp_path):
    data = four_bar.data()
    if name == "four-bar":
        data["drivers"]["O"] = {"speed": "60 rpm"}
    else:
        data["joints"]["B"] |= {
            "pin": {"radius": "5 mm", "clearance": "0.1 mm"},
            "contact": {"law": "lankarani-nikravesh", "stiffness": 1e9, "restitution": 0.8},
        }
    with pytest.raises(MechanismError) as error:
        export_model(Mechanism(**data), tmp_path / "unit.fmu")
    assert len(error.value.findings) == 1
    assert not (tmp_path / "unit.fmu").exists()


@pytest.mark.slow
def test_a_motion_goes_on_while_it_rests_and_sticks():
    mechanism = read_mechanism(EXAMPLES / "stick-slip-drive.yaml")
    wanted, motion = simulate(mechanism, 0.2, 4), Continued(mechanism)
    rows = [motion.advance(0.05 * k).at.q[0, 0] for k in range(1, 5)]
    assert np.max(np.abs(rows - wanted["drive_coordinate"].values[0][1:])) < 1e-12
