#!/usr/bin/env python3
"""Measure `shakebed fit-images` on photographs with known beads, beside a tuned Hough transform and tuned trackpy.

usage: photographs.py PROGRAM FOLDER [--hough] [--trackpy] [--only PART] [--out TABLE.md] [--keep FOLDER]

FOLDER holds pictures, `index.csv` (columns file, number_full; repository, path and licence, if given, are copied), and for each picture `NAME.csv` with columns
x_px, y_px, radius_px, class (centres of pixels at integers; class "full" counts, "partial" does not). number_full = 0: no beads,
the picture is to be refused. number_full empty: nothing is known, and only the outcome is written.

The program is given the beads' diameter alone. A found disk matches a bead when their centres lie within a quarter of the bead's
radius. The Hough transform (cv2.HoughCircles; packages python3-opencv, python3-numpy, python3-scipy) is tuned for each picture on
its own truth: radii within 20 % of the true ones, and of 4 x 3 x 3 settings the one with the best F1. No user can tune it better
without knowing the answer. So is trackpy.locate (package trackpy; python3-pandas): diameters from 0.7 to 1.2 of the true one, beads brighter
or darker than the background, two separations, and the smallest mass with the best F1 of 20. Pictures stay where they are; the table alone is meant to be kept.
"""
import argparse
import csv
import os
import resource
import subprocess
import sys
import tempfile

import numpy
from scipy.spatial import cKDTree

MATCH_RADII = 0.25  # largest distance of a match, radii of the bead
HOUGH_CANNY = (40, 80, 140, 220)
HOUGH_VOTES = (12, 20, 32)
HOUGH_BLUR_PX = (0, 1, 2)
LARGEST_HOUGH_RADIUS_PX = 30  # larger beads are searched in a reduced picture
TRACKPY_DIAMETERS = (0.7, 0.85, 1.0, 1.2)  # of the true diameter
TRACKPY_SEPARATIONS = (0.7, 1.0)  # of trackpy's diameter
TRACKPY_MASSES = 20  # cuts, from none to all but the heaviest twentieth
LARGEST_TRACKPY_RADIUS_PX = 12
TIME_LIMIT_S = 600


def read_truth(path):
    rows = list(csv.DictReader(open(path)))
    places = numpy.array([[float(row['x_px']), float(row['y_px'])] for row in rows]).reshape(-1, 2)
    radii = numpy.array([float(row['radius_px']) for row in rows])
    return places, radii, numpy.array([row['class'] == 'full' for row in rows], bool)


def score(truth, found):
    """Recall, precision, F1 and rms distance of the matches in radii."""
    places, radii, full = truth
    taken, hits, squares, ignored = set(), 0, [], set()
    if len(found):
        for i, near in enumerate(cKDTree(found).query_ball_point(places, MATCH_RADII * radii)):
            free = [k for k in near if k not in taken]
            if not free:
                continue
            best = min(free, key=lambda k: numpy.hypot(*(found[k] - places[i])))
            taken.add(best)
            if full[i]:
                hits += 1
                squares.append((numpy.hypot(*(found[best] - places[i])) / radii[i]) ** 2)
        if (~full).any():
            distance, nearest = cKDTree(places[~full]).query(found)
            ignored = set(numpy.where(distance < radii[~full][nearest])[0])
    wrong = len([k for k in range(len(found)) if k not in taken and k not in ignored])
    recall, precision = hits / max(1, full.sum()), hits / max(1, hits + wrong)
    return {'recall': recall, 'precision': precision, 'f1': 2 * recall * precision / max(1e-9, recall + precision),
            'rms_r': numpy.sqrt(numpy.mean(squares)) if squares else float('nan'), 'found': hits + wrong}


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run_program(program, picture, folder):
    """Disks of the first frame, the exit code, its first error or warning, processor seconds."""
    before = children_seconds()
    try:
        run = subprocess.run([program, 'fit-images', picture, '--diameter', '1 mm', '--out', folder], capture_output=True, text=True,
                             timeout=TIME_LIMIT_S)
        code, text = run.returncode, run.stdout + run.stderr
    except subprocess.TimeoutExpired:
        code, text = -1, 'error: no end within the time limit'
    seconds = children_seconds() - before
    disks = os.path.join(folder, 'extract', 'disks.csv')
    found = []
    if os.path.exists(disks):
        rows = csv.DictReader(line for line in open(disks) if not line.startswith('#'))
        found = [[float(row['x_px']), float(row['y_px'])] for row in rows if int(float(row['frame'])) == 0]
    said = [line for line in text.splitlines() if line.startswith(('error: ', 'warning: extract: '))]
    said.sort(key=lambda line: not line.startswith('error: '))
    return {'found': numpy.array(found).reshape(-1, 2), 'code': code, 'said': (said or [''])[0], 'seconds': seconds}


