#!/usr/bin/env python3
"""Shaken beds of soft spheres, measured once by LAMMPS (Debian: lammps, python3-numpy): the reference of the study of record.

usage: soft_spheres.py [--list] [--most-cpu-seconds S] [--scratch FOLDER]

Runs the beds of plan() in order, one process at a time, and appends each to soft_spheres.csv when it is done; beds that
are in the table already are not run again, so the script can be stopped and started at will. The profile of each bed,
seen through a Gaussian of 0.5 D, goes to profiles/NAME.csv.

Scene: 2D, beads of 2 mm that move in a plane (inertia of spheres), 20.6 D between hard, frictionless side walls, floor
of sinusoidal motion at 30 Hz; restitution e of beads, floor and sides; friction of beads and floor. Force: linear spring
and dashpot, its constants from e and the contact time of two beads; friction: tangential spring of 2/7, Coulomb's limit.
30 steps a contact. T with the mean velocity of each phase removed. All lengths in D, temperatures in m g D.
"""
import argparse
import csv
import math
import os
import re
import resource
import struct
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
TABLE = os.path.join(HERE, "soft_spheres.csv")
PROFILES = os.path.join(HERE, "profiles")

DIAMETER, GRAVITY, FREQUENCY = 2e-3, 9.81, 30.0  # m, m/s^2, Hz
WIDTH, A_ROW = 20.6, 20  # D, disks
UNIT_OF_TIME = math.sqrt(DIAMETER / GRAVITY)  # s
PERIOD = 1 / FREQUENCY / UNIT_OF_TIME
STEPS_A_CONTACT, PHASES = 30, 32
SETTLE = 20  # periods
MEASURE = {5: 80, 16: 50}  # periods, by layers: few disks need longer means
BLOCKS = 8  # of the measurement, for its error
KERNEL_SIGMA, PROFILE_STEP = 0.5, 0.25  # D

RESTITUTIONS, GAMMAS = (0.6, 0.8, 0.9, 0.95), (2, 3, 4, 6)
FRICTIONS, LAYERS = (0, 0.5), (5, 16)

COLUMNS = ("bed,restitution,friction,layers,gamma,contact_time_us,seed,count,settle_periods,measure_periods,"
           "temperature_x,temperature_x_error,temperature_z,temperature_z_error,center_of_mass,center_of_mass_error,"
           "cpu_seconds,lammps").split(",")


def plan():
    """Ordered so that whatever is done is balanced.

    The core: 16 of the 64 scenes of e x Gamma x friction x layers, each pair (e, Gamma) once; every e and every Gamma
    meets each of the four pairs (friction, layers) once. Then the same at 20 us, from a second start, at 5 us where it
    is cheap, and last the 16 scenes that make it a half fraction (the parity of the four numbers of level is even).
    """
    core, other = [], []
    for i, e in enumerate(RESTITUTIONS):
        for j, gamma in enumerate(GAMMAS):
            for m, friction in enumerate(FRICTIONS):
                for k, layers in enumerate(LAYERS):
                    if (i + j + m + k) % 2 == 0:
                        (core if m == ((i >> 1) ^ (j >> 1)) else other).append((e, friction, layers, gamma))
    for contact, seed, scenes in ((10, 1, core), (20, 1, core), (10, 2, core), (5, 1, [s for s in core if s[2] == 5]),
                                  (10, 1, other), (20, 2, core), (10, 2, other), (10, 3, core),
                                  (5, 1, [s for s in core if s[2] == 16])):
        # Cheap beds first.
        for scene in sorted(scenes, key=lambda s: s[2]):
            yield scene + (contact, seed)


def name_of(bed):
    e, friction, layers, gamma, contact, seed = bed
    return f"e{round(100 * e)}-mu{round(10 * friction)}-{layers}rows-gamma{gamma}-{contact}us-{seed}"


