#!/usr/bin/env python3
"""Writes reference_values.hpp: the Enskog constants and the inverse phi(f) of every equation of state, to 60 digits with the standard library's
decimal arithmetic, independently of the C++ (f in its printed form, Newton on f, Lambda_1 by tanh-sinh quadrature of its
defining integral).

usage: make_reference_values.py > reference_values.hpp
"""
from decimal import Decimal as D, getcontext
import math
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


# --- the other equations of state: f(phi) = ln phi + Z - 1 + integral_0^phi (Z - 1)/phi' dphi' ------------------------

NU_MAX = PI / (2 * D(3).sqrt())
CLOSE = 2 / D(3).sqrt()


def henderson(p):
    e = PI / 4 * p
    return p.ln() + (1 + e * e / 8) / (1 - e) ** 2 - 1 + D("1.125") * e / (1 - e) - D("0.875") * (1 - e).ln()


def santos_z(e):
    return 1 / (1 - 2 * e + (2 * NU_MAX - 1) * e * e / NU_MAX**2)


def santos(p):
    # (Z - 1)/e = A/(1 - e/nu_max) + B/(1 - b e), from 1/Z = (1 - e/nu_max)(1 - b e)
    e, b = PI / 4 * p, 2 - 1 / NU_MAX
    a = 1 / (2 * NU_MAX * (1 - NU_MAX))
    return p.ln() + santos_z(e) - 1 - a * NU_MAX * (1 - e / NU_MAX).ln() - (2 - a) / b * (1 - b * e).ln()


def percus_yevick(p):
    e = PI / 4 * p
    return p.ln() + 1 / (1 - e) ** 2 - 1 + e / (1 - e) - (1 - e).ln()


KR = {i: D(c) for i, c in enumerate(
    "1 2 1.12801775 0.00181895291 -0.0526134737 0.0504960168 -0.0325537792 0.0134578632 0.00140888182 -0.00834273601 "
    "0.00694127367 -0.00262254723 0.000355746352".split())}
KR[22], KR[57] = D("-5.24672938e-9"), D("5.88054639e-23")


def kolafa_rottner_z(e):
    y = e / (1 - e)
    return sum(a * y**i for i, a in KR.items())


def kolafa_rottner(p):
    # de/e = dy/(y (1 + y)), and integral y^(i-1)/(1 + y) dy = sum_{j<i-1} ... by division
    e = PI / 4 * p
    y = e / (1 - e)
    integral = D(0)
    for i, a in KR.items():
        if i == 0:
            continue
        m, sign, part = i - 1, D(1), D(0)
        for j in range(m, 0, -1):  # y^m/(1+y) = y^(m-1) - y^(m-2) + ... -+ 1 +- 1/(1+y)
            part += sign * y**j / j
            sign = -sign
        integral += a * (part + sign * (1 + y).ln())
    return p.ln() + kolafa_rottner_z(e) - 1 + integral


def dense_z(nu):
    x = NU_MAX - nu
    return 2 * NU_MAX / x * (1 - D("0.04") * x + D("3.25") * x**3)


def luding_z(nu):
    g4 = (1 - 7 * nu / 16) / (1 - nu) ** 2 - nu**3 / (128 * (1 - nu) ** 4)
    z4 = 1 + 2 * nu * g4
    w = 1 / (1 + (-(nu - D("0.70")) / D("0.0111")).exp())
    return z4 + w * (dense_z(nu) - z4)


def legendre_rule(n):
    rule = []
    for i in range(n):
        x = D(-math.cos(math.pi * (i + 0.75) / (n + 0.5)))
        for _ in range(12):
            before, here = D(1), x
            for k in range(2, n + 1):
                before, here = here, ((2 * k - 1) * x * here - (k - 1) * before) / k
            slope = n * (x * here - before) / (x * x - 1)
            x -= here / slope
        rule.append((x, 2 / ((1 - x * x) * slope * slope)))
    return rule


class Luding:
    """Panels of 24 points, short beside the distance to the poles of the blend (0.035 off the axis) and to close
    packing; sums at the panels' edges."""

    def __init__(self):
        self.rule = legendre_rule(24)
        self.edges = [D("0.02") * i for i in range(31)] + [D("0.60") + D("0.005") * i for i in range(1, 41)]
        while NU_MAX - self.edges[-1] > D("1e-14"):
            self.edges.append(NU_MAX - (NU_MAX - self.edges[-1]) * D("0.8"))
        self.sums = [D(0)]
        for a, b in zip(self.edges, self.edges[1:]):
            self.sums.append(self.sums[-1] + self.panel(a, b))

    def panel(self, a, b):
        half, middle = (b - a) / 2, (a + b) / 2
        total = D(0)
        for x, w in self.rule:
            nu = middle + half * x
            total += w * (luding_z(nu) - 1) / nu
        return total * half

    def __call__(self, p):
        nu = PI / 4 * p
        i = max(j for j, edge in enumerate(self.edges) if edge <= nu)
        partial = self.panel(self.edges[i], nu) if nu > self.edges[i] else D(0)
        return p.ln() + luding_z(nu) - 1 + self.sums[i] + partial


