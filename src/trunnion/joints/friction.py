"""Friction laws of a contact: tangential force from normal load and slip speed.

A law knows nothing of joints: `joints.pairs` turns a reaction into the normal load of the contact and the
friction force back into a moment about the pair. A new law is one function and one entry of `FRICTION_LAWS`;
the model's schema, its checks, the documentation and the contract tests read the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace

GONE = -700.0  # of which e^x leaves nothing of a coefficient, and which machine code still takes


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law: its unit (empty if none), default (None: must be given unless it is optional), range."""

    unit: str = ""
    default: float | None = None
    minimum: float = 0.0
    maximum: float = float("inf")
    meaning: str = ""
    optional: bool = False


class LawFunction(Protocol):
    """Tangential force (N) on the second body of a contact, from normal load (N) and slip speed (m/s).

    It is proportional to the normal load: what certifies that friction and reactions have one solution rests on it.
    """

    def __call__(self, normal: Number, slip: Number, **parameters: Number) -> Number: ...


class LawRelaxation(Protocol):
    """Rate at which bristles forget their deflection, 1/s, from the slip speed (m/s)."""

    def __call__(self, slip: Number, **parameters: Number) -> Number: ...


@dataclass(frozen=True)
class FrictionLaw:
    """A friction law with what it needs and where it comes from.

    function: `(normal, slip, **parameters) -> force`, odd in slip, dissipative, zero at zero load.
    interval_at_rest: whether at slip 0 the force may be anything up to its value beside 0.
    scale: the parameter that the force is proportional to, if there is one.
    relaxation: of a law with bristles, `(slip, **parameters)` → d in ż = slip − d z, 1/s. Their deflection z, m,
    depends on the slip alone; it is integrated along the cycle (`solve.bristles`) and given to the function as
    `deflection`. Without it the function takes that of steady sliding, slip/d.
    at_rest: of a law that jumps where sliding begins, its value at rest, to which the interval reaches; the same
    signature, with the slip about to begin. Without it that is the limit of the function.
    """

    function: LawFunction
    parameters: Mapping[str, LawParameter] = field(default_factory=dict)
    source: str = ""
    validity: str = ""
    interval_at_rest: bool = True
    relaxation: LawRelaxation | None = None
    scale: str = ""
    at_rest: LawFunction | None = None


