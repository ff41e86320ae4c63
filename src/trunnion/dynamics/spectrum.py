"""Amplitude spectrum of the contact forces of a motion in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal.windows import hann

from trunnion.results.dataset import Variable

__all__ = ["FEWEST", "FREQUENCY", "SPECTRUM", "spectrum"]

Array = NDArray[np.float64]

FEWEST = 16  # rows from which there is a spectrum
SPECTRUM: dict[str, Variable] = {
    "contact_force_amplitude": Variable(
        ("contact", "frequency"), "N", "amplitude of the normal force by frequency, with Hann's window"
    )
}
FREQUENCY = Variable(("frequency",), "Hz", "frequency")


def spectrum(time: Array, forces: Array) -> tuple[Array, Array]:
    """Frequencies, Hz, and one-sided amplitudes, N, (…, frequency), of forces (…, time) at equally spaced times, s.

    A_k = 2 |Σ w_n F_n e^(−2πi kn/N)| / Σ w_n, half of it at 0 and at half the rate of the rows, with Hann's window w: a
    harmonic of amplitude A that lies on a frequency has A there and A/2 at its two neighbours. Source: F. J. Harris, On
    the use of windows for harmonic analysis with the discrete Fourier transform, Proc. IEEE 66 (1978) 51-83,
    doi:10.1109/PROC.1978.10837.
    """
    count = len(time)
    window = hann(count, sym=False)
    amplitude = 2.0 * np.abs(np.fft.rfft(forces * window, axis=-1)) / np.sum(window)
    amplitude[..., 0] *= 0.5
    if count % 2 == 0:
        amplitude[..., -1] *= 0.5
    return np.fft.rfftfreq(count, (time[-1] - time[0]) / (count - 1)), amplitude
