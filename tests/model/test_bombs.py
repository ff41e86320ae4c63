"""Small files that would take hours or all memory if they were read as they are written."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from trunnion import MechanismError, read
from trunnion.model.units import UnitError, root
from trunnion.rig.reading.mapping import read_mapping
from trunnion.rig.reading.rig_file import Rig

DEEP = 20_000
BOMBS = {
    "dotted key": (".toml", "x." * DEEP + "x = 1"),
    "dotted table": (".toml", "[" + "x." * DEEP + "x]"),
    "TOML brackets": (".toml", "x = " + "[" * DEEP + "]" * DEEP),
    "TOML groups": (".toml", "x = " + "{a = " * DEEP + "1" + "}" * DEEP),
    "tables in tables": (".toml", "".join(f"[[{'.'.join('x' * k)}]]\n" for k in range(1, 300))),
    "TOML whole number": (".toml", "x = " + "9" * 5000),
    "long word": (".toml", 'name = """' + "x" * 900_000 + '"""'),
    "YAML brackets": (".yaml", "x: " + "[" * DEEP + "]" * DEEP),
    "YAML lists": (".yaml", "- " * DEEP),
    "YAML aliases": (".yaml", "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]"),
    "YAML whole number": (".yaml", "trunnion: " + "9" * 5000),
    "a key twice": (".yaml", ".nan: 1\n.nan: 2"),
    "JSON groups": (".json", '{"x": ' * DEEP + "1" + "}" * DEEP),
    "half a sign": (".json", r'{"trunnion": 1, "name": "\ud800"}'),
}


@pytest.mark.spread(29)
@pytest.mark.parametrize("bomb", BOMBS)
@pytest.mark.parametrize("reader", [read, Rig.read, read_mapping])
def test_what_never_ends_is_a_finding(bomb: str, reader: object, tmp_path: Path) -> None:
    suffix, text = BOMBS[bomb]
    path = tmp_path / f"bomb{suffix}"
    path.write_text(text)
    begin = time.process_time()
    with pytest.raises(MechanismError):
        reader(path)  # type: ignore[operator]
    assert time.process_time() - begin < 10


@pytest.mark.parametrize("unit", ["9**9**9**9", "m^9^9^9", "((((9^9)^9)^9)^9)^9 m", "m^(9^9^9)", "9" * 5000, "2**1e9"])
def test_powers_that_no_unit_has(unit: str) -> None:
    begin = time.process_time()
    with pytest.raises(UnitError):
        root(unit)
    assert time.process_time() - begin < 10


@pytest.mark.parametrize("unit", ["kg m^2/s^3", "m**2", "s^-1", "m^(1/2)", "s^(-2)", "(m^2)^3", "mV/(N m)"])
def test_powers_that_units_have(unit: str) -> None:
    assert root(unit)[0] > 0
