"""A result before it is an xarray Dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Result"]


@dataclass(frozen=True)
class Result:
    """What a result says, and how its numbers become a Dataset.

    Loading xarray takes as long as a small analysis: what prints a summary and findings alone reads `attrs`.
    attrs: those of the Dataset, see `results.attributes`; build: makes the Dataset, called once.
    """

    attrs: Mapping[str, Any]
    build: Callable[[], xr.Dataset]

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The numbers with dimensions, units, labels and attributes."""
        return self.build()
