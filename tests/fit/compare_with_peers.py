#!/usr/bin/env python3
"""The same fit by scipy and by lmfit: 100 bins, T and shift free, Enskog's curve over the rectangle, densities at points.
The peers get every help: the true values to start from, f inverted by a table and vectorised Newton steps in numpy, errors and derivatives
known.
Values are compared to 1e-8, times as medians. Needs python3-scipy and python3-lmfit (Debian 12); nothing else here does.

usage: compare_with_peers.py BUILD/tests/fit/fit_once
"""
import statistics
import subprocess
import sys
import time

import lmfit
import numpy as np
from scipy.optimize import curve_fit

HALF_PI = np.pi / 2
A, A1, A2 = 0.489351 * HALF_PI, 0.196703 * HALF_PI, 0.006519 * HALF_PI**2
C1 = 2 * HALF_PI * A2 / A**2
C2 = -HALF_PI * (A1 - 2 * A2 / A) / A**2
C4 = HALF_PI * (1 - A1 / A + A2 / A**2) / A


def f(phi):
    d = 1 - A * phi
    return np.log(phi) + C1 * phi + C2 * np.log(d) - C2 / d + C4 / d**2


def phi_times_slope(phi):
    d = 1 - A * phi
    return 1 + phi * (C1 - C2 * A / d - C2 * A / d**2 + 2 * C4 * A / d**3)


GRID = np.concatenate([np.exp(np.linspace(-40, -2, 2000)), np.linspace(0.136, 1.15470053, 4000)])
GRID_F = f(GRID)


def density_of_f(target):
    phi = np.interp(target, GRID_F, GRID, left=1e-30)
    for _ in range(3):
        phi = phi * np.exp((target - f(phi)) / phi_times_slope(phi))
    return phi


def curve(height, temperature, shift, plateau):
    above = height > shift
    density = np.full(height.shape, plateau)
    if np.any(above):
        density[above] = density_of_f(f(plateau) - (height[above] - shift) / temperature)
    return density


def slopes(height, temperature, shift, plateau):
    """d/dT and d/dshift"""
    density = curve(height, temperature, shift, plateau)
    slope = np.where(height > shift, density / phi_times_slope(density), 0.0) / temperature
    return np.stack([slope * (height - shift) / temperature, slope], axis=1)


def median_time(work, repeats):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    random = np.random.default_rng(5)
    worst = 0.0
    print(f"scipy {__import__('scipy').__version__}, lmfit {lmfit.__version__}; 100 bins; relative differences")
    print(f"{'T':>6} {'scipy: T':>10} {'error':>9} {'lmfit: T':>10} {'ours':>10} {'scipy':>10} {'lmfit':>10}")
    for temperature, shift, plateau in ((0.12, 5.0, 1.10), (0.5, 3.0, 1.10), (3.0, 1.0, 1.10), (0.12, 5.0, 1.15)):
        height = np.linspace(2.0, shift + 65 * temperature, 100)  # f falls by 60 from plateau to gas
        truth = curve(height, temperature, shift, plateau)
        error = 0.01 * np.sqrt(truth + 1e-4)
        data = truth + error * random.standard_normal(height.size)
        text = f"{plateau!r} {height[0]!r} {height[-1]!r}\n"
        text += "".join(f"{float(h)!r} {float(d)!r} {float(e)!r}\n" for h, d, e in zip(height, data, error))
        ours = subprocess.run([sys.argv[1]], input=text, stdout=subprocess.PIPE, text=True, check=True)
        t, t_error, s, s_error, seconds = (float(x) for x in ours.stdout.split())

        def model(z, temperature, shift):
            return curve(z, temperature, shift, plateau)

        tolerance = {"ftol": 1e-13, "xtol": 1e-13, "gtol": 1e-13}

        def by_scipy():
            return curve_fit(model, height, data, p0=[temperature, shift], sigma=error, absolute_sigma=True,
                             jac=lambda z, t, s: slopes(z, t, s, plateau), **tolerance)

        def residuals(p):
            return (curve(height, p["temperature"].value, p["shift"].value, plateau) - data) / error

        def jacobian(p):
            return slopes(height, p["temperature"].value, p["shift"].value, plateau) / error[:, None]

        start = lmfit.Parameters()
        start.add("temperature", temperature)
        start.add("shift", shift)

        def by_lmfit():
            return lmfit.Minimizer(residuals, start, scale_covar=False).leastsq(Dfun=jacobian, **tolerance)

        best, covariance = by_scipy()
        other = by_lmfit().params.valuesdict()
        differences = [t / best[0] - 1, t / other["temperature"] - 1, s / best[1] - 1, s / other["shift"] - 1]
        worst = max(worst, max(abs(x) for x in differences))
        peer, peer2 = median_time(by_scipy, 30), median_time(by_lmfit, 10)
        print(f"{temperature:6.2f} {differences[0]:10.1e} {t_error / np.sqrt(covariance[0, 0]) - 1:9.1e} "
              f"{differences[1]:10.1e} {seconds * 1e6:7.0f} us {peer * 1e6:7.0f} us {peer2 * 1e6:7.0f} us   "
              f"{peer / seconds:.0f} and {peer2 / seconds:.0f} times faster")
    print(f"largest difference of a value: {worst:.1e}")
    sys.exit(0 if worst <= 1e-8 else 1)


if __name__ == "__main__":
    main()