def starting_places(count, seed, rng):
    """Odd seeds: hexagonal packing. Even seeds: a loose, jittered lattice, so that the bed falls into a random packing."""
    packed = seed % 2 == 1
    step, row_height = (1.0, 0.8661) if packed else (1.25, 1.15)
    places, row = [], 0
    while len(places) < count:
        shift = 0 if row % 2 == 0 else step / 2
        a_row = int(WIDTH - shift + 1e-9) if packed else int((WIDTH - 1 - shift) / step) + 1
        for i in range(min(a_row, count - len(places))):
            jitter = (0, 0) if packed else rng.uniform(-0.07, 0.07, 2)
            x = 0.5 + shift + step * i + jitter[0]
            places.append((min(max(x, 0.5), WIDTH - 0.5), 0.5005 + row * row_height + jitter[1] + (0 if packed else 0.1)))
        row += 1
    return places


def write_atoms(path, width, places, speed, rng):
    """Spheres of diameter and mass 1 at these places (x, z); velocities with this standard deviation."""
    with open(path, "w") as out:
        out.write(f"bed\n\n{len(places)} atoms\n1 atom types\n\n0 {width} xlo xhi\n-3 120 ylo yhi\n-0.5 0.5 zlo zhi\n\nAtoms # sphere\n\n")
        for i, (x, z) in enumerate(places):
            out.write(f"{i + 1} 1 1.0 1.909859317102744 {x:.8f} {z:.8f} 0.0\n")
        out.write("\nVelocities\n\n")
        for i in range(len(places)):
            vx, vz = rng.normal(0, speed, 2)
            out.write(f"{i + 1} {vx:.6f} {vz:.6f} 0 0 0 0\n")


def write_start(path, count, seed, contact):
    rng = np.random.default_rng([seed, contact])
    write_atoms(path, WIDTH, starting_places(count, seed, rng), 0.05 if seed % 2 == 1 else 0.7, rng)


def frames(path):
    """Steps and rows (x, z, vx, vz) of a binary LAMMPS dump."""
    data, at = open(path, "rb").read(), 0
    while at < len(data):
        (magic,) = struct.unpack_from("<q", data, at)
        at += 8 - magic + 8
        step, count = struct.unpack_from("<qq", data, at)
        at += 16 + 28 + 48
        size, text = struct.unpack_from("<ii", data, at)
        at += 8 + text
        at += 9 if data[at] else 1
        (length,) = struct.unpack_from("<i", data, at)
        at += 4 + length
        (parts,) = struct.unpack_from("<i", data, at)
        at += 4
        rows = []
        for _ in range(parts):
            (k,) = struct.unpack_from("<i", data, at)
            at += 4
            rows.append(np.frombuffer(data, "<f8", k, at))
            at += 8 * k
        yield step, np.concatenate(rows).reshape(count, size)


def mean_and_error(series):
    blocks = np.array([block.mean() for block in np.array_split(series, BLOCKS)])
    return series.mean(), blocks.std(ddof=1) / BLOCKS**0.5


def write_profile(path, heights, periods):
    """Number density through a Gaussian, with the error of the mean over blocks of whole periods."""
    grid = np.arange(0, heights.max() + 3 * KERNEL_SIGMA, PROFILE_STEP)
    edges = np.linspace(-1, grid[-1] + 2, 100 * int(grid[-1] + 3) + 1)
    middles, blocks = (edges[1:] + edges[:-1]) / 2, []
    weights = np.exp(-((grid[:, None] - middles[None, :]) / KERNEL_SIGMA) ** 2 / 2) / (KERNEL_SIGMA * math.sqrt(2 * math.pi))
    for block in np.array_split(np.arange(periods), BLOCKS):
        part = heights[block[0] * PHASES:(block[-1] + 1) * PHASES]
        blocks.append(weights @ np.histogram(part, edges)[0] / len(part) / WIDTH)
    blocks = np.array(blocks)
    with open(path, "w") as out:
        out.write("height,number_density,std_error\n")
        for z, density, error in zip(grid, blocks.mean(0), blocks.std(0, ddof=1) / BLOCKS**0.5):
            out.write(f"{z:.2f},{density:.6g},{error:.3g}\n")


def version():
    return re.search(r"- (.+?)$", subprocess.run(["lmp", "-h"], capture_output=True, text=True).stdout, re.M).group(1)


