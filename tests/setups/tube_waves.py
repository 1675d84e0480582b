"""Linear waves along a thin elastic tube full of an ideal fluid.

A shell of thickness h and middle radius R = a + h/2 moves by W along r and U along z, as e^{i (k z - omega t)}:

    (D s / R^2 - m omega^2) W + i nu D k U / R = (a / R) p,    (D k^2 - m omega^2) U = i nu D k W / R,
    D = E h / (1 - nu^2),   m = density h,   s = nu^2 + (1 - nu^2) / (1 + delta),   delta = h^2 / (4 R^2) + nu h / R.

p acts on the inner surface, which is a / R of the middle one. s has the compliance of a thick ring (Lame). The fluid
has p = I_0(k r) at the pressure 1 on the axis, and the velocity k I_1(k a) / (i omega rho) at the wall.
Source: T. J. Pedley, The Fluid Mechanics of Large Blood Vessels, Cambridge 1980, section 2.1; Timoshenko, Goodier,
Theory of Elasticity, section 28 (ring).
"""

import numpy as np
from scipy.special import iv

RADIUS, WALL, E, NU, DENSITY, FLUID = 1.0, 0.09, 23.22, 0.3, 1.0, 1.0
LARGEST, LENGTH = 2e-3, 8.0  #: pressure at the inlet: its mean [Pa] is LARGEST sin^2(pi t / LENGTH) for a LENGTH [s]


def missed(k, omega):
    """Missing radial force of the shell at the wave number k."""
    R, m, D = RADIUS + WALL / 2, DENSITY * WALL, E * WALL / (1 - NU**2)
    delta = WALL**2 / (4 * R**2) + NU * WALL / R
    s = NU**2 + (1 - NU**2) / (1 + delta)
    p, W = iv(0, k * RADIUS), k * iv(1, k * RADIUS) / (omega**2 * FLUID)
    U = 1j * NU * D * k * W / R / (D * k**2 - omega**2 * m)
    return (D * s / R**2 - m * omega**2) * W + (1j * NU * D * k * U / R).real - RADIUS / R * p


def wave_number(omega, start):
    """k [1/m] of the pulse's wave by the secant method."""
    a, b = start, 1.001 * start
    fa, fb = missed(a, omega), missed(b, omega)
    while abs(b - a) > 1e-13 * abs(b) and fa != fb:
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        fb = missed(b, omega)
    return b


def pressure_on_axis(z, span=400.0, count=8000):
    """(times [s], pressure [Pa]) at a distance z [m] from the inlet, whose mean pressure is given."""
    t = np.arange(count) * span / count
    parts = np.fft.rfft(np.where(t < LENGTH, LARGEST * np.sin(np.pi * t / LENGTH) ** 2, 0.0))
    omega, k, carried = 2 * np.pi * np.arange(len(parts)) / span, 0.0, np.zeros_like(parts)
    carried[0] = parts[0]
    for i in range(1, int(np.searchsorted(omega, 4 * np.pi / LENGTH * 2))):
        k = wave_number(omega[i], k * omega[i] / omega[i - 1] if k else omega[i])
        mean = 2 * iv(1, k * RADIUS) / (k * RADIUS)  # over the section, for 1 on the axis
        carried[i] = parts[i] * np.exp(-1j * k * z) / mean
    return t, np.fft.irfft(carried, count)
