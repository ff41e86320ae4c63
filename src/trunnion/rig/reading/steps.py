"""The error by steps between readings that all turns repeat, which averaging over turns leaves.

Of readings rounded to steps q, with noise σ before, the mean is off by a wave over the steps, whose harmonic k has the
amplitude q/(πk) exp(−2π²k²σ²/q²) (Widrow and Kollár 2008, doi:10.1017/CBO9780511754661). It repeats where turns are
sampled at the same places of a step. Here all in steps.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.rig.reading.turns import DENSE, Turns

__all__ = ["LeftOfSteps", "covariance_of_steps", "in_step", "left_in_turns", "left_of_steps", "noise_before"]

Array = NDArray[np.float64]
ALIKE = 0.9  # of 1, from which every turn is sampled at the same places
HARMONICS = 10  # of the wave, that are looked at
PLACES = 8  # of the first sample of a turn, between two
_K = np.arange(1.0, 200.0)
_NOISE = np.linspace(0.0, 1.0, 1001)  # σ/q


@dataclass(frozen=True)
class LeftOfSteps:
    """What all turns repeat of the error by steps.

    share: its standard deviation, of step/√12; noise: σ, in steps; samples: of a turn; every: whether every turn is
    sampled at the same places.
    """

    share: float
    noise: float
    samples: float
    every: bool


def left_in_turns(turns: Turns, course: Array, readings: Array, noise: float) -> LeftOfSteps:
    """How much of the error by steps is the same in all turns.

    course: (turn, position); readings: one a row of the file; both in steps; noise: scatter of the readings from row to
    row, in steps, with the error by steps in it unless the course stays within one.
    """
    share, samples = in_step(turns, course), float(np.median(turns.end - turns.begin)) / turns.line.step
    every = share > ALIKE
    if every:  # then what a reading differs by from that a turn later is noise
        rows = np.where(turns.rows, readings, np.nan)
        later = max(round(samples), 1)  # the next row, where a turn is shorter than half a row
        apart = rows[later:] - rows[:-later]
        apart = apart[np.isfinite(apart)]
        noise = noise_before(float(np.sqrt(np.mean(apart**2) / 2))) if apart.size else 0.0
    else:
        noise = float(np.sqrt(max(noise**2 - 1 / 12, 0.0)))
    return LeftOfSteps(float(np.sqrt(share * left_of_steps(noise))), noise, samples, every)


def left_of_steps(noise: Array | float) -> Array:
    """Mean square of the wave, of q²/12, for noise in steps: 1 without, 0 of half a step and more."""
    waves = np.exp(-4 * (np.pi * np.asarray(noise)[..., None] * _K) ** 2) / _K**2
    return np.asarray(np.sum(waves, axis=-1) / np.sum(1 / _K**2))


def noise_before(scatter: float) -> float:
    """σ/q of readings that scatter so much, in steps, where they repeat: scatter² = σ² + (1 − left)/12."""
    return float(np.interp(scatter, np.sqrt(_NOISE**2 + (1 - left_of_steps(_NOISE)) / 12), _NOISE))


def in_step(turns: Turns, course: Array) -> float:
    """How far turns are sampled at the same places of a step, 0 to 1; course: (turn, position), in steps.

    At a position the samples next to it are off it by a part of a position, and along the slope of the course by a part
    of a step: |mean of exp(2πi part)|², less what chance makes of n turns.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of positions without a value
        mean = np.nan_to_num(np.nanmean(course, axis=0))
    slope = 0.5 * (np.roll(mean, -1) - np.roll(mean, 1))
    scaled = turns.share[turns.rows] * turns.positions
    place = np.floor(scaled + 0.5)
    off = scaled - place
    order = np.lexsort((np.abs(off), place))
    nearest = order[np.diff(place[order], prepend=-np.inf) > 0]
    at = place[nearest].astype(np.int64) % turns.positions
    angle = 2 * np.pi * slope[at] * off[nearest]
    count = np.bincount(at, minlength=turns.positions)
    many = count > 1
    if not many.any():
        return 1.0
    parts = (np.bincount(at, component, count.size) for component in (np.cos(angle), np.sin(angle)))
    alike = (sum(part[many] ** 2 for part in parts) / count[many] - 1) / (count[many] - 1)
    return float(np.clip(np.mean(alike), 0.0, 1.0))


def covariance_of_steps(columns: Array, course: Array, left: LeftOfSteps) -> Array:
    """Covariance of sums over positions of columns · error by steps, in units of the step.

    columns: (sum, position); course: true, (position,), in steps. Where the course gains about a whole number of steps
    from sample to sample, as it may beside its steepest places, the errors of many samples are alike. The mean is taken
    over all places in a step, for each harmonic of the wave by itself, and some of the first sample in a turn.
    """
    size, count, grid = course.size, round(left.samples), np.arange(course.size)
    powers = np.exp(-4 * (np.pi * left.noise * _K[:HARMONICS]) ** 2) / (_K[:HARMONICS] * np.pi) ** 2 / 2
    total = np.zeros((len(columns), len(columns)))
    for first in (np.arange(PLACES) + 0.5) / PLACES:
        place = (np.arange(-2, count + 2) + first) / left.samples * size
        at = np.interp(place, np.arange(size), course, period=size)
        for k, power in enumerate(powers, 1):
            wave = np.exp(2j * np.pi * k * at)
            if left.samples < DENSE * size:
                error = np.interp(grid, place, wave)
            else:
                part = np.round(place).astype(np.int64) % grid.size
                error = np.bincount(part, wave.real, grid.size) + 1j * np.bincount(part, wave.imag, grid.size)
                error = error / np.bincount(part, minlength=grid.size)
            moved = columns @ error
            total += power / PLACES * np.real(np.outer(moved, moved.conj()))
    return total
