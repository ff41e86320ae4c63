"""The list of seeded faults follows the sources: the text of each stands exactly once in its file."""

import pytest
from benchmarks.faults import FAULTS
from benchmarks.mutants import applies


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_seeded_fault_applies(fault):
    assert applies(fault)
