"""Every example is read, checked and analysed, and its fact of the gallery holds."""

from contextlib import suppress

import numpy as np
import pytest

import trunnion
from gallery.entry import STEPS, Outcome
from gallery.facts import ENTRIES, REFUSED
from mechanisms_parts import EXAMPLES, example
from trunnion import Status
from trunnion.errors import MechanismError, Severity
from trunnion.views.cycle import KINDS, figure


def test_every_example_has_an_entry():
    assert sorted([*ENTRIES, *REFUSED]) == sorted(path.stem for path in EXAMPLES.glob("*.yaml"))


@pytest.mark.spread(18)
@pytest.mark.parametrize("name", [*ENTRIES, *REFUSED])
def test_every_example_has_a_name_and_notes(name):
    mechanism = example(name)
    assert mechanism.name
    assert mechanism.notes.strip().endswith("."), "the gallery shows the notes: give a sentence or two"


@pytest.mark.slow
@pytest.mark.parametrize("name", ENTRIES)
def test_example(name):
    """No error but those of the entry, no position without forces but those of the entry, the fact, its pictures."""
    entry = ENTRIES[name]
    mechanism = example(name)
    errors = [str(one) for one in trunnion.check(mechanism, STEPS).findings if one.severity is Severity.ERROR]
    assert not [error for error in errors if not any(part in error for part in entry.errors)]
    result = trunnion.analyse(mechanism, STEPS)
    assert np.count_nonzero(result["status"] >= Status.NOT_CONVERGED) == entry.lost
    found, expected = entry.found(Outcome(mechanism, result)), entry.expected()
    assert found == pytest.approx(expected, rel=0, abs=entry.tolerance), entry.says
    drawn = 0
    for kind in KINDS:
        with suppress(MechanismError):  # what it says: nothing of this kind to draw
            drawn += figure(result, kind=kind) is not None
    assert drawn
    assert result.trunnion.report().rstrip().endswith("</html>")


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_refused(name):
    """It is checked, its diagnosis is an error, and it is not analysed."""
    mechanism = example(name)
    errors = [one.what for one in trunnion.check(mechanism, STEPS).findings if one.severity is Severity.ERROR]
    assert len(errors) == 1
    assert REFUSED[name] in errors[0]
    with pytest.raises(MechanismError, match=REFUSED[name]):
        trunnion.analyse(mechanism, STEPS)
