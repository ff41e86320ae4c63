"""The mapping file: strict, with file and line, all that is wrong in one go; units either way round."""

import json

import numpy as np
import pytest

from manual.conftest import program
from measured_data.recording import mapping, off, read, recorded, text_of
from trunnion.errors import MechanismError
from trunnion.model.units import UnitError
from trunnion.rig.reading.mapping import read_mapping
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.units import dimensions, read_amount

__all__ = ["program"]  # a fixture


@pytest.fixture(scope="module")
def columns():
    return recorded(turns=5, noise=0.0)


WRONG = """\
trunnion-data: 1
files:
  - {file: ../run.csv}
  - {file: /etc/passwd.csv, set: {misalignment: 15 dge}}
time: {column: t, unit: mm}
angle: {from: pulses, colum: encoder, per_turn: 60}
channels:
  torque-in:
    column: T1
    measures: efort:input
    unit: V
  b: {column: T1, measures: effort:input, unit: V}
  c: {column: T1, measures: effort:input, unit: V, gain: 0.01 (N m)/mV, range: 3 kg}
  d: {column: T1, measures: effort:input, unit: V, gain: 0.01 (N m)/mV, zero: [1, 2]}
  e: {column: T1, measures: effort:input, unit: N m, sign: 2}
  f: {column: T1, measures: "rate:x", unit: Hz}
  g: {column: T1, measures: effort:input, unit: N m, zero: {over: [2 s, 1 s]}}
  h: {column: T1, measures: effort:input, unit: N m, accuracy: {gain: -1 %}}
  i: {column: T1, measures: "maximum:effort:input", unit: N m}
filter: {cut_off: 50 mHzz}
positions: 1
drift: maybe
"""


def test_everything_at_once_with_its_line(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(WRONG, encoding="utf-8")
    with pytest.raises(MechanismError) as failure:
        read_mapping(path)
    found = {one.line: one for one in failure.value.findings}
    told = {
        4: "'dge' is not known",
        5: "'mm' is not a unit of time",
        6: "'colum' is unknown",
        10: "not a quantity that a sensor measures",
        12: "do not give effort:input in N m or N",
        13: "'3 kg' is neither of the readings (V) nor",
        14: "takes a number",
        15: "not one of 1 or -1",
        16: "readings in 'Hz' do not give rate:x",
        17: "ends before it begins",
        18: "below zero",
        19: "not a quantity that a sensor measures",
        20: "'mHzz' is not known",
        21: "greater than or equal to 2",
        22: "not one of 'report'",
    }
    assert {line: text in found[line].what for line, text in told.items() if line in found} == dict.fromkeys(told, True)
    assert all(one.file == str(path) and one.remedy for one in found.values())
    assert "did you mean 'column'" in found[6].remedy
    assert "did you mean 'effort'" in found[10].remedy
    assert "state the gain, such as 100 mV/(N m)" in found[12].remedy


CHANGES = [
    ({"trunnion-data": 2}, "trunnion-data", "version 2"),
    ({"trunnion-data": None}, "", "'trunnion-data' is missing"),
    ({"channels": {}}, "channels", "at least 1"),
    ({"angle": None}, "", "'angle' is missing"),
    ({"angle": {"from": "pulses", "column": "encoder"}}, "angle", "needs per_turn"),
    ({"angle": {"from": "column", "column": "a", "per_turn": 60}}, "angle", "does not use per_turn"),
    ({"angle": {"from": "time", "speed": 0}}, "angle", "the speed is zero"),
    ({"time": {"column": "t", "rate": "1 kHz"}}, "time", "either a column or a rate"),
    ({"time": {"rate": "0 Hz"}}, "time.rate", "0 Hz is not above zero"),
    ({"set": {"a": {"mean": "speed"}}}, "set.a.mean", "no channel 'speed'"),
    ({"set": {"a": {"mean": "brake", "column": "x"}}}, "set.a.column", "unknown"),
    ({"set": {"a": "2 * AB"}}, "set.a", "'* AB' is not known"),
    ({"cycle": "3 N"}, "cycle", "no angle and no time above zero"),
    ({"cycle": 0}, "cycle", "no angle and no time above zero"),
    ({"cycle": "-1 turn"}, "cycle", "no angle and no time above zero"),
    (
        {"angle": None, "cycle": "0.1 s", "files": [{"file": "a.csv", "angle": {"zero": "2 deg"}}]},
        "files.0.angle",
        "no column gives an angle",
    ),
    ({"channels/brake/measures": "torque:A"}, "channels.brake.measures", "not a quantity that a sensor measures"),
    ({"channels/brake/resolution": 0}, "channels.brake.resolution", "0 is not above zero"),
    ({"channels/brake/gain": 0}, "channels.brake", "the gain is zero"),
    ({"channels/brake/range": "0 N m"}, "channels.brake.range", "0 N m is not above zero"),
    ({"channels/brake/gain": "1,5"}, "channels.brake.gain", "not a number with a unit"),
    ({"channels/brake/unit": 5}, "channels.brake.unit", "is not a unit"),
]


@pytest.mark.parametrize(("changes", "where", "told"), CHANGES, ids=[f"{k}" for k in range(len(CHANGES))])
def test_what_a_mapping_cannot_say(changes, where, told):
    with pytest.raises(MechanismError) as failure:
        read_mapping(mapping(changes))
    assert [one.where for one in failure.value.findings] == [where]
    assert told in failure.value.findings[0].what
    assert failure.value.findings[0].remedy


@pytest.mark.parametrize("name", ["../run.csv", "/run.csv", "a/../../run.csv", "link/run.csv"])
def test_only_files_below_its_folder(tmp_path, name, columns):
    """A mapping is data from a stranger, and so is a link beside it; the command line may name any file."""
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "link").symlink_to(tmp_path)
    path = tmp_path / "inner" / "m.json"
    path.write_text(json.dumps(mapping({"files": [{"file": name}]})), encoding="utf-8")
    read(columns, tmp_path)
    with pytest.raises(MechanismError, match="is not below the folder of the mapping"):
        read_measured(path)


