"""Files as a German laboratory exports them: thousands with a point, units in the headings, a crank angle in steps."""

import numpy as np
import pytest

from trunnion.rig.reading.read import read_measured

RATE, SPEED = 500.0, 300.0  # Hz, rpm


def german(value, decimals):
    return f"{value:,.{decimals}f}".replace(",", "'").replace(".", ",").replace("'", ".")


def recorded(folder, header, step=0.5, rows=3000):
    """Angle in steps, a torque of 1450 + 200 sin N m, a speed; the mapping that reads them, without units."""
    noise = np.random.default_rng(1).normal(size=rows)
    lines = [header]
    for k in range(rows):
        angle = 6 * SPEED * k / RATE
        torque = 1450.33 + 200 * np.sin(np.radians(angle)) + noise[k]
        told = round((angle % 360) / step) * step
        lines.append(f"{german(1000 * k / RATE, 1)};{german(told, 2)};{german(torque, 2)};{german(SPEED, 1)}")
    (folder / "lauf.csv").write_bytes("\r\n".join(["Prüfstand 3", *lines]).encode("iso-8859-1"))
    (folder / "mapping.json").write_text("{}")
    return {
        "trunnion-data": 1,
        "time": {"column": "Zeit"},
        "angle": {"from": "column", "column": "Winkel"},
        "channels": {
            "M": {"column": "Moment", "measures": "effort:A"},
            "n": {"column": "Drehzahl", "measures": "rate:A"},
        },
        "positions": 72,
    }


@pytest.mark.parametrize(
    "header",
    [
        "Zeit [ms];Winkel [°];Moment [Nm];Drehzahl [U/min]",
        "Zeit / ms;Winkel / °;Moment / N m;Drehzahl / U/min",
        "Zeit in ms;Winkel in deg;Moment in Nm;Drehzahl in 1/min",
        '"Zeit (ms)";"Winkel (°)";"Moment (N m)";"Drehzahl (U/min)"',
        '"Zeit [ms]" ;"Winkel [°]" ; "Moment [N m]";"Drehzahl [U/min]"',
        "Zeit / ms;Winkel / °;Moment / N m;Drehzahl / U/min|",  # wanted whole
    ],
)
def test_units_of_headings_and_thousands(tmp_path, header):
    mapping = recorded(tmp_path, header.strip("|"))
    if "|" in header:
        mapping["time"]["column"], mapping["angle"]["column"] = "Zeit / ms", "Winkel / °"
    found = read_measured(mapping, [tmp_path / "lauf.csv"])
    torque, speed = (found.conditions[0].courses[name] for name in "Mn")
    assert torque.mean.mean() == pytest.approx(1450.33, abs=0.3)
    assert np.ptp(torque.mean) == pytest.approx(400, rel=0.01)
    assert speed.mean.mean() == pytest.approx(SPEED * np.pi / 30, rel=1e-6)
    assert speed.shown == ("rpm" if "1/min" in header else "U/min", pytest.approx(np.pi / 30))
    assert {one.code for one in found.findings} == {"data.readings.constant"}  # of the speed
