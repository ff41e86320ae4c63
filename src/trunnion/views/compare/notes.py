"""What the figures of a comparison mean, in paragraphs with their equations, for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.views.compare.comparison import coverage_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["definitions"]


def definitions(result: xr.Dataset) -> list[tuple[str, str]]:
    """(term, equation and meaning); the statement of uncertainty has the factor and the probability of this result."""
    factor, covered = float(result.attrs["coverage"]), coverage_of(result)
    found = [
        (
            "Mean and scatter",
            "ȳ(φ) = Σⱼ yⱼ(φ)/n and s(φ)² = Σⱼ (yⱼ(φ) − ȳ(φ))²/(n − 1), over the n turns j that have a value at the "
            "position φ of the cycle.",
        ),
        (
            "Standard uncertainty of the mean",
            "u² = s²/n + u₀² + (u_g ȳ)², with u₀ of the zero and u_g of the gain (relative) as stated for the "
            "sensor; the resolution is added where the scatter is less than half a step. s²/n is of type A, the "
            "others of type B (GUM 4.2, 4.3, 5.1). Zero and gain are the same at all positions; averaging does not "
            "reduce them.",
        ),
        (
            "Expanded uncertainty",
            f"U = k_p u with the coverage probability {covered}. k_p is Student's t for ν_eff = (n − 1) u⁴/(s²/n)² "
            f"degrees of freedom (Welch and Satterthwaite, GUM G.4.1): {factor:g} where turns are many or zero and "
            "gain prevail, more where turns are few.",
        ),
        (
            "Residual",
            "r(φ) = ȳ(φ) − m(φ), measured minus model m. RMS is √(Σ r²/N) over the N positions that are compared, "
            "largest the r of the largest magnitude, bias b = Σ r/N. The U of the bias is of the scatter of the means "
            "of the turns, of the zero and of the gain.",
        ),
        (
            "Verdict",
            f"Of a true model {covered} of the positions are expected within ±U. A signal is within ±U if its share is "
            "no less than this by more than 2.33 standard deviations of a share among as many independent "
            "positions as the turns show there are, N²/Σρᵢⱼ² (column “required”); ρ is the correlation of the "
            "errors of two positions. The verdict is “offset only” if r − b is, against the scatter "
            "and the gain alone.",
        ),
        (
            "Model",
            "The model is computed with the values of each condition and at the same positions. It counts as "
            "exact: the verdicts do not include the uncertainty of its parameters. Forces are not compared where "
            "a joint is momentarily at rest or a dead centre is close: friction is an interval there.",
        ),
    ]  # fmt: skip
    if "efficiency" in result:
        found.append(
            (
                "Efficiency",
                "η = P_out/P_in = T_out ω_out/(T_in ω_in), powers being means over the time of whole turns of torque "
                "times speed (Pezzuti et al. 2006, eq. 22). Its uncertainty is of the scatter of η between turns, and "
                "of zero, gain and resolution of every channel, each with its sensitivity (GUM 5.1). η of the model "
                "is computed from the model's signals in the same way.",
            )
        )
    return found
