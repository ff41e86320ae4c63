"""The virtual rig: true courses through sensors, files that are read as they were meant, findings."""

from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.errors import MechanismError, Severity
from trunnion.rig.reading.measurement import efficiency_of
from trunnion.rig.virtual.rig_file import Rig
from trunnion.solve.run import prepare

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FOUR_BAR = EXAMPLES / "toleranced-fourbar.yaml"
SENSORS = {
    "T1": {"measures": "effort:A", "range": "10 N m", "noise": "10 mN m", "bits": 14, "offset": "0.1 N m",
           "accuracy": {"gain": "0.5 %", "zero": "20 mN m"}},
    "T2": {"measures": "load:work", "range": "10 N m", "noise": "10 mN m", "bits": 14, "offset": "0.1 N m",
           "accuracy": {"gain": "0.5 %", "zero": "20 mN m"}},
    "n1": {"measures": "rate:A", "unit": "rpm", "noise": "0.2 rpm"},
    "w2": {"measures": "rate:D", "noise": "0.02 rad/s"},
}  # fmt: skip


@pytest.fixture(scope="module")
def mechanism():
    return trunnion.read(FOUR_BAR)


def rig(**changes):
    stated = {
        "trunnion-rig": 1,
        "schedule": {"over": {"AB": ["1"]}, "turns": 6, "idle": "0.2 s"},
        "rate": "500 Hz",
        "encoder": {"per_turn": 90},
        "sensors": SENSORS,
    }
    stated["schedule"] = {"turns": 6, "idle": "0.2 s"}
    return Rig(**(stated | changes))


@pytest.fixture(scope="module")
def seen(mechanism):
    return trunnion.rig.observe(mechanism, rig(), seed=4)


def test_perfect_sensors_show_the_model(mechanism):
    """Each reading is the model at the instant of its sample; idle forces and speeds are 0, places stay."""
    sensors = {
        "T": {"measures": "effort:A"},
        "n": {"measures": "rate:D"},
        "x": {"measures": "coupler.C.x"},
        "R": {"measures": "reaction:B"},
    }
    found = trunnion.rig.observe(mechanism, rig(sensors=sensors))
    (case,) = found.cases
    (record,) = found.records()
    run = prepare(mechanism)
    time = (np.arange(case.running) - case.lead) / 500.0
    back = run.solve(time)
    part = slice(case.before, case.rows)
    assert record.columns["T"][part] == pytest.approx(np.broadcast_to(back.efforts["A"], time.shape), abs=1e-8)
    place = back.walk.point("coupler", "C").place[0]
    assert record.columns["x"][part] == pytest.approx(place, abs=1e-8)
    assert np.all(record.columns["x"][: part.start] == record.columns["x"][part.start])
    for name in ("T", "n", "R"):
        assert not np.any(record.columns[name][: part.start])
    angle = (np.arange(case.running) - case.lead) / 500.0 * float(run.values["drivers.A.speed"])
    assert np.array_equal(record.columns["encoder"][part], np.floor(angle * 90 / (2 * np.pi) + 1e-9))
    assert record.columns["t"][1] == 0.002
    result = trunnion.analyse(mechanism, 720)
    assert case.efficiency == pytest.approx(float(result["efficiency"]), rel=1e-9)


def test_same_seed_same_bits_and_sensors_of_their_own(mechanism, seen):
    record, again = next(seen.records()), next(trunnion.rig.observe(mechanism, rig(), seed=4).records())
    for name, values in record.columns.items():
        assert np.array_equal(values, again.columns[name])
    fewer = trunnion.rig.observe(mechanism, rig(sensors={"T2": SENSORS["T2"]}), seed=4)
    assert np.array_equal(next(fewer.records()).columns["T2"], record.columns["T2"])
    other = next(seen.seeded(5).records())
    assert not np.array_equal(other.columns["T1"], record.columns["T1"])
    assert np.array_equal(other.columns["encoder"], record.columns["encoder"])
    with pytest.raises(MechanismError, match="seed"):
        seen.seeded(-1)


def test_noise_and_offset_are_as_stated(seen):
    (case,), record = seen.cases, next(seen.records())
    idle = record.columns["T1"][: case.before]
    assert np.mean(idle) == pytest.approx(seen.drawn["T1"].offset, abs=4 * 0.01 / case.before**0.5)
    assert np.std(idle) == pytest.approx(0.01, rel=0.2)
    i = list(seen.channels).index("T1")
    drawn = seen.drawn["T1"]
    meant = case.true[i] * (1 + drawn.gain) + drawn.zero + drawn.offset
    error = record.columns["T1"][case.before :] - meant
    assert np.std(error) == pytest.approx(0.01, rel=0.1)
    assert np.mean(error) == pytest.approx(0.0, abs=4 * 0.01 / len(error) ** 0.5)