def test_files_of_the_command_line_keep_what_was_set(tmp_path, columns):
    """By the file, else by its name."""
    with pytest.raises(MechanismError, match="no data file is named"):
        read_measured(mapping())
    (tmp_path / "elsewhere").mkdir()
    for name in ("run.csv", "new.csv", "elsewhere/run.csv", "elsewhere/two.csv"):
        (tmp_path / name).write_text(text_of(columns), "utf-8")
    path, files = tmp_path / "m.json", [{"file": "run.csv", "set": {"beta": "15 deg"}}, {"file": "two.csv"}]
    path.write_text(json.dumps(mapping({"files": files, "set": {"gamma": "1 deg"}})), encoding="utf-8")

    def read_(*names):
        return [dict(one.values) for one in read_measured(path, [tmp_path / name for name in names]).conditions]

    beta, gamma = {"beta": pytest.approx(np.radians(15))}, {"gamma": pytest.approx(np.radians(1))}
    for name in ("run.csv", "elsewhere/run.csv"):
        assert read_(name) == [{**gamma, **beta}]
    assert [one.name for one in read_measured(path, [tmp_path / "run.csv"]).conditions] == ["gamma 1 deg, beta 15 deg"]
    assert read_("elsewhere/two.csv", "new.csv") == [gamma] * 2  # nothing is stated of them


UNITS = [
    {"unit": "V", "gain": "100 mV/(N m)"},
    {"unit": "V", "gain": "0.1 V/N/m"},
    {"unit": "V", "gain": "10 N m/V"},
    {"unit": "V", "gain": "0.01 (N m)/mV"},
    {"unit": "kV", "gain": "0.1 kV/(kN m)", "scale": 1},
    {"gain": "10"},
    {"unit": "N m", "gain": 10},
    {"unit": "kN m", "gain": 0.01},
    {"unit": "N mm", "gain": "1e4"},
    {"unit": "V", "gain": "100 mV/Nm", "zero": "50 mV"},
    {"unit": "V", "gain": "100 mV/(N m)", "zero": "0.5 N m"},
    {"unit": "V", "gain": "100 mV/(N m)", "zero": 0.05},
    {"unit": "V", "gain": "-100 mV/(N m)", "sign": -1, "zero": "50 mV"},
]


