"""Results that the tests of the views share."""

import pytest
from stand_in import NASTY, four_bar, slider

from trunnion.errors import Status


@pytest.fixture
def plain():
    return four_bar()


@pytest.fixture
def ideal():
    return four_bar(ideal=True)


CASES = {
    "plain": four_bar, "gap": lambda: four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)),
    "gap at the start": lambda: four_bar(gap=(0, 40, Status.LOCKED)),
    "nowhere": lambda: four_bar(72, gap=(0, 72, Status.NOT_ASSEMBLED)), "one position": lambda: four_bar(1),
    "two positions": lambda: four_bar(2), "sliding drive": slider, "odd names": lambda: four_bar(90, rename=NASTY),
    "two drivers": lambda: four_bar(90).isel(driver=[0, 0]).assign_coords(driver=["A", "D"]),
}  # fmt: skip


@pytest.fixture(params=CASES)
def case(request):
    """(name, result) of every kind of result a view must bear."""
    return request.param, CASES[request.param]()
