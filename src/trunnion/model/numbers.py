"""The numbers of a model: every one by its path, compiled once."""

from __future__ import annotations

from functools import cached_property

from trunnion.model.fields import Fields
from trunnion.model.parameters import Entry, ParameterSet, entries

__all__ = ["Numbers"]


class Numbers(Fields):
    """A model with its numbers by path. Checks, tolerances and prices read it; `Mechanism` is one that is sound."""

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Every number of the mechanism and where it stands, defaults filled in; see `model.parameters.entries`."""
        return tuple(entries(self))

    @cached_property
    def parameter_set(self) -> ParameterSet:
        """The numbers of the mechanism, compiled once."""
        return ParameterSet(self.entries, self.dimensions)
