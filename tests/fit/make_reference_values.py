#!/usr/bin/env python3
"""Writes reference_values.hpp: the Enskog constants and the inverse phi(f), to 60 digits with the standard library's
decimal arithmetic, independently of the C++ (f in its printed form, Newton on f, Lambda_1 by tanh-sinh quadrature of its
defining integral).

usage: make_reference_values.py > reference_values.hpp
"""
from decimal import Decimal as D, getcontext
import random

getcontext().prec = 90


def arctan_inverse(n):
    x = D(1) / n
    total, term, k = x, x, 1
    while abs(term) > D(10) ** -95:
        term = -term / (n * n)
        k += 2
        total += term / k
    return total


PI = 4 * (4 * arctan_inverse(5) - arctan_inverse(239))
A = D("0.489351") * PI / 2
A1 = D("0.196703") * PI / 2
A2 = D("0.006519") * (PI / 2) ** 2
C1 = PI * A2 / A**2
C2 = -(PI / 2) * (A1 - 2 * A2 / A) / A**2
C3 = -C2
C4 = (PI / 2) * (1 - A1 / A + A2 / A**2) / A


def chi(p):
    return (1 - A1 * p + A2 * p * p) / (1 - A * p) ** 2


def z(p):
    return 1 + PI / 2 * p * chi(p)


def f(p):
    d = 1 - A * p
    return p.ln() + C1 * p + C2 * d.ln() + C3 / d + C4 / d**2


def f_slope(p):
    d = 1 - A * p
    return 1 / p + C1 - C2 * A / d + A * C3 / d**2 + 2 * A * C4 / d**3


def inverse(value, start):
    """phi with f(phi) = value, by Newton in ln phi at 90 digits."""
    p = start
    for _ in range(60):
        step = (value - f(p)) / (p * f_slope(p))
        p = p * step.exp() if abs(step) < 2 else p * (D(2) if step > 0 else D("0.5"))
        if p >= 1 / A:
            p = (start + 1 / A) / 2
        if abs(step) < D(10) ** -80:
            break
    return p


def tanh_sinh(g, a, b):
    h = D(1) / 64
    total = D(0)
    half, middle = (b - a) / 2, (a + b) / 2
    for k in range(-6 * 64, 6 * 64 + 1):
        t = h * k
        e = t.exp()
        s = (e - 1 / e) / 2 * PI / 2
        es = s.exp()
        x = (es - 1 / es) / (es + 1 / es)
        w = PI / 2 * (e + 1 / e) / 2 * 4 / (es + 1 / es) ** 2
        if w < D(10) ** -80:
            continue
        # distance to the ends kept exactly: 1 - x = 2 e^-s/(e^s + e^-s)
        left = half * 2 * es / (es + 1 / es)
        p = a + left
        if p <= a or p >= b:
            continue
        total += w * g(p)
    return total * h * half


def lambda_1(p0):
    # integral [f(p0) - f(p)] p f'(p) dp, the printed definition
    f0 = f(p0)
    return tanh_sinh(lambda p: (f0 - f(p)) * p * f_slope(p), D(0), p0)


def cpp(value):
    return f"{+value:.40e}L"


def double_of(value):
    """The nearest double (float(Decimal) is correctly rounded) and what is left, in units of its last place."""
    x = float(value)
    exponent = x.hex().split("p")[1]
    ulp = D(2) ** (int(exponent) - 52)
    return x, (value - D(x)) / ulp


def main():
    print("// Written by make_reference_values.py; do not edit. 90-digit decimal arithmetic, independent of the library.")
    print("#pragma once\n\n#include <array>\n\nnamespace shakebed::reference {\n")
    print("// phi_0 (the double itself is the argument) and, correctly rounded: f, mu_0, Lambda_1, k, chi.")
    print("struct ExpansionRow {\n  double phi_0, f, mu_0, lambda_1, k, chi;\n};")
    points = [float(D(2) / D(3).sqrt()), 1.15, 1.10, 1.0, 0.9, 0.7, 0.5, 0.25, 0.1, 1e-2, 1e-3, 1e-5, 1e-8]
    print(f"inline constexpr std::array<ExpansionRow, {len(points)}> expansion_rows{{{{")
    for x in points:
        p = D(x)
        mu0 = p * z(p)
        l1 = lambda_1(p)
        k = 2 * l1 * p / mu0**2 - 1
        print("    {" + ", ".join([x.hex()] + [float(v).hex() for v in (f(p), mu0, l1, k, chi(p))]) + "},")
    print("}};\n")
    print("// f (an exact double) and its inverse phi, as the nearest double plus a remainder in units of its last place.")
    print("struct InverseRow {\n  double f, phi, remainder;\n};")
    random.seed(20000511)
    rows = []
    f_low = f(D(10) ** -300)
    f_top = f(D(float(D(2) / D(3).sqrt())))
    for i in range(600):
        if i < 150:  # f even over the whole range
            value = float(f_low + (f_top - f_low) * D(i) / D(149))
        elif i < 450:  # phi even in the dense part
            value = float(f(D("1.1547") * D(random.random())))
        else:  # phi even in ln phi
            value = float(f((D(random.random()) * D(10).ln() * -30).exp()))
        value = min(value, float(f_top) - 1e-9)
        guess = D(value) - C3 - C4
        start = guess.exp() if guess < -1 else D("0.3")
        phi = inverse(D(value), start)
        x, remainder = double_of(phi)
        rows.append((value, x, float(remainder)))
    rows.sort()
    print(f"inline constexpr std::array<InverseRow, {len(rows)}> inverse_rows{{{{")
    for value, x, remainder in rows:
        print(f"    {{{value.hex()}, {x.hex()}, {remainder:.3f}}},")
    print("}};\n\n}  // namespace shakebed::reference")


main()
