#!/usr/bin/env python3
"""Weakly shaken beds of rough soft disks, by LAMMPS: which of contacts alone and pressed beds is nearer to them.

usage: weak_rough_beds.py [--most-cpu-seconds S] [--scratch FOLDER]

Disks with the inertia of spheres and one restitution throughout, floor of sinusoidal motion. "eq6": the bed of
figure.json of quinn-hong-eq6, whose sides are smooth; "eq6 rough sides": the same with sides that rub as the floor
does; "rough sides": 500 smaller disks between such sides. Runs the beds of plan() in order, as soft_spheres.py does,
and appends each to weak_rough_beds.csv.

Tangential springs of two kinds. "as pressed": so soft that what slips with speed 1 and sticks slips no more when the
contact ends (b0 = 0), with a dashpot of exp(-1/2), which is what shakebed's pressed beds have. "two sevenths": that of
soft_spheres.py, as quick as the normal spring, b0 about 0.4.
"""
import argparse
import csv
import math
import os
import sys
import tempfile
from typing import NamedTuple

import numpy as np

import soft_spheres
from soft_spheres import cpu_seconds_of_lammps, looks_at, mean_and_error, write_atoms

HERE = os.path.dirname(os.path.abspath(__file__))
TABLE = os.path.join(HERE, "weak_rough_beds.csv")

class Scene(NamedTuple):
    diameter: float  # m
    frequency: float  # Hz
    width: float  # D
    count: int
    friction: float  # of disks and floor
    side_friction: float
    settle: int  # periods
    measure: int

    @property
    def unit_of_time(self):
        return math.sqrt(self.diameter / GRAVITY)  # s

    @property
    def period(self):
        return 1 / self.frequency / self.unit_of_time


GRAVITY, RESTITUTION = 9.81, 0.6  # m/s^2
SCENES = {"eq6": Scene(2.99e-3, 20, 90.6 / 2.99, 340, 0.8, 0, 20, 40),
          "eq6 rough sides": Scene(2.99e-3, 20, 90.6 / 2.99, 340, 0.8, 0.8, 10, 20),
          "rough sides": Scene(2e-3, 30, 30.6, 500, 0.5, 0.5, 15, 30)}
STEPS_A_CONTACT, PHASES = 30, 32
AS_PRESSED, TWO_SEVENTHS = "as pressed", "two sevenths"

COLUMNS = ("scene,gamma,spring,contact_time_us,seed,temperature_x,temperature_x_error,temperature_z,temperature_z_error,"
           "center_of_mass,center_of_mass_error,spread_of_height,cpu_seconds,lammps").split(",")


def plan():
    for gamma, spring, contact, seeds in (
            (3, AS_PRESSED, 10, (1,)), (1.2, AS_PRESSED, 20, (1, 2)), (1.5, AS_PRESSED, 20, (1, 2)),
            (1.2, AS_PRESSED, 10, (1, 2)), (1.5, AS_PRESSED, 10, (1, 2)), (1.2, TWO_SEVENTHS, 20, (1, 2)),
            (1.5, TWO_SEVENTHS, 20, (1, 2)), (1.2, AS_PRESSED, 100, (1, 2)), (1.5, AS_PRESSED, 100, (1, 2)),
            (3, AS_PRESSED, 10, (2,)), (2, AS_PRESSED, 10, (1, 2)), (1.2, AS_PRESSED, 5, (1, 2)),
            (1.5, AS_PRESSED, 5, (1, 2)), (1.2, TWO_SEVENTHS, 10, (1, 2)), (1.5, TWO_SEVENTHS, 10, (1, 2))):
        for seed in seeds:
            yield "eq6", gamma, spring, contact, seed
    for scene, gamma, contact in (("eq6 rough sides", 1.2, 20), ("eq6 rough sides", 1.5, 20), ("eq6 rough sides", 1.2, 10),
                                  ("rough sides", 1.2, 20), ("rough sides", 1.5, 20), ("rough sides", 2, 20)):
        yield scene, gamma, AS_PRESSED, contact, 1


def tangential(spring, stiffness, damping, contact_time):
    """Stiffness, and damping of a pair and of a disk on a wall, whose contact lasts sqrt(2) times as long."""
    if spring == TWO_SEVENTHS:
        return stiffness * 2 / 7, damping(0.5) / 2, damping(1.0) / 2
    loss, low, high = 0.5, 0.1, math.pi
    for _ in range(60):  # cos(rate) = loss/rate sin(rate): the slip ends with the contact
        rate = 0.5 * (low + high)
        low, high = (rate, high) if math.cos(rate) > loss / rate * math.sin(rate) else (low, rate)
    slipping = 2 / 7  # of the mass
    return (0.5 * slipping * (rate**2 + loss**2) / contact_time**2, 2 * slipping * loss / contact_time,
            2 * slipping * loss / (2**0.5 * contact_time))


