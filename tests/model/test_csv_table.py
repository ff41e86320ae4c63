"""Points of drivers and tables from CSV files: what is read, and what is said of a bad one."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion import Mechanism, MechanismError
from trunnion.model.csv_table import MAX_ROWS
from trunnion.model.mechanism import read_mechanism

SLIDER_CRANK = Path(__file__).resolve().parents[2] / "examples" / "slider-crank.yaml"  # driver O, table pressure
MODEL = read_mechanism(SLIDER_CRANK)


def csv(tmp_path: Path, text: str, name: str = "points.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def points(mechanism: Mechanism, name: str = "O") -> list[tuple[float, float]]:
    """The points of a driver in SI."""
    values = mechanism.parameters()
    rows = range(len(mechanism.drivers[name].points or ()))
    return [(values[f"drivers.{name}.points.{k}.time"], values[f"drivers.{name}.points.{k}.coordinate"]) for k in rows]


def refused(tmp_path: Path, text: str, name: str = "O") -> list[str]:
    """The findings without the folder."""
    with pytest.raises(MechanismError) as caught:
        MODEL.with_table(name, csv(tmp_path, text))
    return [str(finding).replace(f"{tmp_path}/", "") for finding in caught.value.findings]


# ---- what is read ---------------------------------------------------------------------------------------------

DEGREE = np.pi / 180


@pytest.mark.parametrize(
    "text",
    [
        "time [ms], angle [deg]\n0,0\n50,12.5\n100,90\n",
        "time [ms]; angle [deg]\n0;0\n50; 12,5\n1e2;90\n",
        "time [ms]\tangle [deg]\r\n0\t0\r\n50\t12,5\r\n100\t90.0\r\n",
        '\ufeff"time [ms]";"angle, of the crank [°]"\n# measured\n\n0;0;\n50;12.5\n100;+90\n',
        f"0,0\n0.05,{12.5 * DEGREE!r}\n.1,{90 * DEGREE!r}\n",
        f"t, q [rad]\n0,0\n0.05,{12.5 * DEGREE!r}\n0.1,{90 * DEGREE!r}",
    ],
)
def test_separators_headers_units_and_decimal_commas(text: str, tmp_path: Path) -> None:
    found = points(MODEL.with_table("O", csv(tmp_path, text)))
    np.testing.assert_allclose(found, [(0, 0), (0.05, 12.5 * DEGREE), (0.1, 90 * DEGREE)], rtol=1e-15)


def test_units_are_converted_exactly_and_kept(tmp_path: Path) -> None:
    mechanism = MODEL.with_table("O", csv(tmp_path, "t [ms];q [deg]\n0;0\n93,782;-5\n"))
    assert points(mechanism)[1][0] == 0.093782
    assert mechanism.data()["drivers"]["O"] == {"law": "table", "points": [["0 ms", "0 deg"], ["93.782 ms", "-5 deg"]]}
    assert Mechanism(**mechanism.data()) == mechanism


def test_points_of_a_table(tmp_path: Path) -> None:
    """The example's own points in a file give its own results; their unit is still that of a pressure."""
    own = [[str(q.source) for q in row] for row in MODEL.tables["pressure"].points]
    rows = [f"{place.removesuffix('deg')};{value.removesuffix('bar')}" for place, value in own]
    changed = MODEL.with_table("pressure", csv(tmp_path, "\n".join(["angle [deg];pressure [bar]", *rows])))
    assert changed.tables["pressure"].periodic
    one, two = (trunnion.analyse(each, 24) for each in (MODEL, changed))
    np.testing.assert_array_equal(one["drive_effort"], two["drive_effort"])
    wrong = "\n".join(["angle [deg];pressure [mm]", *rows])
    assert any("pressure" in line and "bar" not in line for line in refused(tmp_path, wrong, "pressure"))


def test_a_model_may_leave_the_points_to_the_file(tmp_path: Path) -> None:
    text = SLIDER_CRANK.read_text("utf-8")
    path = tmp_path / "model.yaml"
    path.write_text(text.replace("O: {speed: 1450 rpm}", "O: {law: table, ends: natural}"), encoding="utf-8")
    with pytest.raises(MechanismError, match="--table"):
        read_mechanism(path)
    mechanism = read_mechanism(path, {"O": csv(tmp_path, "0,0\n1,2\n")})
    assert mechanism.drivers["O"].ends == "natural"
    assert len(points(mechanism)) == 2