def cpu_seconds_of_lammps(variables, base):
    """Runs soft_spheres.lmp with these variables; its log is base.log."""
    command = ["lmp", "-in", os.path.join(HERE, "soft_spheres.lmp"), "-log", base + ".log", "-screen", "none"]
    for key, value in variables.items():
        command += ["-var", key, str(value)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(command, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def looks_at(dump, looks, per_period):
    """Steps, states (x, z, vx, vz of each disk), T_x and T_z of each look, without the mean velocities of its phase."""
    steps, states = zip(*frames(dump))
    steps, states = np.array(steps[1:looks + 1]), np.array(states[1:looks + 1])
    assert len(steps) == looks
    phase = steps % per_period * PHASES // per_period
    tx, tz = np.zeros(looks), np.zeros(looks)
    for p in range(PHASES):
        here = phase == p
        tx[here] = ((states[here, :, 2] - states[here, :, 2].mean()) ** 2).mean(1)
        tz[here] = ((states[here, :, 3] - states[here, :, 3].mean()) ** 2).mean(1)
    return steps, states, tx, tz


def run(bed, scratch, lammps):
    e, friction, layers, gamma, contact, seed = bed
    count, name = A_ROW * layers, name_of(bed)
    contact_time = contact * 1e-6 / UNIT_OF_TIME
    b = -math.log(e)
    stiffness = 0.5 * (math.pi**2 + b * b) / contact_time**2  # reduced mass of a pair: 1/2
    damping = lambda mass: 2 * math.sqrt(stiffness / mass) * b / math.sqrt(math.pi**2 + b * b)
    per_period = 256 * math.ceil(PERIOD / (contact_time / STEPS_A_CONTACT) / 256)
    base = os.path.join(scratch, name)
    write_start(base + ".data", count, seed, contact)
    variables = {"data": base + ".data", "dump_file": base + ".bin", "width": WIDTH, "stiffness": stiffness,
                 "pair_damping": damping(0.5), "wall_damping": damping(1.0), "friction": friction, "side_friction": 0,
                 "tangential_stiffness": stiffness * 2 / 7, "pair_tangential": damping(0.5) / 2,
                 "wall_tangential": damping(1.0) / 2,
                 "step": PERIOD / per_period, "period": PERIOD, "skin": 0.3,
                 "amplitude": gamma * GRAVITY / (2 * math.pi * FREQUENCY) ** 2 / DIAMETER,
                 "settle_steps": per_period * SETTLE, "measure_steps": per_period * MEASURE[layers],
                 "dump_steps": per_period // PHASES}
    cpu = cpu_seconds_of_lammps(variables, base)
    _, states, tx, tz = looks_at(base + ".bin", MEASURE[layers] * PHASES, per_period)
    os.makedirs(PROFILES, exist_ok=True)
    write_profile(os.path.join(PROFILES, name + ".csv"), states[:, :, 1], MEASURE[layers])
    row = [name, e, friction, layers, gamma, contact, seed, count, SETTLE, MEASURE[layers]]
    for series in (tx, tz, states[:, :, 1].mean(1)):
        row += ["%.6g" % number for number in mean_and_error(series)]
    for ending in (".data", ".bin", ".log"):
        os.remove(base + ending)
    return row + ["%.1f" % cpu, lammps]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="print the beds in order and stop")
    parser.add_argument("--most-cpu-seconds", type=float, default=math.inf, help="begin no further bed after this much")
    parser.add_argument("--scratch", default=tempfile.gettempdir())
    options = parser.parse_args()
    done = set()
    if os.path.exists(TABLE):
        with open(TABLE) as table:
            done = {row["bed"] for row in csv.DictReader(table)}
    else:
        with open(TABLE, "w") as table:
            table.write(",".join(COLUMNS) + "\n")
    lammps, spent = version(), 0.0
    for bed in plan():
        if options.list:
            print(name_of(bed), "done" if name_of(bed) in done else "")
        elif name_of(bed) not in done and spent < options.most_cpu_seconds:
            row = run(bed, options.scratch, lammps)
            spent += float(row[COLUMNS.index("cpu_seconds")])
            with open(TABLE, "a") as table:
                csv.writer(table, lineterminator="\n").writerow(row)
            print(row[0], "%.0f CPU s in all" % spent, flush=True)


if __name__ == "__main__":
    sys.exit(main())