class BestOf:
    """Kolafa-Rottner up to nu = 0.7, the same pressure and f across the coexistence, Luding's dense form beyond."""

    def __init__(self):
        self.freezing = D("0.7") / (PI / 4)
        pressure = D("0.7") * kolafa_rottner_z(D("0.7"))
        low, high = D("0.716"), D("0.75")
        for _ in range(280):
            middle = (low + high) / 2
            if middle * dense_z(middle) < pressure:
                low = middle
            else:
                high = middle
        self.melting = high / (PI / 4)
        self.coexistence = kolafa_rottner(self.freezing)
        self.offset = self.coexistence - self.dense(self.melting)

    @staticmethod
    def dense(p):
        # Z + integral Z dnu/nu with Z = 2 nu_max (1/x - 0.04 + 3.25 x^2), x = nu_max - nu
        nu = PI / 4 * p
        x = NU_MAX - nu
        polynomial = NU_MAX**2 * nu.ln() - 2 * NU_MAX * nu + nu * nu / 2  # integral of x^2/nu
        return dense_z(nu) + 2 * (nu.ln() - x.ln()) + 2 * NU_MAX * (D("-0.04") * nu.ln() + D("3.25") * polynomial)

    def __call__(self, p):
        return kolafa_rottner(p) if p <= self.freezing else self.dense(p) + self.offset


def inverse_by_bisection(function, value, low, high):
    """phi with f(phi) = value: the false position with halved ends, to 40 digits."""
    low_value, high_value = function(low) - value, function(high) - value
    side = 0
    for _ in range(600):
        if high - low < D("1e-42") * high:
            break
        p = (low * high_value - high * low_value) / (high_value - low_value)
        if not low < p < high or _ % 7 == 6:
            p = (low + high) / 2
        here = function(p) - value
        if here == 0:
            return p
        if here > 0:
            high, high_value = p, here
            low_value = low_value / 2 if side == 1 else low_value
            side = 1
        else:
            low, low_value = p, here
            high_value = high_value / 2 if side == -1 else high_value
            side = -1
    return (low + high) / 2


def rows_of(name, function, top, gather, count):
    """Doubles f over the whole range of densities and their inverses: phi even in ln phi, phi even, and phi gathered
    towards each of the densities in `gather`."""
    random.seed("inverse of " + name)
    rows = []
    for i in range(count):
        if i % 5 == 0:
            phi = (-D(690) * D(i) / D(count)).exp()
        elif i % 5 == 1:
            phi = (-D(30) * D(random.random())).exp()
        elif i % 5 == 2 or not gather:
            phi = top * D(random.random())
        else:
            at = gather[i % len(gather)]
            phi = at + D(random.choice([-1, 1])) * (-D(28) * D(random.random())).exp() / 4
        if not D(10) ** -300 < phi < top:
            continue
        if isinstance(function, BestOf) and function.freezing < phi < function.melting:
            continue
        value = float(function(phi))
        if D(value) >= function(top):
            continue
        low, high = phi * D("0.999999"), min(phi * D("1.000001"), top)
        if isinstance(function, BestOf):
            if D(value) < function.coexistence:
                high = min(high, function.freezing)
            else:
                low = max(low, function.melting)
        while function(low) > D(value):
            low *= D("0.9")
        while function(high) < D(value):
            high = min(high * D("1.1"), top)
        x, remainder = double_of(inverse_by_bisection(function, D(value), low, high))
        rows.append((name, value, x, float(remainder)))
    return sorted(rows, key=lambda row: row[1])


def other_inverses():
    just_below = D(float(CLOSE)) * (1 - D("1e-12"))
    close = D(float(CLOSE))
    best_of = BestOf()
    rows = rows_of("henderson", henderson, close, [], 150)
    rows += rows_of("santos-lopez-yuste", santos, just_below, [CLOSE], 150)
    rows += rows_of("percus-yevick", percus_yevick, close, [], 150)
    rows += rows_of("kolafa-rottner", kolafa_rottner, best_of.freezing, [best_of.freezing], 200)
    rows += rows_of("luding", Luding(), just_below, [CLOSE, D("0.70") / (PI / 4)], 200)
    rows += rows_of("best-of", best_of, just_below, [CLOSE, best_of.freezing, best_of.melting], 250)
    return rows


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
    print("}};\n")
    print("// The same of the other equations of state.")
    print("struct NamedInverseRow {\n  const char* equation;\n  double f, phi, remainder;\n};")
    others = other_inverses()
    print(f"inline constexpr std::array<NamedInverseRow, {len(others)}> other_inverse_rows{{{{")
    for name, value, x, remainder in others:
        print(f'    {{"{name}", {value.hex()}, {x.hex()}, {remainder:.3f}}},')
    print("}};\n\n}  // namespace shakebed::reference")


main()
