"""Points of drivers and tables from CSV files, given beside a model or named in it: what is read, what is refused."""

import json
import os
import time
from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion import Mechanism, MechanismError
from trunnion.model.csv_table import MAX_BYTES, MAX_OWN_ROWS, MAX_ROWS, MOST_FILES
from trunnion.model.mechanism import read_mechanism
from trunnion.model.rewrite import rewrite_mechanism

SLIDER_CRANK = Path(__file__).resolve().parents[2] / "examples" / "slider-crank.yaml"  # driver O, table pressure
MODEL = read_mechanism(SLIDER_CRANK)


def csv(tmp_path, text, name="points.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def points(mechanism, name="O"):
    """The points of a driver in SI."""
    values = mechanism.parameters()
    rows = range(len(mechanism.drivers[name].points or ()))
    return [(values[f"drivers.{name}.points.{k}.time"], values[f"drivers.{name}.points.{k}.coordinate"]) for k in rows]


def refused(read, folder):
    """The findings without the folder."""
    with pytest.raises(MechanismError) as caught:
        read()
    return [str(finding).replace(f"{folder}{os.sep}", "") for finding in caught.value.findings]


# what is read
DEGREE = np.pi / 180


@pytest.mark.parametrize(
    "text",
    [
        "time [ms], angle [deg]\n0,0\n50,12.5\n100,90\n",
        "time [ms]; angle [deg]\n0;0\n50; 12,5\n1e2;90\n",
        "time (ms); angle in deg\n0;0\n50; 12,5\n1e2;90\n",
        "time [ms]\tangle [deg]\r\n0\t0\r\n50\t12,5\r\n100\t90.0\r\n",
        '\ufeff"time [ms]";"angle, of the crank [°]"\n# measured\n\n0;0;\n50;12.5\n100;+90\n',
        f"0,0\n0.05,{12.5 * DEGREE!r}\n.1,{90 * DEGREE!r}\n",
        f"t, q [rad]\n0,0\n0.05,{12.5 * DEGREE!r}\n0.1,{90 * DEGREE!r}",
    ],
)
def test_separators_headers_units_and_decimal_commas(text, tmp_path):
    found = points(MODEL.with_table("O", csv(tmp_path, text)))
    np.testing.assert_allclose(found, [(0, 0), (0.05, 12.5 * DEGREE), (0.1, 90 * DEGREE)], rtol=1e-15)


def test_units_are_converted_exactly_and_kept(tmp_path):
    mechanism = MODEL.with_table("O", csv(tmp_path, "t [ms];q [deg]\n0;0\n93,782;-5\n"))
    assert points(mechanism)[1][0] == 0.093782
    assert mechanism.data()["drivers"]["O"] == {"law": "table", "points": [["0 ms", "0 deg"], ["93.782 ms", "-5 deg"]]}
    assert Mechanism(**mechanism.data()) == mechanism


def test_a_model_may_leave_the_points_to_the_file(tmp_path):
    """And a file given beside a model goes before the one that it names."""
    text = SLIDER_CRANK.read_text("utf-8")
    path = tmp_path / "model.yaml"
    path.write_text(text.replace("O: {speed: 1450 rpm}", "O: {law: table, ends: natural}"), encoding="utf-8")
    with pytest.raises(MechanismError, match="'points' is missing — add points or file"):
        read_mechanism(path)
    mechanism = read_mechanism(path, {"O": csv(tmp_path, "0,0\n1,2\n")})
    assert mechanism.drivers["O"].ends == "natural"
    assert len(points(mechanism)) == 2
    other = csv(tmp_path, CSV.replace("2.5", "2.6"), "other.csv")
    named = read_mechanism(written(tmp_path, points=None), {"pressure": str(other)})
    assert named.parameters()["tables.pressure.points.1.value"] == pytest.approx(2.6e5)


# what is refused
BAD = [
    ("", ["points.csv:1: error: is empty — write a row for each point"]),
    ("# only\n\n", ["points.csv: error: has no rows, a table from 2 to 10000"]),
    ("time, angle\n", ["points.csv:1: error: has no rows of numbers, a table needs two"]),
    ("time, angle\n0,0\n", ["points.csv:2: error: has 1 row of numbers, a table needs two"]),
    ("0 0\n1 1\n", ["points.csv:1: error: has 1 column, a table has 2 — write time"]),
    ("0,0,1,5\n1,0,2,5\n", ["points.csv:1: error: has 4 columns, a table has 2 — write time or drive coordinate"]),
    ("t [-Infinity];q\n0;0\n1;1\n", ["points.csv:1: error: t [-Infinity]: the unit '-Infinity' is not known"]),
    ("0;0\n1;x\n", ["points.csv:2: error: 'x' is not a finite number — write a number"]),
    ("0;0\n1;nan\n2;inf\n3;1e999\n4;1_0\n", [f"points.csv:{k}: error: '{cell}' is not a finite number"
                                           for k, cell in ((2, "nan"), (3, "inf"), (4, "1e999"), (5, "1_0"))]),
    ("0;0\n;2\n3\n4;5;6\n", ["points.csv:2: error: a number is missing", "points.csv:3: error: has 1 cell, the rows",
                            "points.csv:4: error: has 3 cells"]),
    ("0;1.234,5\n1;0\n", ["points.csv:1: error: '1.234,5' is not a finite number"]),
    ("t;q\n0;0\n2;1\n1;2\n", ["points.csv:4: error: drivers.O.points.2: its time 1 does not come after 2"]),
    ("1;0\n2;1\n", ["points.csv:1: error: drivers.O.points.0: the table begins at 1 s"]),
    ("t [mm];q [N]\n0;1\n2;1\n", ["points.csv:1: error: t [mm]: its unit is that of a length, the column is of time",
                                 "points.csv:1: error: q [N]: its unit is that of a force, the column is of angle"]),
    ("t [mss];q\n0;1\n2;1\n", ["points.csv:1: error: t [mss]: the unit 'mss' is not known"]),
    ("t (mm);q\n0;1\n2;1\n", ["points.csv:1: error: t (mm): its unit is that of a length, the column is of time"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), BAD)
def test_one_finding_for_each_problem(text, expected, tmp_path):
    found = refused(lambda: MODEL.with_table("O", csv(tmp_path, text)), tmp_path)
    assert len(found) == len(expected), found
    for line, start in zip(found, expected, strict=True):
        assert line.startswith(start), line


def test_what_is_no_text_or_not_there(tmp_path):
    (tmp_path / "latin.csv").write_bytes(b"t,\xb0\n0,1\n")
    for name, file, what in (
        ("O", "absent.csv", "cannot be read: No such file"), ("O", ".", "it is not a file"),
        ("O", "latin.csv", "latin.csv:1: error: is not UTF-8 text (byte 2)"),
        ("presure", "latin.csv", "there is no driver or table 'presure' — did you mean 'pressure'"),
    ):  # fmt: skip
        assert what in refused(lambda name=name, file=file: MODEL.with_table(name, tmp_path / file), tmp_path)[0]


SOURCE = SLIDER_CRANK.read_text("utf-8")
INLINE = SOURCE[SOURCE.index("             points:") : SOURCE.index("loads:")]
POINTS = read_mechanism(SLIDER_CRANK).tables["pressure"].points
CSV = "angle [deg];pressure [bar]\n" + "".join(
    f"{str(place.source).removesuffix(' deg')};{str(value.source).removesuffix(' bar')}\n" for place, value in POINTS
)


def written(folder, stated="file: gas.csv", points=CSV, name="model.yaml"):
    """The example with its table in a file, or stated otherwise."""
    path = folder / name
    path.write_text(SOURCE.replace(INLINE, f"             {stated}}}\n"), encoding="utf-8")
    if points is not None:
        (folder / "gas.csv").write_text(points, encoding="utf-8")
    return path


def refused_model(path):
    return refused(lambda: read_mechanism(path), path.parent)


# what is read
def test_the_model_is_the_one_with_the_points_in_it(tmp_path):
    """Equal, with the same hash and the same results; another content is another model."""
    found, meant = read_mechanism(written(tmp_path)), read_mechanism(SLIDER_CRANK)
    assert found == meant
    assert found.digest == meant.digest
    one, two = (trunnion.analyse(each, 24) for each in (found, meant))
    np.testing.assert_array_equal(one["drive_effort"], two["drive_effort"])
    assert one.attrs["model_hash"] == two.attrs["model_hash"]
    (tmp_path / "gas.csv").write_text(CSV.replace("2.5", "2.6"), encoding="utf-8")
    assert read_mechanism(tmp_path / "model.yaml").digest != meant.digest


def test_the_folder_is_that_of_the_model_wherever_one_stands(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    written(tmp_path / "a")
    (tmp_path / "b" / "linked.yaml").symlink_to(tmp_path / "a" / "model.yaml")
    monkeypatch.chdir(tmp_path / "b")
    (tmp_path / "a" / "link.csv").symlink_to("gas.csv")  # a link that stays in the folder
    written(tmp_path / "a", "file: link.csv", name="other.yaml")
    data = {**read_mechanism(SLIDER_CRANK).data(), "tables": {"pressure": {"periodic": True, "file": "gas.csv"}}}
    (tmp_path / "a" / "model.json").write_text(json.dumps(data), encoding="utf-8")
    for path in ("../a/model.yaml", "linked.yaml", "../a/other.yaml", "../a/model.json"):
        assert read_mechanism(path).tables["pressure"].points == POINTS


def test_a_rewritten_model_goes_on_to_name_its_file(tmp_path):
    """Beside it as it was; elsewhere, or with other points, with these in it. Comments stay."""
    path = written(tmp_path)
    mechanism = read_mechanism(path).with_values({"r": "36 mm"})
    (tmp_path / "other").mkdir()
    for target, named in (("new.yaml", True), ("other/new.yaml", False)):
        rewrite_mechanism(mechanism, path, tmp_path / target)
        text = (tmp_path / target).read_text("utf-8")
        assert read_mechanism(tmp_path / target) == mechanism
        assert ("gas.csv" in text) is named
        assert text.startswith("# A small air compressor")
    changed = mechanism.with_values({"tables.pressure.points.1.value": "3 bar"})
    rewrite_mechanism(changed, path, tmp_path / "changed.yaml")
    text = (tmp_path / "changed.yaml").read_text("utf-8")
    assert read_mechanism(tmp_path / "changed.yaml") == changed
    assert "gas.csv" not in text
    assert text.startswith("# A small air compressor")


# what is refused
OUT = "leads out of the folder of the model"
OUTSIDE = ["../gas.csv", "a/../../gas.csv", "/etc/gas.csv", "C:/gas.csv", "c:gas.csv", "..\\\\gas.csv",
           "\\\\\\\\server\\\\gas.csv"]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "said"),
    [
        *((name, OUT) for name in OUTSIDE), ("none.csv", "is no file in the folder"),
        ("folder.csv", "is no file in the folder"),
        ("out.csv", "leads out of the folder of the model by a link"),
        ("way/gas.csv", "leads out of the folder of the model by a link"), ("loop.csv", "cannot be reached"),
        ("pipe.csv", "is no file in the folder"), ("con.csv", "is no name of a CSV file"),
        ("gas.txt", "is no name of a CSV file"), (".env", "is no name of a CSV file"),
        ("a\\\\gas.csv", "is no name of a CSV file"), ("gas.csv\\0", "is no name of a CSV file"),
        ("", "is no name of a CSV file"), ("x" * 300 + ".csv", "is no name of a CSV file"),
    ],
)  # fmt: skip
def test_what_is_no_plain_file_in_the_folder(name, said, tmp_path):
    """Whether there is such a file outside is not told."""
    folder, other = tmp_path / "folder", tmp_path / "other"
    for place in (folder, other):
        place.mkdir()
    for place in (tmp_path, other):
        (place / "gas.csv").write_text(CSV, encoding="utf-8")
    (folder / "folder.csv").mkdir()
    (folder / "out.csv").symlink_to(other / "gas.csv")
    (folder / "way").symlink_to(other)
    (folder / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(folder / "pipe.csv")
    (folder / "con.csv").write_text(CSV, encoding="utf-8")
    (only,) = refused_model(written(folder, f'file: "{name}"', None))
    assert only.startswith("model.yaml:28: error: tables.pressure.file: ")
    assert said in only
    assert "root:" not in only


def test_sizes_are_bounded(tmp_path):
    started = time.process_time()
    path = written(tmp_path, points="0;1\n" * (MAX_ROWS + 2))
    assert "to 10000" in refused_model(path)[0]
    written(tmp_path, points="# long\n" * (MAX_BYTES // 7 + 1))
    assert "1 MB" in refused_model(path)[0]
    assert time.process_time() - started < 3
    long = "".join(f"{k}e-4;1\n" for k in range(9000))
    many = "".join(f", p{k}: {{file: gas.csv}}" for k in range(MAX_OWN_ROWS // 9000 + 1))
    path.write_text(path.read_text("utf-8").replace("tables:\n", "tables: {").replace(
        "  pressure: {over: drive, periodic: true,               # above that of the air outside\n"
        "             file: gas.csv}\n", f"pressure: {{file: gas.csv}}{many}}}\n"), encoding="utf-8")  # fmt: skip
    (tmp_path / "gas.csv").write_text(long, encoding="utf-8")
    assert any("too long" in one for one in refused_model(path))
    (tmp_path / "gas.csv").write_text(CSV, encoding="utf-8")
    many = "".join(f", q{k}: {{file: gas.csv}}" for k in range(MOST_FILES))
    path.write_text(path.read_text("utf-8").replace(", p0:", f"{many}, p0:"), encoding="utf-8")
    assert f"more than {MOST_FILES} files" in refused_model(path)[-1]


@pytest.mark.parametrize("part", ["tables", "drivers"])
def test_a_model_that_is_no_file_has_no_folder(part, tmp_path, monkeypatch):
    """Of a mapping in Python: a finding with what to do, and nothing is read from where one happens to stand."""
    (tmp_path / "gas.csv").write_text(CSV, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    data = read_mechanism(SLIDER_CRANK).data()
    data[part] = {"pressure": {"file": "gas.csv"}} if part == "tables" else {"O": {"law": "table", "file": "gas.csv"}}
    with pytest.raises(MechanismError) as caught:
        Mechanism(**data)
    (only,) = caught.value.findings
    assert "and has no folder" in only.what
    assert "give its points instead, or write the model into a file beside it" in only.remedy
    data[part] = read_mechanism(SLIDER_CRANK).data()[part]
    assert Mechanism(**data)


# periods
MEASURED = "angle [deg];pressure [bar]\n" + "".join(f"{10 * k};{4 + np.cos(k * np.pi / 18):.6f}\n" for k in range(36))
CLOSED = MEASURED + "360;5.000000\n"


def test_a_period_closes_a_table(tmp_path):
    for interpolation in ("linear", "spline"):
        stated = f"file: gas.csv, interpolation: {interpolation}"
        whole = trunnion.analyse(read_mechanism(written(tmp_path, stated, CLOSED)), 72)
        found = read_mechanism(written(tmp_path, f"{stated}, period: 360 deg", MEASURED))
        short = trunnion.analyse(found, 72)
        np.testing.assert_allclose(short["drive_effort"], whole["drive_effort"], rtol=1e-9, atol=1e-9)
        assert found.with_values({"tables.pressure.period": "365 deg"}).digest != found.digest


def test_a_table_over_time_by_the_time_of_a_turn(tmp_path):
    """At 1450/min a turn takes 41.3793 ms; a table of 41 ms would not come again with it."""
    points = "t [ms];p [bar]\n0;1\n20;2\n{end};1\n"
    over = "over: time, periodic: true"
    path = written(tmp_path, points=points.format(end=41))
    path.write_text(path.read_text("utf-8").replace("over: drive, periodic: true", over), encoding="utf-8")
    (only,) = refused_model(path)
    assert "it repeats after 0.041 s" in only
    (tmp_path / "gas.csv").write_text(points.format(end=repr(60e3 / 1450)), encoding="utf-8")
    assert read_mechanism(path)
    (tmp_path / "gas.csv").write_text(points.format(end=41), encoding="utf-8")
    path.write_text(path.read_text("utf-8").replace(over, f"{over}, period: 41 ms"), encoding="utf-8")
    assert read_mechanism(path)


# files with more columns
@pytest.mark.parametrize("names", ["[pressure, turn]", "[turn, pressure]", "['turn [deg]', pressure]"])
def test_two_columns_of_more_are_named_by_their_headers(names, tmp_path):
    """In any order of the file, with and without the unit; a text in a third column does not matter."""
    rows = [line.split(";") for line in CSV.splitlines()[1:]]
    text = "note;pressure [bar];turn [deg]\n" + "".join(f"x;{value};{place}\n" for place, value in rows)
    path = written(tmp_path, f"file: gas.csv, columns: {names}", text)
    if names.startswith("[pressure"):
        assert "its unit is that of a pressure" in "\n".join(refused_model(path))
        return
    found = read_mechanism(path)
    assert found == read_mechanism(SLIDER_CRANK)
    changed = found.with_values({"tables.pressure.points.2.value": 1.0e5})
    rewrite_mechanism(changed, path, tmp_path / "again.yaml")
    assert "columns" not in (tmp_path / "again.yaml").read_text("utf-8")
    assert read_mechanism(tmp_path / "again.yaml") == changed


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("time,turn [deg],p\ns,deg,Pa\n0,0,8\n1,180,5\n2,360,8\n", [(0.0, 8.0), (np.pi, 5.0), (2 * np.pi, 8.0)]),
        ("time,turn,p\n,deg,\n0,0,8\n1,180,5\n2,360,8\n", [(0.0, 8.0), (np.pi, 5.0), (2 * np.pi, 8.0)]),
        (f"time,turn,p\n0,0,8\n1,3,5\n2,{2 * np.pi!r},8\n", [(0.0, 8.0), (3.0, 5.0), (2 * np.pi, 8.0)]),
    ],
)
def test_units_below_the_headers_and_numbers_of_si(text, points, tmp_path):
    found = read_mechanism(written(tmp_path, "file: gas.csv, columns: [turn, p]", text))
    stated = found.parameter_set.stated
    where = [f"tables.pressure.points.{i}" for i in range(len(points))]
    assert np.array([[stated(f"{place}.at"), stated(f"{place}.value")] for place in where]) == pytest.approx(
        np.array(points)
    )
    assert not [one for one in found.checked if "radians" in one.what]


@pytest.mark.parametrize(
    ("stated", "text", "words"),
    [
        ("file: gas.csv, columns: [angle, pressur]", CSV, "gas.csv:1: error: has no column 'pressur'"),
        ("file: gas.csv, columns: [a, p]", "a;p;p\n0;1;1\n1;2;2\n", "has 2 columns 'p'"),
        ("file: gas.csv, columns: [angle]", CSV, "tables.pressure.columns"),
        ("points: [[0 deg, 1 bar], [90 deg, 2 bar]], columns: [angle, pressure]", None, "has no effect without file"),
        (
            "file: gas.csv, columns: [time, p]",
            "time,x,p\n0,5,1,2\n1,5,2,3\n",
            "gas.csv:2: error: has 4 cells, the header",
        ),
        ("file: gas.csv", "0;1\n1;x\n", "gas.csv:2: error: 'x' is not a finite number"),
        ("file: gas.csv", "0;1\n2;1\n1;1\n", "gas.csv:3: error: tables.pressure.points.2"),
        ("file: gas.csv", MEASURED, "or state period: 360 deg"),
        ("file: gas.csv", MEASURED.replace(f"{4 + np.cos(np.pi / 18):.6f}", "5.000000"), "it repeats after 350 deg"),
        ("file: gas.csv, period: 340 deg", MEASURED, "tables.pressure.period: is 5.93"),
        ("file: gas.csv, period: 2 s", MEASURED, "is a time where an angle is needed"),
        ("interpolation: linear", CSV, "tables.pressure: has no points"),
        ("file: gas.csv, points: [[0 deg, 1 bar], [360 deg, 1 bar]]", CSV, "is stated beside file"),
    ],
)
def test_a_table_of_a_file_stated_wrongly(stated, text, words, tmp_path):
    assert words in "\n".join(refused_model(written(tmp_path, stated, text)))
