"""What each method of a tolerance analysis does, in a paragraph with its source, for the report."""

from __future__ import annotations

__all__ = ["NOTES", "ON_SAMPLES"]

# method: heading, what was done
NOTES: dict[str, tuple[str, str]] = {
    "linear": (
        "Linear",
        "Sensitivities are derivatives of the measure by every toleranced number, carried exactly through motion and "
        "forces by dual numbers. The worst case adds their sizes times the limits; RSS is the root of the sum of the "
        "squares, with the means where the distributions have them. A clearance contributes through the load that "
        "the pin bears under a unit load at the measure.",
    ),
    "worst-case": (
        "Worst case by search",
        "The corner that the sensitivities point to is put into the nonlinear model and improved from there; the "
        "worst corner that was found is run again, and its figure is the one reported. A search finds a bad corner; "
        "it does not prove that none is worse.",
    ),
    "monte-carlo": (
        "Monte Carlo",
        "Each sample is a mechanism of its own, drawn from the distributions, assembled and run through the same "
        "analysis as the nominal one. The numbers come from a counter-based generator (Salmon et al., 2011, "
        "doi:10.1145/2063384.2063405), so that the same seed gives the same samples however the work is divided.",
    ),
    "quasi-monte-carlo": (
        "Quasi-Monte Carlo",
        "The samples are points of Sobol's sequence, which fill the space of the tolerances more evenly than random "
        "ones, scrambled for each of several replicates; the intervals come from the scatter between them by "
        "Student's t.",
    ),
    "sobol": (
        "Sobol indices",
        "The share of the variance due to a parameter alone, and with all its interactions (Sobol, 2001, "
        "doi:10.1016/S0378-4754(00)00270-6). They hold for large and nonlinear deviations, but assume independent "
        "numbers.",
    ),
}
ON_SAMPLES = (
    "Samples that cannot be assembled, lock or do not converge count as outside every limit; means, deviations and "
    "quantiles are those of the others. The interval of a yield is Wilson's (1927, "
    "doi:10.1080/01621459.1927.10502953), at 95 %. Cp compares the width of the limits with six standard deviations, "
    "Cpk the distance from the mean to the nearer limit with three."
)