def test_efficiency_covers_the_true_one(seen):
    """Over 200 rigs with the same statement of accuracy, η ± 2 u has the model's in about 95 %."""
    deviations = []
    for seed in range(200):
        (condition,) = seen.seeded(seed).measurement(125).conditions
        found = efficiency_of(condition)
        deviations.append((found.value - seen.cases[0].efficiency) / found.uncertainty)
    assert np.std(deviations) == pytest.approx(1.0, abs=0.15)
    assert np.mean(np.abs(deviations) < 2) == pytest.approx(0.95, abs=0.045)


@pytest.mark.parametrize("form", ["csv", "parquet", "tdms"])
def test_files_are_read_as_they_were_meant(seen, form, tmp_path):
    """The mapping reads the files; courses are those that the rig hands on itself, the same in all formats."""
    pytest.importorskip({"csv": "pandas", "parquet": "pyarrow", "tdms": "nptdms"}[form])
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.reading.tables import read_table

    names = seen.write(tmp_path, form)
    assert names == [f"run-01.{form}", "mapping.yaml", "truth.yaml"]
    record = next(seen.records())
    table = read_table(tmp_path / names[0], list(record.columns))
    for name, values in record.columns.items():
        assert np.array_equal(table.columns[name].values, values), name
        assert table.columns[name].unit == seen.units.get(name, "")
    found = read_measured(tmp_path / "mapping.yaml")
    told = [one.what for one in found.findings if one.severity is not Severity.NOTE]
    assert not [one for one in told if "spikes" not in one]  # a corner of the torque may look like one
    (condition,) = found.conditions
    (direct,) = seen.measurement(len(condition.phase)).conditions
    assert condition.courses["T1"].turns.shape[0] == 6
    for name in ("T1", "n1", "w2"):
        error = condition.courses[name].mean - direct.courses[name].mean
        assert np.quantile(np.abs(error), 0.9) < 0.02 * np.ptp(direct.courses[name].mean) + 0.02, name
    own = efficiency_of(condition)
    assert own.value == pytest.approx(efficiency_of(direct).value, abs=0.1 * own.uncertainty)


@pytest.mark.parametrize("name", ["T, in", "T; in", 'T "in"', "#T", "T [a]", "'T'", "Drehmoment ä"])
def test_names_with_separators_are_read_back(mechanism, name, tmp_path):
    changes = {"sensors": {name: SENSORS["T1"], "n1": SENSORS["n1"]}}
    trunnion.rig.observe(mechanism, rig(**changes)).write(tmp_path)
    read = trunnion.rig.read(tmp_path / "mapping.yaml")
    assert set(read.conditions[0].courses) == {name, "n1"}


@pytest.mark.parametrize("speed", ["60 rpm", "-60 rpm"])
def test_an_index_is_at_coordinate_0_whichever_way_the_shaft_turns(mechanism, speed, tmp_path):
    changes = {"encoder": {"per_turn": 90, "index": "z"}, "set": {"A.speed": speed}, "rate": "5 kHz"}
    seen = trunnion.rig.observe(mechanism, rig(sensors={"x": {"measures": "coupler.C.x"}}, **changes))
    seen.write(tmp_path)
    course = trunnion.rig.read(tmp_path / "mapping.yaml").conditions[0].courses["x"].mean
    true = seen.measurement(len(course)).conditions[0].courses["x"].mean
    assert course == pytest.approx(true, abs=1e-4 * np.ptp(true))


def test_a_load_at_rest_reads_nothing(tmp_path):
    """The strip of the press rests two thirds of the cycle: no cell is empty, the course is read back."""
    press = trunnion.read(EXAMPLES / "indexing-press.yaml")
    sensors = {"T": {"measures": "effort:R"}, "v": {"measures": "rate:R"}, "L": {"measures": "load:strip"},
               "vF": {"measures": "rate:F"}}  # fmt: skip
    seen = trunnion.rig.observe(press, rig(sensors=sensors, encoder=None, schedule={"turns": 5}, rate="200 Hz"))
    (case,) = seen.cases
    load, speed = case.true[2], case.true[3]
    assert np.isfinite(load).all()
    assert np.count_nonzero(speed == 0) > 0.3 * len(speed)
    assert not np.any(load[speed == 0])
    assert np.abs(load[np.abs(speed) > 1e-3]) == pytest.approx(30)
    seen.write(tmp_path)
    rows = (tmp_path / "run-01.csv").read_text("utf-8")
    assert ",," not in rows
    assert ",\n" not in rows
    read = trunnion.rig.read(tmp_path / "mapping.yaml")
    assert not [one for one in read.findings if "dropouts" in one.what]