def test_names_of_a_driver_and_a_table_alike_are_told_apart(tmp_path: Path) -> None:
    table = {"over": "time", "points": [[0, 1], [1, 2]]}
    mechanism = Mechanism(**{**MODEL.data(), "tables": {**MODEL.data()["tables"], "O": table}})
    path = csv(tmp_path, "0,0\n1,5\n")
    with pytest.raises(MechanismError, match=r"'O' is a driver and a table — say drivers\.O or tables\.O"):
        mechanism.with_table("O", path)
    assert mechanism.with_table("tables.O", path).parameters()["tables.O.points.1.value"] == 5
    assert mechanism.with_table("drivers.O", path).drivers["O"].law == "table"


# ---- what is refused ------------------------------------------------------------------------------------------

BAD = [
    ("", ["points.csv:1: error: is empty — write a row for each point"]),
    ("# only\n\n", ["points.csv:1: error: has only comments"]),
    ("time, angle\n", ["points.csv:1: error: has no rows of numbers, a table needs two"]),
    ("time, angle\n0,0\n", ["points.csv:2: error: has 1 row of numbers, a table needs two"]),
    ("0 0\n1 1\n", ["points.csv:1: error: has 1 column, a table has 2 — write time"]),
    ("0,0,1,5\n1,0,2,5\n", ["points.csv:1: error: has 4 columns, a table has 2 — write time or drive coordinate"]),
    ("0;0\n1;x\n", ["points.csv:2: error: 'x' is not a finite number — write a number"]),
    ("0;0\n1;nan\n2;inf\n3;1e999\n4;1_0\n", [f"points.csv:{k}: error: '{cell}' is not a finite number"
                                           for k, cell in ((2, "nan"), (3, "inf"), (4, "1e999"), (5, "1_0"))]),
    ("0;0\n;2\n3\n4;5;6\n", ["points.csv:2: error: a number is missing", "points.csv:3: error: has 1 cell, the rows",
                            "points.csv:4: error: has 3 cells"]),
    ("0;1.234,5\n1;0\n", ["points.csv:1: error: '1.234,5' is not a finite number"]),
    ("t;q\n0;0\n2;1\n1;2\n", ["points.csv:4: error: drivers.O.points.2: its time 1 does not come after 2"]),
    ("1;0\n2;1\n", ["points.csv:1: error: drivers.O.points.0: the table begins at 1 s"]),
    ("0;1\n2;1\n", ["points.csv:1: error: drivers.O.points: the table never moves"]),
    ("t [mm];q [N]\n0;1\n2;1\n", ["points.csv:1: error: t [mm]: its unit is that of a length, the column is of time",
                                 "points.csv:1: error: q [N]: its unit is that of a force, the column is of angle"]),
    ("t [mss];q\n0;1\n2;1\n", ["points.csv:1: error: t [mss]: the unit 'mss' is not known"]),
    ("t (ms);q\n0;1\n2;1\n", ["points.csv:1: error: t (ms): a unit stands in brackets — write [ms]"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), BAD)
def test_one_finding_for_each_problem(text: str, expected: list[str], tmp_path: Path) -> None:
    found = refused(tmp_path, text)
    assert len(found) == len(expected), found
    for line, start in zip(found, expected, strict=True):
        assert line.startswith(start), line
        assert "—" in line  # a remedy


def test_a_file_in_disorder_is_told_briefly(tmp_path: Path) -> None:
    found = refused(tmp_path, "\n".join(f"{k};{k}" for k in range(100, 0, -1)))
    assert len(found) == 9
    assert "and 92 more like these" in found[-1]
    assert len(refused(tmp_path, "0;0\n" + "a;b\n" * 50)) == 9


def test_a_large_file_is_refused_quickly_with_the_limit(tmp_path: Path) -> None:
    started = time.process_time()
    (finding,) = refused(tmp_path, "".join(f"{k},{k}\n" for k in range(10**6)))
    assert "has 13.8 MB, a table at most 1.0 MB" in finding
    (finding,) = refused(tmp_path, "".join(f"{k},{k}\n" for k in range(MAX_ROWS + 2)))
    assert f"has {MAX_ROWS + 2} rows, a table at most {MAX_ROWS}" in finding
    assert time.process_time() - started < 3


def test_what_is_no_text_or_not_there(tmp_path: Path) -> None:
    with pytest.raises(MechanismError, match="cannot be read: No such file"):
        MODEL.with_table("O", tmp_path / "absent.csv")
    with pytest.raises(MechanismError, match="is not a file"):
        MODEL.with_table("O", tmp_path)
    (tmp_path / "latin.csv").write_bytes(b"t,\xb0\n0,1\n")
    with pytest.raises(MechanismError, match=r"latin\.csv:1: error: is not UTF-8 text \(byte 2\)"):
        MODEL.with_table("O", tmp_path / "latin.csv")
    with pytest.raises(MechanismError, match="there is no driver or table 'presure' — did you mean 'pressure'"):
        MODEL.with_table("presure", csv(tmp_path, "0,0\n"))
