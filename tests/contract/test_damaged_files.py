"""A slice of the damaged files of `python -m benchmarks.fuzz`: findings or a result, nothing else, and no long wait."""

import pytest
from benchmarks.fuzz import GOOD, SHARES, run_case
from benchmarks.fuzz_files import KINDS, originals

SEED = 2026
CASES = 240


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("part", range(6))
def test_damaged_files_are_findings(part, tmp_path):
    """As in the benchmark, which runs tens of thousands; a machine that does much else may take longer."""
    found = [run_case(SEED, case, tmp_path, limit=60.0) for case in range(part, CASES, 6)]
    assert [one for one in found if one.outcome not in GOOD] == []
    assert {one.outcome for one in found} == set(GOOD)


@pytest.mark.slow
def test_what_is_damaged_is_sound(tmp_path):
    """Else every damage would be found, and none of what comes after it."""
    from random import Random

    assert set(KINDS) == set(SHARES)
    for kind in set(KINDS) - {"model"}:  # these are the examples, which have tests of their own
        for one in originals(kind):
            for name, raw in one.beside.items():
                (tmp_path / name).write_bytes(raw)
            one.file(tmp_path).write_bytes(one.raw)
            assert list(KINDS[kind](one.file(tmp_path), Random(0)))
