#!/usr/bin/python3
"""Relocalisation of whole runs on 7-Scenes RedKitchen, as Markdown tables.

  relocalisation.py ../shared/data/redkitchen [--only gaps|starts] [--keep DIR]

gaps: 100 frames are missing; the tracker is lost and has to find itself in the map of what came
before. starts: a fresh run is started anywhere in a map that another one has saved.

A pose is judged when the state is first "ok" again, within 3 s. Once against a run of all frames:
for gaps one that closes the loop between the two ends (min_path_m 0.3), as it would drift away
from the map that the other finds itself in; for starts the one that saved the map. And once against
KinectFusion's poses, aligned by all poses before the gap, or of the whole run. Those drift by
centimetres in a second, see relocalisation_bench: that column says as much about them as about
camvox.
"""
import argparse
import math
import pathlib
import random
import shutil
import sys

from experiments import ROOT, TRACKED, camvox, carry_out, rows_of, table

RATE_HZ = 30
GAP = 100         # frames
WITHIN = 90       # frames: 3 s
DEPTH_CAMERA_M = (-0.025, 0.0, 0.0)  # in the colour camera; KinectFusion's poses are the former's


class Pose:
    """Rotation (3x3, rows) and translation in m: p_parent = R p + t."""

    def __init__(self, rotation, translation):
        self.rotation, self.translation = rotation, translation

    def __mul__(self, other):
        rotation = [[sum(self.rotation[i][k] * other.rotation[k][j] for k in range(3))
                     for j in range(3)] for i in range(3)]
        return Pose(rotation, [a + b for a, b in
                               zip(self.turn(other.translation), self.translation)])

    def turn(self, vector):
        return [sum(self.rotation[i][k] * vector[k] for k in range(3)) for i in range(3)]

    def inverse(self):
        back = Pose([list(row) for row in zip(*self.rotation)], [0.0] * 3)
        back.translation = [-value for value in back.turn(self.translation)]
        return back

    def size(self):
        """Length in m and angle in degrees."""
        trace = sum(self.rotation[i][i] for i in range(3))
        return (math.hypot(*self.translation),
                math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1.0) / 2.0)))))


def from_tum(path):
    """Poses by frame number of a TUM trajectory."""
    poses = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        stamp_s, tx, ty, tz, x, y, z, w = map(float, line.split())
        poses[round(stamp_s * RATE_HZ)] = Pose(
            [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]], [tx, ty, tz])
    return poses


