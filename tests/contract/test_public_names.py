"""The public names: few, typed, documented, with one name for one argument; old names warn."""

import inspect
import subprocess
import sys

import pytest

import trunnion
from mechanisms import MODELS
from trunnion.accessor import Accessor

FUNCTIONS = {
    prefix + name: getattr(module, name)
    for prefix, module in (("", trunnion), ("rig.", trunnion.rig))
    for name in module.__all__
    if inspect.isroutine(getattr(module, name))
}
# where a default is another for a reason
OTHERWISE = {
    ("simulate", "steps"),  # many turns, where the others have one
    ("simulate", "progress"),  # told a time
}


def test_the_names_fit_one_page():
    assert len(trunnion.__all__) <= 20
    assert all(hasattr(trunnion, name) for name in trunnion.__all__)
    assert set(dir(trunnion)) == {*trunnion.__all__, "__version__"}


def test_an_argument_is_the_same_in_every_function():
    """The same name has the same meaning: one annotation and one default."""
    seen = {}
    for function, made in FUNCTIONS.items():
        for name, one in inspect.signature(made).parameters.items():
            if one.kind is inspect.Parameter.VAR_KEYWORD or (function, name) in OTHERWISE:
                continue
            known = seen.setdefault(name, (function, str(one.annotation), one.default))
            assert (str(one.annotation), one.default) == known[1:], f"{name} of {function} and of {known[0]}"


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_a_public_function_is_typed_and_told(name):
    """Every argument has a type and a word in the docstring; what can be wrong with it is said there."""
    signature = inspect.signature(FUNCTIONS[name])
    told = inspect.getdoc(FUNCTIONS[name]) or ""
    assert signature.return_annotation is not inspect.Signature.empty
    for argument, one in signature.parameters.items():
        assert one.annotation is not inspect.Parameter.empty
        if argument not in ("mechanism", "measurement", "result", "path", "of"):
            assert argument in told, f"{argument} of {name} is not told"
    assert "Raises" in told or "MechanismError" in told


CLASSES = [trunnion.Mechanism, trunnion.FrictionMethod, trunnion.rig.Observation, Accessor]
METHODS = {
    f"{made.__name__}.{name}": getattr(made, name)
    for made in CLASSES
    for name, member in vars(made).items()
    if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, classmethod))
}


@pytest.mark.parametrize("name", [*sorted(FUNCTIONS), *sorted(METHODS), "FrictionMethod"])
def test_an_unknown_keyword_names_the_nearest(name):
    public = {**FUNCTIONS, **METHODS, "FrictionMethod": trunnion.FrictionMethod}[name]
    parameters = inspect.signature(public).parameters.values()
    known = [one.name for one in parameters if one.kind is not one.VAR_KEYWORD and one.name not in ("self", "cls")]
    if any(one.kind is one.VAR_KEYWORD for one in parameters):
        return  # options of a view, see below
    for argument in known:
        with pytest.raises(TypeError, match=f"takes no argument '{argument}_' — did you mean .*'{argument}'"):
            public(**{f"{argument}_": None})
    with pytest.raises(TypeError, match="no argument 'friction'"):
        public(friction="off")


@pytest.mark.parametrize("model", ["durango-fourbar", "rssr"])
def test_friction_is_not_switched_off_by_a_keyword(model):
    mechanism = trunnion.read(f"examples/{model}.yaml")
    for verb in (trunnion.analyse, trunnion.sweep, trunnion.tolerance, trunnion.allocate, trunnion.rig.compare):
        with pytest.raises(TypeError, match=r"give it mechanism.with_friction\('off'\)"):
            verb(mechanism, friction="off")
    with pytest.raises(TypeError, match=r"takes FrictionMethod.*; mechanism.with_friction\('off'\)"):
        trunnion.analyse(mechanism, friction_method="off")
    with pytest.raises(trunnion.MechanismError, match="no method 'off'"):
        trunnion.FrictionMethod("off")


