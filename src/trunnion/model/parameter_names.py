"""Names of numbers as people write them: a path, a dimension, or an ending that only one path has."""

from __future__ import annotations

from collections.abc import Iterable

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import as_key, nearest

__all__ = ["ERRORS", "ParameterNames"]

SHORT_FORM = "coefficient"  # what a plain number as friction states
ERRORS = "errors."  # before the path of a number: that of its deviation


class ParameterNames:
    """The paths of a model's numbers, found by shorter names."""

    def __init__(self, paths: Iterable[str]) -> None:
        self.all = dict.fromkeys(paths)
        # a deviation is named by what it shifts: its own endings would only make those of the numbers ambiguous
        self.paths = [path for path in self.all if not path.startswith(ERRORS)]
        self._endings: dict[str, list[str]] | None = None

    def resolve(self, name: str) -> str:
        """The path that a name means; MechanismError names the nearest if there is none or several."""
        if name in self.all:
            return name
        if f"dimensions.{name}" in self.all:
            return f"dimensions.{name}"
        paths = self.endings.get(name, [])
        if len(paths) == 1:
            return paths[0]
        if not paths and name.startswith(ERRORS):
            return self._error(name)
        if paths:
            some = ", ".join(paths[:6]) + (", …" if len(paths) > 6 else "")
            raise MechanismError(
                Finding(f"the name '{name}' stands for {len(paths)} numbers", remedy=f"say which: {some}")
            )
        below = [path for path in self.paths if f".{path}.".find(f".{name}.") >= 0]
        short = [path for path in below if path.endswith(f"{name}.{SHORT_FORM}")]
        if len(short) == 1 and name.endswith("friction"):  # `friction: 0.1` in a file is the coefficient, so here too
            return short[0]
        if below and name == "friction":
            joint = next(path for path in below if path.startswith("joints.")).split(".")[1]
            remedy = f"set joint_defaults.friction, or that of one joint, such as {joint}.friction"
            raise MechanismError(Finding(f"'{name}' is not one number", remedy=remedy))
        if below:
            some = ", ".join(below[:6]) + (", …" if len(below) > 6 else "")
            raise MechanismError(Finding(f"'{name}' is not one number", remedy=f"set one of {some}"))
        dimensions = [path.partition(".")[2] for path in self.paths if path.startswith("dimensions.")]
        # a short name is most likely a mistyped dimension; endings such as `x` resemble everything
        every = [*self.paths, *self.endings]
        remedy = nearest(name, every if "." in name or not dimensions else dimensions)
        if not remedy.startswith("did you mean"):
            longer = [one for one in self.endings if len(one) > 2 and "." not in one]
            remedy = near if (near := nearest(name, longer)).startswith("did you mean") else remedy
        raise MechanismError(Finding(f"there is no number named '{name}'", remedy=remedy))

    def _error(self, name: str) -> str:
        """The path of the deviation of a number by a name of that number."""
        path = self.resolve(name.removeprefix(ERRORS))
        if f"{ERRORS}{path}" not in self.all:
            what = f"the model states no error of '{path}'"
            raise MechanismError(Finding(what, remedy=f"state it in the file: errors: {{{as_key(path)}: …}}"))
        return f"{ERRORS}{path}"

    @property
    def endings(self) -> dict[str, list[str]]:
        """Paths by every ending they have."""
        if self._endings is None:
            self._endings = {}
            for path in self.paths:
                parts = path.split(".")
                for start in range(1, len(parts)):
                    self._endings.setdefault(".".join(parts[start:]), []).append(path)
        return self._endings