def starting_places(scene, seed, rng):
    """Odd seeds: the packing with which shakebed begins, 29 disks a row. Even seeds: disks at random, which fall."""
    if seed % 2 == 1:
        a_row = 29
        apart = (scene.width - 1) / (a_row - 0.5)
        rise = math.sqrt(1 + 1e-6 - apart**2 / 4)
        return [(0.5 + (k % a_row + 0.5 * (k // a_row % 2)) * apart, 0.5005 + k // a_row * rise)
                for k in range(scene.count)]
    places, high = [], math.pi / 4 * scene.count / (0.3 * scene.width) + 1
    while len(places) < scene.count:
        x, z = rng.uniform(0.5, scene.width - 0.5), rng.uniform(0.5005, high)
        if all((x - a)**2 + (z - b)**2 > 1 for a, b in places):
            places.append((x, z))
    return places


def write_start(path, scene, seed):
    rng = np.random.default_rng(seed)
    write_atoms(path, scene.width, starting_places(scene, seed, rng), 0.1, rng)


def run(bed, scratch, lammps):
    name, gamma, spring, contact, seed = bed
    scene = SCENES[name]
    contact_time = contact * 1e-6 / scene.unit_of_time
    b = -math.log(RESTITUTION)
    stiffness = 0.5 * (math.pi**2 + b * b) / contact_time**2  # reduced mass of a pair: 1/2
    damping = lambda mass: 2 * math.sqrt(stiffness / mass) * b / math.sqrt(math.pi**2 + b * b)
    kt, pair_tangential, wall_tangential = tangential(spring, stiffness, damping, contact_time)
    per_period = 256 * math.ceil(scene.period / (contact_time / STEPS_A_CONTACT) / 256)
    base = os.path.join(scratch, f"{name.replace(' ', '-')}-gamma{gamma}-{spring.replace(' ', '-')}-{contact}us-{seed}")
    write_start(base + ".data", scene, seed)
    variables = {"data": base + ".data", "dump_file": base + ".bin", "width": scene.width, "stiffness": stiffness,
                 "pair_damping": damping(0.5), "wall_damping": damping(1.0), "friction": scene.friction,
                 "side_friction": scene.side_friction,
                 "tangential_stiffness": kt, "pair_tangential": pair_tangential, "wall_tangential": wall_tangential,
                 "step": scene.period / per_period, "period": scene.period, "skin": 0.3,
                 "amplitude": gamma * GRAVITY / (2 * math.pi * scene.frequency) ** 2 / scene.diameter,
                 "settle_steps": per_period * scene.settle, "measure_steps": per_period * scene.measure,
                 "dump_steps": per_period // PHASES}
    cpu = cpu_seconds_of_lammps(variables, base)
    steps, states, tx, tz = looks_at(base + ".bin", scene.measure * PHASES, per_period)
    np.savez_compressed(base + ".npz", steps=steps, states=states.astype(np.float32), per_period=per_period)
    row = list(bed)
    for series in (tx, tz, states[:, :, 1].mean(1)):
        row += ["%.6g" % number for number in mean_and_error(series)]
    row.append("%.6g" % states[:, :, 1].std(1).mean())
    for ending in (".data", ".bin"):
        os.remove(base + ending)
    return row + ["%.1f" % cpu, lammps]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most-cpu-seconds", type=float, default=math.inf, help="begin no further bed after this much")
    parser.add_argument("--scratch", default=tempfile.gettempdir())
    options = parser.parse_args()
    done = set()
    if os.path.exists(TABLE):
        with open(TABLE) as table:
            done = {tuple(list(row.values())[:5]) for row in csv.DictReader(table)}
    else:
        with open(TABLE, "w") as table:
            table.write(",".join(COLUMNS) + "\n")
    lammps, spent = soft_spheres.version(), 0.0
    for bed in plan():
        if tuple(map(str, bed)) not in done and spent < options.most_cpu_seconds:
            row = run(bed, options.scratch, lammps)
            spent += float(row[COLUMNS.index("cpu_seconds")])
            with open(TABLE, "a") as table:
                csv.writer(table, lineterminator="\n").writerow(row)
            print(*bed, "%.0f CPU s in all" % spent, flush=True)


if __name__ == "__main__":
    sys.exit(main())