def test_grid_and_rows(mechanism):
    over = {"work.resisting_torque": "2 N m:6 N m:3", "A.speed": ["60 rpm", "120 rpm"]}
    found = trunnion.rig.observe(mechanism, rig(schedule={"over": over, "turns": 1}))
    assert [dict(case.settings) for case in found.cases][:3] == [
        {"work.resisting_torque": "2 N m", "A.speed": "60 rpm"},
        {"work.resisting_torque": "2 N m", "A.speed": "120 rpm"},
        {"work.resisting_torque": "4 N m", "A.speed": "60 rpm"},
    ]
    assert [case.name for case in found.cases] == [f"run-0{k}" for k in range(1, 7)]
    torque = list(found.channels).index("T2")
    assert np.max(found.cases[4].true[torque]) == pytest.approx(6.0)
    (condition, *_) = found.measurement(36).conditions
    assert condition.values == pytest.approx({"work.resisting_torque": 2.0, "A.speed": 2 * np.pi})
    assert condition.speed == pytest.approx(2 * np.pi)
    files = found.mapping()["files"]
    assert files[1] == {"file": "run-02.csv", "set": {"work.resisting_torque": "2 N m", "A.speed": "120 rpm"}}


def test_conditions_that_lock_are_left_out_and_told(mechanism):
    rows = [{"joint_defaults.friction.coefficient": 0.1}, {"l2": "80 mm"}, {"l2": "85 mm"}]
    rows[0] = {"work.resisting_torque": "5 N m"}
    found = trunnion.rig.observe(mechanism, rig(schedule={"conditions": rows, "turns": 2}))
    assert found.skipped == (2, 3)
    assert [case.number for case in found.cases] == [1]
    (finding,) = [one for one in found.findings if one.severity is Severity.WARNING]
    assert "condition 2 (l2 = 80 mm) and 1 other left out: cannot be assembled" in finding.what
    assert finding.where == "schedule.conditions"
    assert not any(np.isnan(values).any() for values in next(found.records()).columns.values())
    assert found.truth()["left_out"] == [2, 3]
    with pytest.raises(MechanismError, match="none of the 2 conditions can be measured"):
        trunnion.rig.observe(mechanism, rig(schedule={"conditions": rows[1:], "turns": 2}))


@pytest.mark.parametrize(
    ("changes", "where", "what"),
    [
        ({"sensors": {"a": {"measures": "effort:Q"}}}, "sensors.a.measures", "Q"),
        ({"sensors": {"a": {"measures": "efficiency:cycle"}}}, "sensors.a.measures", "as a sensor shows it"),
        ({"sensors": {"a": {"measures": "rate:D", "per_turn": 60}}}, "sensors.a.per_turn", "changes its sign"),
        ({"schedule": {"conditions": [{"speeed": 1}]}}, "schedule.conditions.0", "speeed"),
        ({"schedule": {"over": {"A.speed": ["60 rpm", "90 rpm"]}}, "encoder": None,
          "sensors": {"a": {"measures": "effort:A"}}}, "encoder", "nothing measures the angle of A"),
        ({"schedule": {"over": {"A.speed": ["-60 rpm", "60 rpm"]}}}, "encoder", "turn in both directions"),
        ({"set": {"l7": 2}}, "set", "l7"),
        ({"rate": "0.4 Hz", "schedule": {"turns": 1}}, "rate", "no three samples"),
        ({"rate": "300 MHz"}, "rate", "rows, a file at most"),
    ],
)  # fmt: skip
def test_rigs_that_do_not_fit_the_mechanism(mechanism, changes, where, what):
    changes = {"encoder": None} | changes
    with pytest.raises(MechanismError) as error:
        trunnion.rig.observe(mechanism, rig(**changes))
    found = [one for one in error.value.findings if one.where == where]
    assert found, error.value
    assert what in str(found[0])
    assert found[0].remedy


def test_a_range_is_run_through_once():
    """A driver that ends elsewhere than it starts; its time tells the position."""
    mechanism = trunnion.read(EXAMPLES / "inverted-slider-crank.yaml")
    driver = next(iter(mechanism.drivers))
    sensors = {"e": {"measures": f"effort:{driver}"}}
    stated = rig(sensors=sensors, encoder=None, rate="20 Hz")
    with pytest.raises(MechanismError, match="state turns: 1"):
        trunnion.rig.observe(mechanism, stated)
    stated = rig(sensors=sensors, encoder=None, rate="20 Hz", schedule={"turns": 1, "idle": "1 s"})
    found = trunnion.rig.observe(mechanism, stated)
    mapping = found.mapping()
    assert "angle" not in mapping
    record = next(found.records())
    assert record.columns["t"][found.cases[0].before] == 0.0
    assert mapping["channels"]["e"]["zero"]["over"][0] == "-1 s"


def test_clipped_readings_are_told(mechanism):
    sensors = SENSORS | {"T1": SENSORS["T1"] | {"range": "1 N m"}}
    found = trunnion.rig.observe(mechanism, rig(sensors=sensors))
    told = {one.where: one.what for one in found.findings}
    assert "readings are clipped" in told["sensors.T1.range"]
    assert np.max(np.abs(next(found.records()).columns["T1"])) <= 1.0
