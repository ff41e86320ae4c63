"""Names of a package that are loaded when first used, so that importing the package costs nothing."""

from __future__ import annotations

TYPE_CHECKING = False  # as a type checker takes it for True; `typing` itself is not needed to start

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from typing import Any


def loader(package: str, places: Mapping[str, tuple[str, str]], results: Collection[str] = ()) -> Callable[[str], Any]:
    """The `__getattr__` of a package.

    places: of each public name the module, and the name there, empty for the module itself. results: the names of
    functions that give results, which have the accessor `result.trunnion`.
    """

    def load(name: str) -> Any:
        from importlib import import_module

        if name not in places:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        if name in results:
            import_module("trunnion.accessor")
        module, attribute = places[name]
        return getattr(import_module(module), attribute) if attribute else import_module(module)

    return load