def coulomb(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Coulomb friction of a pair: force = −sgn(slip) · pair_factor · coefficient · normal.  [D 8]

    normal: load of the contact ≥ 0, N; slip: speed of the second body against the first, m/s.
    The product f′ = pair_factor · coefficient is the coefficient of the pair; 4/3 of the material's is usual for
    a worn-in bearing (Baranov 1979, cited by [D]). At slip = 0 the force is an interval, here its middle, 0.
    """
    xp = namespace(normal, slip)
    return -xp.sign(slip) * (parameters.get("pair_factor", 1.0) * parameters["coefficient"]) * normal


def viscous(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Coulomb friction that grows with speed: −(sgn(v) f′ + c v) N, f′ = pair_factor · coefficient.

    The viscous part is stated per load (c in s/m), so that an unloaded contact does not resist.
    """
    return coulomb(normal, slip, **parameters) - parameters["viscous"] * slip * normal


def stiction_at_rest(normal: Number, slip: Number, **parameters: Number) -> Number:
    """The value at rest of a coefficient, f_s = static, that falls to f where sliding begins: −sgn(slip) f_s N."""
    return -namespace(normal, slip).sign(slip) * parameters["static"] * normal


def stribeck(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Friction that falls from rest to sliding and rises with speed:
    −sgn(v) [f + (f_s − f) exp(−(v/v_s)²) + c |v|] N, f = coefficient, f_s = static.
    """
    xp = namespace(normal, slip, *parameters.values())
    return -(xp.sign(slip) * _stribeck_curve(slip, parameters) + parameters["viscous"] * slip) * normal


def brown_mcphee(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Friction that is a smooth function of speed, with a peak near the transition speed v_t:
    −N [f tanh(4 r) + (f_s − f) r/(r²/4 + 3/4)² + c v], r = v/v_t, f = coefficient, f_s = static.
    """
    xp = namespace(normal, slip, *parameters.values())
    f, static = parameters["coefficient"], parameters["static"]
    ratio = slip / parameters["transition_speed"]
    bell = ratio * ratio / 4 + 0.75
    return -(f * xp.tanh(4 * ratio) + (static - f) * ratio / (bell * bell) + parameters["viscous"] * slip) * normal


def dahl(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Friction with memory, a function of the path alone: −κ z N with ż = v − (κ/f) |v| z, f = coefficient.

    From rest the force rises as f N (1 − exp(−κ x/f)) over the way x. κ (stiffness) is the stiffness of the contact per
    load, 1/m, so that f/κ is the way over which the friction turns round.
    """
    stiffness = parameters["stiffness"]
    deflection = parameters.get("deflection")
    if deflection is None:
        deflection = namespace(slip).sign(slip) * parameters["coefficient"] / stiffness
    return -stiffness * deflection * normal


def dahl_relaxation(slip: Number, **parameters: Number) -> Number:
    """(κ/f) |v|."""
    return namespace(slip).abs(slip) * (parameters["stiffness"] / parameters["coefficient"])


def lugre(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Bristles that also slide by Stribeck's curve: −(κ z + σ ż + c v) N with ż = v − κ |v| z/g(v),
    g(v) = f + (f_s − f) exp(−(v/v_s)²), f = coefficient, f_s = static.

    In steady sliding it is −sgn(v) g(v) N − c v N. κ, σ and c are stated per load, 1/m and s/m.
    """
    stiffness, decay = parameters["stiffness"], lugre_relaxation(slip, **parameters)
    deflection = parameters.get("deflection")
    if deflection is None:
        steady = namespace(slip).sign(slip) * _stribeck_curve(slip, parameters)
        return -(steady + parameters["viscous"] * slip) * normal
    rate = slip - decay * deflection
    return -(stiffness * deflection + parameters["damping"] * rate + parameters["viscous"] * slip) * normal


def lugre_relaxation(slip: Number, **parameters: Number) -> Number:
    """κ |v|/g(v)."""
    return namespace(slip).abs(slip) * parameters["stiffness"] / _stribeck_curve(slip, parameters)


def _stribeck_curve(slip: Number, parameters: Mapping[str, Number]) -> Number:
    """Coefficient of steady sliding without its viscous part."""
    f, ratio = parameters["coefficient"], slip / parameters["stribeck_speed"]
    xp = namespace(ratio)
    return f + (parameters["static"] - f) * xp.exp(xp.maximum(-(ratio * ratio), GONE))


def rolling(normal: Number, slip: Number, **parameters: Number) -> Number:
    """Rolling friction with a lever arm f: a moment f N against the rate; −sgn(v) N at the lever f."""
    xp = namespace(normal, slip)
    return -xp.sign(slip) * normal


def directed(parameters: Mapping[str, Number], slip: Number) -> Mapping[str, Number]:
    """The parameters of a law for a slip: where that is negative `backward` stands for the coefficient, if stated."""
    if "backward" not in parameters:
        return parameters
    forward, backward = parameters["coefficient"], parameters["backward"]
    xp = namespace(slip, forward, backward)
    return {**parameters, "coefficient": xp.where(primal(slip) < 0, backward, forward)}


_COEFFICIENT = LawParameter(meaning="friction coefficient of sliding")
_BACKWARD = LawParameter(meaning="coefficient of negative rates; that of positive ones if not stated", optional=True)
_STATIC = LawParameter(meaning="friction coefficient at rest, not below that of sliding")
_PAIR_FACTOR = LawParameter(
    default=1.0, meaning="factor from the material's coefficient to the pair's (4/3 when worn in)"
)
_BRISTLED = LawParameter(minimum=1e-12, meaning="friction coefficient of sliding")
_STRIBECK_SPEED = LawParameter("m/s", minimum=1e-12, meaning="speed at which the peak at rest has decayed")
_VISCOUS = LawParameter("s/m", default=0.0, meaning="growth of the coefficient with the slip speed")

FRICTION_LAWS: dict[str, FrictionLaw] = {
    "coulomb": FrictionLaw(
        coulomb,
        {
            "coefficient": LawParameter(meaning="friction coefficient of the material pairing"),
            "backward": _BACKWARD,
            "pair_factor": _PAIR_FACTOR,
        },
        source="Durango, Calle, Ruiz (2010), eq. 8",
        validity="dry or boundary-lubricated sliding; speed-independent",
        scale="coefficient",
    ),
    "viscous": FrictionLaw(
        viscous,
        {
            "coefficient": _COEFFICIENT,
            "backward": _BACKWARD,
            "pair_factor": _PAIR_FACTOR,
            "viscous": LawParameter("s/m", meaning="growth of the coefficient with the slip speed"),
        },
        source="H. Olsson et al., Eur. J. Control 4 (1998) 176-195, doi:10.1016/S0947-3580(98)70113-X",
        validity="lubricated sliding; the viscous part is assumed proportional to the load",
    ),
    "stiction": FrictionLaw(
        coulomb,
        {"coefficient": _COEFFICIENT, "static": _STATIC},
        source="B. Armstrong-Hélouvry et al., Automatica 30 (1994) 1083-1138, doi:10.1016/0005-1098(94)90209-7",
        validity="dry sliding that begins with a jerk; speed-independent; the coefficient at rest counts at rest alone",
        at_rest=stiction_at_rest,
    ),
    "stribeck": FrictionLaw(
        stribeck,
        {"coefficient": _COEFFICIENT, "static": _STATIC, "stribeck_speed": _STRIBECK_SPEED, "viscous": _VISCOUS},
        source="B. Armstrong-Hélouvry et al., Automatica 30 (1994) 1083-1138, doi:10.1016/0005-1098(94)90209-7",
        validity="boundary to mixed lubrication in steady sliding; no memory",
    ),
    "brown-mcphee": FrictionLaw(
        brown_mcphee,
        {
            "coefficient": _COEFFICIENT,
            "static": _STATIC,
            "transition_speed": LawParameter("m/s", minimum=1e-12, meaning="speed near which friction peaks"),
            "viscous": _VISCOUS,
        },
        source="P. Brown, J. McPhee, J. Comput. Nonlinear Dyn. 11 (2016) 054502, doi:10.1115/1.4033658",
        validity="steady or slowly varying sliding; creeps instead of sticking below the transition speed",
        interval_at_rest=False,
    ),
    "dahl": FrictionLaw(
        dahl,
        {
            "coefficient": _BRISTLED,
            "stiffness": LawParameter("1/m", minimum=1e-6, meaning="stiffness of the contact per load"),
        },
        source="P. R. Dahl, A solid friction model, Aerospace Corporation, TOR-0158(3107-18)-1, 1968",
        validity="presliding and reversals without Stribeck effect; a change of load acts at once",
        interval_at_rest=False,
        relaxation=dahl_relaxation,
    ),
    "lugre": FrictionLaw(
        lugre,
        {
            "coefficient": _BRISTLED,
            "static": _STATIC,
            "stribeck_speed": _STRIBECK_SPEED,
            "stiffness": LawParameter("1/m", minimum=1e-6, meaning="stiffness of the contact per load"),
            "damping": LawParameter("s/m", default=0.0, meaning="damping of the bristles per load"),
            "viscous": _VISCOUS,
        },
        source="C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) 419-425, doi:10.1109/9.376053",
        validity="boundary to mixed lubrication with reversals; a change of load acts at once",
        interval_at_rest=False,
        relaxation=lugre_relaxation,
    ),
    "rolling-bearing": FrictionLaw(
        coulomb,
        {
            "coefficient": LawParameter(
                default=0.0015, meaning="bearing's friction coefficient; 0.0015: deep groove ball"
            )
        },
        source="SKF, Rolling bearings, estimating the frictional moment: M = 0.5 μ P d, d the bore, 2 radius; μ from "
        "0.001 (self-aligning ball) to 0.0025 (cage-less needle roller)",
        validity="load about 0.1 of the dynamic rating, good lubrication, normal speed",
        scale="coefficient",
    ),
    "rolling": FrictionLaw(
        rolling,
        {"arm": LawParameter("m", meaning="lever arm of rolling friction: moment over normal load")},
        source="C. A. Coulomb, Théorie des machines simples, 1785",
        validity="wheels and rollers in revolute joints; a pin of the radius r with the coefficient arm/r is the same",
        scale="arm",
    ),
}