def kinect_fusion(folder):
    """The poses of the colour camera by frame number."""
    to_colour = Pose([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [-value for value in DEPTH_CAMERA_M])
    poses = {}
    for path in sorted(folder.glob("frame-*.pose.txt")):
        rows = [list(map(float, line.split())) for line in path.read_text().splitlines()[:3]]
        pose = Pose([row[:3] for row in rows], [row[3] for row in rows])
        poses[int(path.name[6:12])] = pose * to_colour
    return poses


def alignment(truth, estimate, frames):
    """The pose of the estimate's map in the truth's: the mean of what each frame says."""
    each = [truth[i] * estimate[i].inverse() for i in frames]
    # Mean of the first two axes, made orthonormal: the rotations differ by a few degrees at most.
    x, y = ([sum(pose.rotation[row][axis] for pose in each) for row in range(3)] for axis in (0, 1))
    x = [value / math.hypot(*x) for value in x]
    along = sum(a * b for a, b in zip(x, y))
    y = [b - along * a for a, b in zip(x, y)]
    y = [value / math.hypot(*y) for value in y]
    z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
    rotation = [list(row) for row in zip(x, y, z)]
    turned = Pose(rotation, [0.0] * 3)
    offset = [0.0] * 3
    for i in frames:
        at = turned.turn(estimate[i].translation)
        offset = [o + (t - a) / len(frames) for o, t, a in zip(offset, truth[i].translation, at)]
    return Pose(rotation, offset)


class Runs:
    """camvox on RedKitchen and parts of it."""

    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, folder
        self.bag = self.import_frames("whole", lambda number: True)
        self.truth = kinect_fusion(arguments.redkitchen)

    def import_frames(self, name, wanted):
        part, bag = self.folder / f"{name}_frames", self.folder / f"{name}_bag"
        part.mkdir()
        for path in self.arguments.redkitchen.resolve().iterdir():
            if not path.name.startswith("frame-") or wanted(int(path.name[6:12])):
                (part / path.name).symlink_to(path)
        camvox("import", "7scenes", part, "-o", bag)
        return bag

    def run(self, name, bag, *more):
        out = self.folder / f"{name}_out"
        camvox("run", ROOT / "config/rgbd.yaml", "--bag", bag, "--parameters", bag / "rig.yaml",
               "--lockstep", "--out", out, *more, domain=self.arguments.domain)
        return out

    def whole_run(self, name, *settings):
        """Its folder, and its poses by frame."""
        out = self.run(name, self.bag, *settings)
        return out, from_tum(out / "trajectory.tum")

    def judge(self, out, first, whole, aligned):
        """Waiting time in s and errors (m, deg) against the whole run and KinectFusion."""
        frames = ((round(int(row["stamp_ns"]) * RATE_HZ / 1e9), row["state"])
                  for row in rows_of(out / "frames.csv"))
        found = next((number for number, state in frames if number >= first and state in TRACKED),
                     None)
        if found is None or found >= first + WITHIN:
            return None
        pose = from_tum(out / "trajectory.tum")[found]
        return ((found - first) / RATE_HZ, (whole[found].inverse() * pose).size(),
                (self.truth[found].inverse() * (aligned * pose)).size())

    def gaps(self):
        _, whole = self.whole_run("closed", "--set", "loop_closing.loop.min_path_m=0.3")
        for last in range(100, 301, 10):
            wanted = [*range(last), *range(last + GAP, last + GAP + WITHIN)]
            bag = self.import_frames(f"gap{last}", set(wanted).__contains__)
            aligned = alignment(self.truth, whole, range(last))
            yield last, self.judge(self.run(f"gap{last}", bag), last + GAP, whole, aligned)
            shutil.rmtree(bag)

    def starts(self):
        numbers = random.Random(1)
        mapped, whole = self.whole_run("mapped")
        aligned = alignment(self.truth, whole, whole)
        for attempt in range(50):
            first = numbers.randrange(len(self.truth) - WITHIN)
            out = self.run(f"start{attempt}", self.bag, "--map", mapped / "map.mcap",
                           "--localisation-only", "--set",
                           f"replay.start_offset_s={(first - 0.5) / RATE_HZ if first else 0.0}")
            yield first, self.judge(out, first, whole, aligned)


def show(title, answers):
    """One row a case, then what they have in common."""
    print(f"{title}\n")
    rows, tally = [], []
    for frame, answer in answers:
        tally.append(answer)
        if answer is None:
            rows.append((frame, "not found", "", ""))
            continue
        waited_s, *errors = answer
        rows.append((frame, f"{waited_s:.2f}", *(f"{m:.3f}, {deg:.2f}" for m, deg in errors)))
    table(("frame", "found after s", "against the whole run: m, deg", "KinectFusion: m, deg"), rows)
    found = [answer for answer in tally if answer is not None]
    print(f"{len(found)} of {len(tally)} found within 3 s")
    for column, name in ((1, "the whole run"), (2, "KinectFusion")):
        errors = [answer[column] for answer in found]
        right = sum(m < 0.05 and deg < 2.0 for m, deg in errors)
        wrong = sum(m > 0.15 or deg > 5.0 for m, deg in errors)
        median_m = sorted(m for m, _ in errors)[len(errors) // 2] if errors else math.nan
        print(f"against {name}: {right} of {len(tally)} within 5 cm and 2 degrees, median "
              f"{median_m:.3f} m, {wrong} wrong (> 15 cm or 5 degrees)")
    print(flush=True)


def relocalise(arguments, folder):
    runs = Runs(arguments, folder)
    if arguments.only != "starts":
        show("After a gap of 100 frames, by the frame that it starts with", runs.gaps())
    if arguments.only != "gaps":
        show("Fresh starts in a saved map, by their first frame", runs.starts())


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("redkitchen", type=pathlib.Path)
    parser.add_argument("--only", choices=("gaps", "starts"))
    return carry_out(parser, 97, relocalise)


if __name__ == "__main__":
    sys.exit(main())
