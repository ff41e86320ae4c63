"""The four-bar of Durango, Calle and Ruiz (2010), Table 1, in plain SI numbers, and its reference values.

Link 1 is the crank AB, 2 the coupler (triangle B, C, E), 3 the rocker DC; A is the origin, D lies on the x axis.
"""

from __future__ import annotations

from math import cos, pi, sin

AB, BC, CD, AD = 2.0, 6.0, 3.0, 5.5
M1, M2, M3 = 4.8, 30.0, 7.2  # kg
J1, J2, J3 = 1.70, 48.80, 5.50  # about the centres of mass, kg m²
S1 = 1.0  # centre of the crank on AB
S2_X, S2_Y = 2.8 * cos(0.152), 2.8 * sin(0.152)  # centre of the coupler in its frame (origin B, x to C)
S3 = 1.5  # centre of the rocker on DC
E_X, E_Y = 2.5 * cos(pi / 6), 2.5 * sin(pi / 6)  # point of the load, in the coupler's frame
FE_X, FE_Y = 0.0, -1000.0  # N at E
M3_APPLIED = -250.0  # N m on the rocker
FRICTION_RADIUS = 0.40 * 0.0075  # f′ r of every pin, m
OMEGA1 = 10.0  # rad/s

# Values computed for the project (theory sheet, section 7), at a crank angle of 60°
TORQUE_60 = 3393.503681
TORQUE_60_FRICTIONLESS = 3364.879649
FRICTION_POWER_60 = 286.240327
REACTIONS_60 = {
    "A": (-3388.683339, -2499.828824),
    "B": (-3148.683339, -2084.136630),
    "C": (229.965844, 905.533667),
    "D": (-639.235315, -1207.667824),
}
# Extremes over the 1° grid (torque: crank angle in degrees, N m) and the mean and peak friction power (W)
TORQUE_FRICTIONLESS_RANGE = ((350, -18747.140121), (24, 9177.173578))
TORQUE_RANGE = (-18552.874991, 9288.302313)
FRICTION_POWER_MEAN = 517.465106
FRICTION_POWER_MAX = (358, 2375.340)
