"""Data files of every kind and shape: the same numbers from each of them; a finding for what is no data."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from measured_data.recording import mapping, read, recorded
from trunnion.errors import MechanismError
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.tables import read_table

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")
ChannelObject, RootObject, TdmsWriter = (
    getattr(pytest.importorskip("nptdms"), name) for name in ("ChannelObject", "RootObject", "TdmsWriter")
)


def _tdms(path, columns, properties=None):
    with TdmsWriter(path) as writer:
        channels = [
            ChannelObject("rig", name, np.asarray(one), dict(properties or {})) for name, one in columns.items()
        ]
        writer.write_segment([RootObject({}), *channels])


def _same(one, other):
    return all(
        np.array_equal(a.turns, b.turns, equal_nan=True) and a.accuracy == b.accuracy
        for left, right in zip(one.conditions, other.conditions, strict=True)
        for a, b in zip(left.courses.values(), right.courses.values(), strict=True)
    )


def test_formats_give_the_same_bits(tmp_path):
    columns = recorded(turns=6, noise=0.3)
    columns["T1"][3000:3050] = np.nan
    columns["T2"][2000] = np.inf
    changes = {"filter": {"cut_off": "300 Hz"}}
    text = read(columns, tmp_path, changes)
    pd.DataFrame(columns).to_parquet(tmp_path / "run.parquet")
    _tdms(tmp_path / "run.tdms", columns)
    whole = xr.Dataset({name: ("row", values) for name, values in columns.items()})
    for engine in ("scipy", "h5netcdf"):
        whole.to_netcdf(tmp_path / f"{engine}.nc", engine=engine)
    for name in ("run.parquet", "run.tdms", "scipy.nc", "h5netcdf.nc"):
        found = read_measured(mapping(changes), [tmp_path / name])
        assert _same(text, found), name
        assert [one.what for one in found.findings] == [one.what for one in text.findings]


TEXTS = {
    "comma": "t,T 1\n0,1.5\n1,-2e3\n",
    "semicolon and decimal comma": "t;T 1\n0;1,5\n1;-2e3\n",
    "tab": "t\tT 1\n0\t1.5\n1\t-2000\n",
    "tab and decimal comma": "t\tT 1\n0,0\t1,5\n1,0\t-2000,0\n",
    "thousands": "t;T 1\n0;1,5\n1;-2.000,0\n",
    "thousands with a space": "t;T 1\n0;1,5\n1;-2\u00a0000,0\n",
    "thousands with a comma": "t;T 1\n0;1.5\n1;-2,000.0\n",
    "units in brackets": "t [s],T 1 [mV]\n0,1.5\n1,-2e3\n",
    "row of units": "t,T 1\ns,mV\n0,1.5\n1,-2e3\n",
    "row of units in brackets": "t;T 1\n[s];[mV]\n0;1.5\n1;-2e3\n",
    "remarks": "# a rig\nt,T 1\n# begins\n0,1.5\n1,-2e3\n",
    "byte order mark": "\ufefft,T 1\n0,1.5\n1,-2e3\n",
    "quotes and spaces": '"t", "T 1"\n 0, 1.5\n 1, -2e3\n',
    "above the header": "Logger 7\nDate;2026-01-01\nt,T 1\n0,1.5\n1,-2e3\n",
    "other columns": "note,t,x,T 1\nabc,0,,1.5\nd,1,9,-2e3\n",
    "a comma in another column": "t;T 1;note\n0;1.5;1,5\n1;-2000.0;1,5\n",
    "lines of Windows": "t,T 1\r\n0,1.5\r\n1,-2e3\r\n",
    "separators at the end of lines": "t;T 1\n0;1,5;\n1;-2e3;\n",
    "also of the header": "t;T 1;\n0;1,5;\n1;-2e3;\n",
    "no last line end": "t,T 1\n0,1.5\n1,-2e3",
}


@pytest.mark.parametrize("kind", TEXTS)
def test_shapes_of_text(tmp_path, kind):
    path = tmp_path / "a.csv"
    path.write_text(TEXTS[kind], encoding="utf-8", newline="")
    found = read_table(path, ["t", "T 1"])
    assert found.columns["t"].values.tolist() == [0.0, 1.0]
    assert found.columns["T 1"].values.tolist() == [1.5, -2000.0]
    assert found.columns["T 1"].unit == ("mV" if "units" in kind else "")


def test_numbers_that_are_none(tmp_path):
    """Beside decimal commas a point may be one of thousands or of decimals: it makes no number."""
    path = tmp_path / "a.csv"
    path.write_text(
        "t,x\n0,\n1,nan\n2,inf\n3,ERR\n4,1e400\n5,-1e308\n6,99999999999999999999\n7,True\n8\n", encoding="utf-8"
    )
    found = read_table(path, ["t", "x"]).columns["x"]
    assert (found.texts, found.example) == (2, "ERR")  # ERR and True
    np.testing.assert_array_equal(found.values, [np.nan, np.nan, np.inf, np.nan, np.inf, -1e308, 1e20, np.nan, np.nan])
    path.write_text("t;x\n" + "0;0,5\n" * 500 + "0;1.450,25\n0;1.450\n", encoding="utf-8")
    assert read_table(path, ["x"]).columns["x"].values[-2:].tolist() == [1450.25, 1450.0]
    path.write_text("t;x\n0;1,5\n1;1.450\n2;980,25\n", encoding="utf-8")
    found = read_table(path, ["t", "x"]).columns["x"]
    assert (found.texts, found.example) == (1, "1.450")
    np.testing.assert_array_equal(found.values, [1.5, np.nan, 980.25])


def test_waveforms_tell_time_and_unit(tmp_path):
    columns = recorded(turns=5)
    columns.pop("t")
    properties = {"wf_increment": 1 / 5000.0, "wf_start_offset": 0.0, "wf_samples": 100}
    _tdms(tmp_path / "run.tdms", columns, properties)
    for changes in ({}, {"time": None}):  # it has no column t
        found = read_measured(mapping(changes), [tmp_path / "run.tdms"])
        assert found.findings == ()
        assert any("waveforms" in sentence for sentence in found.done)
    _tdms(tmp_path / "unit.tdms", {"T1": [1.0, 2.0]}, {"unit_string": "mV"})
    assert read_table(tmp_path / "unit.tdms", ["T1"]).columns["T1"].unit == "mV"


def test_groups_of_tdms(tmp_path):
    path = tmp_path / "two.tdms"
    with TdmsWriter(path) as writer:
        for group, name, values in (("in", "T", [1.0, 2.0]), ("out", "T", [3.0, 4.0]), ("out", "n", [5, 6])):
            writer.write_segment([ChannelObject(group, name, np.array(values))])
    found = read_table(path, ["in/T", "out/T", "n", "out/n"])
    assert [one.values.tolist() for one in found.columns.values()] == [[1, 2], [3, 4], [5, 6], [5, 6]]
    with pytest.raises(MechanismError, match=r"there is no column 'T'; the file has 'in/T', 'out/T', 'n'"):
        read_table(path, ["T"])
    _tdms(path, {"a": [1.0, 2.0], "b": [1.0]})
    with pytest.raises(MechanismError, match=r"different numbers of samples or rates: 'a' 2, 'b' 1"):
        read_table(path, ["a", "b"])


def test_kinds_of_parquet(tmp_path):
    path = tmp_path / "a.parquet"
    fields = [
        pa.field("n", pa.int16(), metadata={"unit": "rpm"}),
        pa.field("f", pa.float32()),
        pa.field("when", pa.timestamp("us")),
        pa.field("list", pa.list_(pa.float64())),
    ]
    rows = {"n": [1, None], "f": [0.5, 2.0], "when": [1_000_000, 1_250_000], "list": [[1.0], [2.0, 3.0]]}
    pq.write_table(pa.table(rows, schema=pa.schema(fields)), path)
    found = read_table(path, ["n", "f", "when", "list"]).columns
    np.testing.assert_array_equal(found["n"].values, [1, np.nan])
    assert found["n"].unit == "rpm"
    assert found["when"].values.tolist() == [0.0, 0.25]
    assert found["list"].texts == 2


@pytest.mark.parametrize("engine", ["scipy", "h5netcdf"])
def test_variables_of_netcdf(tmp_path, engine):
    """Packed numbers, gaps, units and times are those that CF 1.11 makes of them; what is not named is not decoded."""
    path = tmp_path / "a.nc"
    packed = {"units": "N m", "scale_factor": 0.5, "_FillValue": np.int16(-99)}
    variables = {
        "T": ("row", np.array([3, -99, 5], np.int16), packed),
        "since": ("row", [0.0, 250.0, 750.0], {"units": "milliseconds since 2026-11-22 11:40:00"}),
        "t": ("row", [0.0, 1.0, 2.0], {"units": "ms"}),
        "odd": ("row", [1.0, 2.0, 3.0], {"units": "days since never"}),
        "map": (("row", "place"), np.zeros((3, 2))),
        "level": ((), 1.0),
        "other": ("far", [1.0, 2.0, 3.0]),
    }
    xr.Dataset(variables, {"row": [10, 20, 30]}).to_netcdf(path, engine=engine)
    found = read_table(path, ["T", "since", "t", "row"], ["none"]).columns
    np.testing.assert_array_equal(found["T"].values, [1.5, np.nan, 2.5])
    assert found["since"].values.tolist() == [0.0, 0.25, 0.75]
    assert found["t"].values.tolist() == [0.0, 1.0, 2.0]
    assert found["row"].values.tolist() == [10.0, 20.0, 30.0]
    assert {name: column.unit for name, column in found.items()} == {"T": "N m", "since": "s", "t": "ms", "row": ""}
    for name, told in (("map", "map .*'place': 2"), ("level", "level {}"), ("other", "other {'far': 3}")):
        with pytest.raises(MechanismError, match=rf"not all of one dimension.*T {{'row': 3}}, {told}"):
            read_table(path, ["T", name])
    with pytest.raises(MechanismError, match=r"is not .nc that can be read: .*never"):
        read_table(path, ["odd"])
    with pytest.raises(MechanismError, match=r"there is no column 'n'; the file has .*'level'"):
        read_table(path, ["n"])


BAD = {
    "empty": ("a.csv", b"", "is empty but for comments"),
    "blank": ("a.csv", b"\n\n", "is empty but for comments"),
    "header only": ("a.csv", b"t,T1\n", "has a header but no rows"),
    "no header": ("a.csv", b"0,1\n1,2\n", "no line has the columns 'T1', 't'; the first lines are: 0,1 / 1,2"),
    "too many cells": ("a.csv", b"t,T1\n0,1\n1,2,3\n", "row 2 below the header has more cells than its 2"),
    "decimal commas": ("a.csv", b"t,T1\n0,5,1,5\n1,0,2,5\n", "row 1 below the header has more cells than its 2"),
    "far below": ("a.csv", b"t,T1\n" + b"0,1\n" * 500 + b"1,2,3\n", "has 3 cells instead of 2"),
    "binary": ("a.csv", b"\x00\x01\x02PK", "is not a text file"),
    "no line end": ("a.csv", b"1;" * (1 << 24), "no end of a line in 16 MiB"),
    "not parquet": ("a.parquet", b"t,T1\n0,1\n", "is not .parquet that can be read"),
    "not tdms": ("a.tdms", b"t,T1\n0,1\n" * 20, "is not .tdms that can be read"),
    "not netcdf": ("a.nc", b"t,T1\n0,1\n", "cannot be read"),
    "no classic netcdf": ("a.nc", b"CDF,T1\n0,1\n", "is not .nc that can be read"),
    "extension": ("a.xlsx", b"PK", "the extension '.xlsx' is not one of a data file"),
    "twice": ("a.csv", b"t,T1,T1\n0,1,2\n", "the column 'T1' stands there 2 times"),
    "missing": ("a.csv", b"t,T2,n\n0,1,2\n", "there is no column 'T1'; the file has 't', 'T2', 'n'"),
    "no such file": ("b.csv", b"", "there is no such file"),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_data(tmp_path, kind):
    name, content, told = BAD[kind]
    if kind != "no such file":
        (tmp_path / name).write_bytes(content)
    with pytest.raises(MechanismError) as failure:
        read_table(tmp_path / name, ["t", "T1"])
    (finding,) = failure.value.findings
    assert told in finding.what
    assert finding.file.endswith(name)
    assert finding.remedy


def test_huge_numbers(tmp_path):
    columns = recorded(turns=4)
    columns["T1"] *= 1e150
    found = read(columns, tmp_path)
    assert np.isfinite(found.conditions[0].courses["torque-in"].mean).all()
    columns["t"][-1] = 1e308
    with pytest.raises(MechanismError, match=r"from 0 s to 1e\+308 s in steps of 0.0002 s, too many to count"):
        read(columns, tmp_path)
