"""Files as laboratories write them: time stamps, German signs and units, long headers, tables that unfold."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from measured_data.recording import mapping, off, recorded, text_of
from trunnion.errors import MechanismError
from trunnion.rig.reading.read import read_measured
from trunnion.rig.reading.tables import Column, read_table

pytest.importorskip("pyarrow")
ChannelObject, RootObject, TdmsWriter = (
    getattr(pytest.importorskip("nptdms"), name) for name in ("ChannelObject", "RootObject", "TdmsWriter")
)


@pytest.fixture(scope="module")
def columns():
    return recorded(turns=6, noise=0.0)


def _read(
    columns,
    folder,
    changes,
    names=None,
    encoding="utf-8",
):
    """As a German logger writes it: semicolons and decimal commas."""
    text = text_of({(names or {}).get(name, name): one for name, one in columns.items()}, ";", ",")
    (folder / "run.csv").write_bytes(text.encode(encoding))
    return read_measured(mapping(changes), [folder / "run.csv"])


def _stamps(columns, form):
    return {**columns, "t": [form(t) for t in columns["t"]]}


def _part(t):
    return f"{round(t * 1e4) % 10_000:04d}"


FORMS = {
    "date, decimal comma": lambda t: f"22.11.2026 11:40:{int(t):02d},{_part(t)}",
    "world time": lambda t: f"2026-11-22T11:40:{int(t):02d}.{_part(t)}Z",
    "time of day": lambda t: f"11:40:{int(t):02d},{_part(t)}",
    "over the end of the year": lambda t: f"{'31.12.26 23:59:59' if t < 0.3 else '1.1.27 0:00:00'},{_part(t + 0.7)}",
    "one day, whichever order": lambda t: f"03/04/2026 11:40:{int(t):02d}.{_part(t)}",
    "noon": lambda t: f"03/04/2026 12:40:{int(t):02d}.{_part(t)} PM",
}


@pytest.mark.spread(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("unit", ["", " [hh:mm:ss]"])
def test_time_stamps(columns, tmp_path, form, unit):
    changes = {"time": {"column": "t"}}
    found = _read(_stamps(columns, FORMS[form]), tmp_path, changes, {"t": f"t{unit}"})
    plain = _read(columns, tmp_path, {})
    assert found.findings == ()
    assert any("first time stamp" in sentence for sentence in found.done)
    for name, course in plain.conditions[0].courses.items():
        np.testing.assert_allclose(found.conditions[0].courses[name].mean, course.mean, rtol=1e-9)


def test_time_stamps_keep_their_last_digit(tmp_path):
    """Seconds since a year as floats are known to some microseconds only."""
    (tmp_path / "a.csv").write_text(
        "t;x\n22.11.2026 11:40:00,000000100;1\n22.11.2026 11:40:00,000000300;2\n;3\n", encoding="utf-8"
    )
    seconds = read_table(tmp_path / "a.csv", ["t", "x"]).columns["t"].seconds()
    np.testing.assert_array_equal(seconds, [0.0, 200 * 1e-9, np.nan])


@pytest.mark.parametrize(
    ("stamps", "dayfirst", "seconds"),
    [
        (("2026-03-04 11:40:00", "2026-03-05 11:40:00.5"), True, 86400.5),
        (("04.03.2026 11:40:00", "05.03.2026 11:40:00,5"), True, 86400.5),
        (("03/04/2026 11:40:00", "03/05/2026 11:40:00.5"), False, 86400.5),
        (("2026-03-04T11:40:00+01:00", "2026-03-05T11:40:00.5+01:00"), True, 86400.5),
        (("4.3.26 11:40:00", "5.3.26 11:40:00,5"), True, 86400.5),
    ],
)
def test_the_order_of_a_date(stamps, dayfirst, seconds):
    """The day comes first unless the year does, or the mapping says otherwise."""
    assert Column(np.zeros(2), "", 2, stamps[0], stamps).seconds(dayfirst)[1] == pytest.approx(seconds)


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_units_of_a_german_laboratory(columns, tmp_path, encoding):
    lines = text_of(columns, ";", ",").split("\n", 1)[1]
    head = "Prüfzeit;T1;T2;n1;n2;Drehgeber;Winkel\nSek.;V;Nm;1/min;U/min;-;°\n"
    (tmp_path / "run.csv").write_bytes((head + lines).encode(encoding))
    changes = {
        "time": {"column": "Prüfzeit"}, "angle/column": "Drehgeber", "channels/torque-in/unit": None,
        "channels/brake/unit": None, "channels/speed-out/unit": None,
    }  # fmt: skip
    found = read_measured(mapping(changes), [tmp_path / "run.csv"])
    assert found.findings == ()  # 1/min is rpm where the mapping says so
    assert off(found.conditions[0]) < 0.02
    assert float(np.mean(found.conditions[0].courses["speed-out"].mean)) == pytest.approx(20 * np.pi, rel=1e-3)
    plain = read_measured(mapping({**changes, "channels/speed-in/unit": None}), [tmp_path / "run.csv"])
    speeds = [float(np.mean(read.conditions[0].courses["speed-in"].mean)) for read in (found, plain)]
    assert speeds == [pytest.approx(20 * np.pi, rel=1e-3)] * 2  # 1/min is rpm


@pytest.mark.parametrize("end", ["parquet", "tdms", "nc"])
def test_time_stamps_of_binary_files(columns, tmp_path, end):
    stamped, path = _stamps(columns, FORMS["date, decimal comma"]), tmp_path / f"run.{end}"
    if end == "parquet":
        pd.DataFrame(stamped).to_parquet(path)
    elif end == "nc":
        times = np.datetime64("2026-11-22T11:40:00") + np.rint(columns["t"] * 1e9).astype("timedelta64[ns]")
        xr.Dataset({key: ("t", one) for key, one in stamped.items() if key != "t"}, {"t": times}).to_netcdf(path)
    else:
        with TdmsWriter(path) as writer:
            writer.write_segment([RootObject({}), *(ChannelObject("rig", key, one) for key, one in stamped.items())])
    assert off(read_measured(mapping({"time": {"column": "t"}}), [path]).conditions[0]) < 0.02


UNKNOWN = [("time", "t", "Sekunde"), ("time", "t", "hh:mm:ss"), ("angle", "angle", "Grad"), ("angle", "angle", "mgon")]


@pytest.mark.parametrize(("entry", "column", "unit"), UNKNOWN)
def test_a_unit_that_is_unknown(columns, tmp_path, entry, column, unit):
    """It is refused, unless the mapping states it."""
    changes = {"time": {"column": "t"}, "angle": {"from": "column", "column": "angle"}}
    units = {"t": "t [s]", "angle": "angle [rad]"}
    names = units | {column: f"{column} [{unit}]"}
    with pytest.raises(MechanismError, match=rf"'{unit}'.*state {entry}.unit in the mapping"):
        _read(columns, tmp_path, changes, names)
    changes[entry]["unit"] = "s" if entry == "time" else "rad"
    assert _read(columns, tmp_path, changes, names).findings == ()