def grey_picture(picture, truth, largest_radius_px):
    """The picture, reduced until the beads' median radius is at most this, and by which factor."""
    import cv2
    image = cv2.imread(picture, cv2.IMREAD_GRAYSCALE)
    scale = min(1.0, largest_radius_px / numpy.median(truth[1]))
    if scale < 1:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return image, scale


def tuned_trackpy(picture, truth):
    import trackpy
    image, scale = grey_picture(picture, truth, LARGEST_TRACKPY_RADIUS_PX)
    best = None
    for share in TRACKPY_DIAMETERS:
        diameter = max(3, 2 * int(share * scale * numpy.median(truth[1])) + 1)
        for separation in TRACKPY_SEPARATIONS:
            for dark in (False, True):
                seen = trackpy.locate(255 - image if dark else image, diameter, separation=separation * diameter)
                places = seen[['x', 'y']].to_numpy()
                for cut in numpy.linspace(0, 0.95, TRACKPY_MASSES):
                    kept = places[seen['mass'].to_numpy() >= (seen['mass'].quantile(cut) if len(seen) else 0)]
                    one = score(truth, (kept + 0.5) / scale - 0.5 if len(kept) else kept)
                    if best is None or one['f1'] > best['f1']:
                        best = one
    return best


def tuned_hough(picture, truth):
    import cv2
    image, scale = grey_picture(picture, truth, LARGEST_HOUGH_RADIUS_PX)
    places, radii, full = truth
    low, high = int(0.8 * scale * radii.min()), int(1.2 * scale * radii.max()) + 1
    best = None
    for blur in HOUGH_BLUR_PX:
        seen = cv2.GaussianBlur(image, (0, 0), blur) if blur else image
        for canny in HOUGH_CANNY:
            for votes in HOUGH_VOTES:
                circles = cv2.HoughCircles(seen, cv2.HOUGH_GRADIENT, 1, max(2, 1.6 * scale * radii.min()), param1=canny,
                                           param2=votes, minRadius=low, maxRadius=high)
                found = (numpy.zeros((0, 2)) if circles is None else circles[0][:, :2].astype(float))
                one = score(truth, (found + 0.5) / scale - 0.5 if len(found) else found)
                if best is None or one['f1'] > best['f1']:
                    best = one
    return best


def first_sentence(said, picture):
    """What the program said first, without paths of this machine."""
    said = said.replace(picture, os.path.basename(picture)).replace('warning: extract: ', '').replace('error: extract (extract): ', '')
    said = said.split('. See ')[0].split('. ')[0]
    return said.replace('|', '/')[:200]


def source_of(row):
    return ', '.join(row[key] for key in ('repository', 'path', 'licence') if row.get(key))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('program')
    parser.add_argument('folder')
    parser.add_argument('--hough', action='store_true')
    parser.add_argument('--trackpy', action='store_true')
    parser.add_argument('--only', default='')
    parser.add_argument('--out')
    parser.add_argument('--keep', help='results of the program, a folder a picture')
    given = parser.parse_args()
    others = {'Hough': tuned_hough} if given.hough else {}
    if given.trackpy:
        others['trackpy'] = tuned_trackpy
    lines = ['| picture | beads | found | F1 | rms, radii | outcome | CPU s | first warning or reason | source, licence |' +
             ''.join(f' {name} F1 |' for name in others), '|---|---|---|---|---|---|---|---|---|' + '---|' * len(others)]
    for row in csv.DictReader(open(os.path.join(given.folder, 'index.csv'))):
        if given.only not in row['file']:
            continue
        picture = os.path.join(given.folder, row['file'])
        with tempfile.TemporaryDirectory() as scratch:
            out = os.path.join(given.keep, row['file']) if given.keep else os.path.join(scratch, 'out')
            result = run_program(given.program, picture, out)
        outcome = {0: 'measured', 4: 'refused', 5: 'refused'}.get(result['code'], f"exit {result['code']}")
        known = row['number_full'] != ''
        beads = int(row['number_full']) if known else None
        truth_file = os.path.splitext(picture)[0] + '.csv'
        one, beside = None, ' |' * len(others)
        if beads:
            truth = read_truth(truth_file)
            one = score(truth, result['found'])
            beside = ''.join(f" {tuned(picture, truth)['f1']:.3f} |" for tuned in others.values())
        f1 = f"{one['f1']:.3f}" if one else ('1' if known and not len(result['found']) else '0' if known else '')
        rms = f"{one['rms_r']:.3f}" if one and one['rms_r'] == one['rms_r'] else ''
        lines.append(f"| {row['file']} | {'' if beads is None else beads} | {len(result['found'])} | {f1} | {rms} | {outcome} | "
                     f"{result['seconds']:.1f} | {first_sentence(result['said'], picture)} | {source_of(row)} |{beside}")
        print(lines[-1], flush=True)
    if given.out:
        with open(given.out, 'w') as table:
            table.write('\n'.join(lines) + '\n')


if __name__ == '__main__':
    sys.exit(main())