@pytest.mark.parametrize("stated", UNITS, ids=[str(one) for one in UNITS])
def test_units_and_gains(tmp_path, columns, stated):
    stated = dict(stated)
    changed = dict(columns)
    if stated.pop("scale", None):
        changed["T1"] = changed["T1"] / 1000  # kV; 0.1 kV/(kN m) is 0.1 V/(N m)
    channel = {"column": "T1", "measures": "effort:input", "zero": {"over": ["0 s", "0.19 s"]}, **stated}
    found = read(changed, tmp_path, {"channels/torque-in": channel})
    assert found.conditions[0].courses["torque-in"].unit == "N m"
    assert off(found.conditions[0]) < 0.05


def test_units_of_the_file(tmp_path, columns):
    """The mapping's unit is taken; one of the file serves where it has none; where both differ it is told."""
    named = {("n1 [rpm]" if name == "n1" else name): values for name, values in columns.items()}
    one = read(named, tmp_path, {"channels/speed-in/unit": None})
    assert np.nanmean(one.conditions[0].courses["speed-in"].mean) == pytest.approx(20 * np.pi, rel=1e-4)
    assert one.findings == ()
    other = read(named, tmp_path, {"channels/speed-in/unit": "deg/s"})
    assert "the file has the unit 'rpm' for 'n1', the mapping 'deg/s'" in other.findings[0].what
    bare = read(columns, tmp_path, {"channels/brake/unit": None})
    assert "SI is assumed (N m)" in bare.findings[0].what
    volts = {("n1 [V]" if name == "n1" else name): values for name, values in columns.items()}
    with pytest.raises(MechanismError, match="readings in 'V' do not give rate:input"):
        read(volts, tmp_path, {"channels/speed-in/unit": None})


@pytest.mark.parametrize("stated", [{"range": "20 N m"}, {"accuracy": {"zero": "2 N m"}}, {"resolution": "1 N m"}])
@pytest.mark.parametrize("unit", [None, "N"])
def test_an_amount_in_another_unit_than_its_column_is_refused(tmp_path, columns, stated, unit):
    """Whether in the file or in the mapping the unit stands; of two files it is told once."""
    named = {("T2 [N]" if name == "T2" else name): values for name, values in columns.items()}
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for file in files:
        file.write_text(text_of(named), "utf-8")
    changes = {f"channels/brake/{key}": value for key, value in {**stated, "unit": unit}.items()}
    with pytest.raises(MechanismError, match=r"N m' is neither of the readings \(N\) nor of what they") as failure:
        read_measured(mapping(changes), files)
    (one,) = failure.value.findings
    assert ("2 such findings: a.csv, b.csv" in one.what) == (unit is None)


def test_schema(program):
    """The JSON Schema takes a mapping that the program takes, and has its keys."""
    jsonschema = pytest.importorskip("jsonschema")
    code, text, _ = program("schema", "--of", "data")
    assert code == 0
    schema = json.loads(text)
    jsonschema.validate(mapping({"filter": {"cut_off": "50 Hz"}, "set": {"a": {"mean": "brake"}, "b": "3 N"}}), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(mapping({"filtre": {"cut_off": "50 Hz"}}), schema)
    assert schema["required"] == ["trunnion-data", "channels"]


SHEETS = {"1 V/(1000 rpm)": "1 mV/rpm", "20 mA/(100 N m)": "0.2 mA/(N m)", "10 V / (50 mm)": "0.2 V/mm",
          "-5 V/(2e3 N)": "-2.5 mV/N"}  # fmt: skip


@pytest.mark.parametrize("text", SHEETS)
def test_gains_as_data_sheets_have_them(text):
    first, second = read_amount(text), read_amount(SHEETS[text])
    assert first.value == pytest.approx(second.value, rel=1e-12)
    assert first.dimensions == second.dimensions
    with pytest.raises(UnitError):
        read_amount("1 V/(0 rpm)")


@pytest.mark.parametrize("text", ["ft-lb", "ft lb", "lb-ft", "lbf-ft", "ft·lbf", "ft-lbs", "lb ft", "ft.lb", "ftlb"])
def test_pound_feet_as_they_are_written(text):
    factor, exponents = dimensions(text)
    assert (factor, exponents) == (pytest.approx(1.3558179483314003), dimensions("N m")[1])