WRONG = {
    "a text for a number": (lambda m: trunnion.analyse(m, steps="9"), TypeError, r"analyse\(steps='9'\) takes int"),
    "a broken count": (lambda m: trunnion.locking(m, 2.5), TypeError, r"locking\(steps=2.5\) takes int"),
    "a truth value for a count": (lambda m: trunnion.tolerance(m, seed=True), TypeError, "takes int"),
    "a text for a truth value": (lambda m: trunnion.sweep(m, {}, margin="no"), TypeError, "takes bool"),
    "a word for a method": (
        lambda m: trunnion.analyse(m, friction_method="newton"), TypeError, "takes FrictionMethod.*; mechanism.with_fr",
    ),
    "a path for a mechanism": (lambda m: trunnion.simulate("a.yaml"), TypeError, r"Mechanism: trunnion.read\(FILE\)"),
    "a time with its unit": (lambda m: trunnion.simulate(m, "1 s"), TypeError, r"duration='1 s'\) takes float"),
    "one too many": (lambda m: m.with_values({}, 3, 4, 5), TypeError, r"with_values\(\): too many positional"),
    "a number for a function": (lambda m: trunnion.analyse(m, progress=3), TypeError, "takes Callable"),
    "pairs for a mapping": (lambda m: m.with_values([("r", 1)]), TypeError, r"with_values\(values=.*takes Mapping"),
    "points for a file": (lambda m: m.with_table("A", [(0, 0)]), TypeError, r"takes str \| PathLike"),
    "nothing for a file": (lambda m: trunnion.read(None), TypeError, r"path=None\) takes str \| PathLike"),
    "numbers for names": (lambda m: trunnion.play(m, [3]), TypeError, r"measures=\[3\]\) takes Sequence\[str"),
    "a word that is no choice": (
        lambda m: trunnion.assemble(m, uniform="pinz"), trunnion.MechanismError, "'pinz' — use pins or all",
    ),
    "a method that there is not": (
        lambda m: trunnion.tolerance(m, methods="linnear"), trunnion.MechanismError, "no method 'linnear' — use",
    ),
    "no method": (lambda m: trunnion.tolerance(m, methods=[]), trunnion.MechanismError, "no method is chosen"),
    "no measure": (lambda m: trunnion.tolerance(m, []), trunnion.MechanismError, "no measure is named"),
    "degrees without a unit": (
        lambda m: trunnion.tolerance(m, at=60), trunnion.MechanismError, "at: is 60 rad, .* write 60 deg if",
    ),
    "a place beside a figure of its own": (
        lambda m: trunnion.tolerance(m, ["maximum:rotation:D"], at="60 deg"), trunnion.MechanismError,
        "at: every measure has a place, a window or a figure of its own",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_refused_by_name(name):
    call, kind, words = WRONG[name]
    with pytest.raises(kind, match=words):
        call(trunnion.read("examples/toleranced-fourbar.yaml"))


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_nothing_is_no_mechanism_and_no_file(name):
    """Every public function checks its arguments."""
    with pytest.raises(TypeError, match=r"\(.*=None\) takes "):
        FUNCTIONS[name](None)


@pytest.mark.parametrize("keyword", [{"columns": ["all"]}, {"units_row": True}, {"units": "model"}])
def test_what_is_said_of_a_file_needs_one(keyword, tmp_path):
    mechanism = trunnion.Mechanism(**MODELS["four-bar"]())
    with pytest.raises(trunnion.MechanismError, match="no effect without a file"):
        trunnion.analyse(mechanism, 6, **keyword)
    trunnion.analyse(mechanism, 6, out=tmp_path / "cycle.csv", **keyword)
    assert (tmp_path / "cycle.csv").exists()


@pytest.mark.parametrize("verb", ["check", "analyse", "locking"])
def test_progress_is_told_to_the_end(verb):
    done = []
    getattr(trunnion, verb)(trunnion.Mechanism(**MODELS["four-bar"]()), 6, progress=done.append)
    assert done[-1] == 6


def test_importing_the_package_loads_nothing():
    script = "import sys, trunnion, trunnion.rig; print(len({'numpy', 'xarray', 'pydantic'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "0"
