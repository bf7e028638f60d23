#!/usr/bin/python3
"""The experiments of the CamVox paper, and what camvox promises on top, as Markdown tables.

  experiments.py close-depth demo    matches and map points at close_depth_m 20, 50, 90, 130
  experiments.py accuracy demo ...   trajectory errors, one row a recording
  experiments.py timing demo         processor time of each component beside the paper's
  experiments.py yardstick loop_400m tracking and mapping as ratios to cv::ORB on such images
  experiments.py repeat demo         ten lockstep runs, compared byte for byte

A recording is a folder with a bag, its rig.yaml and truth_body.tum, or the name of one of
`camvox simulate`'s presets, which is then made once below output/recordings. Each run has a DDS
domain of its own. Nothing is timed but processor time, so a busy machine does little harm.
"""
import argparse
import csv
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
CAMVOX = ROOT / "install/camvox_bringup/bin/camvox"
PRESETS = ("rotation", "standstill", "corridor", "dropouts", "demo", "loop_400m", "campus_1800m")
TRACKED = ("ok", "localisation_only")
# The paper's Table on its i7-8550U: its name, milliseconds, our component that does the same.
PAPER_TIMING = (
    ("Tracking", 42.27, "tracking"),
    ("Mapping", 252.41, "mapping"),
    ("Loop Closing", 7821.0, "loop_closing"),
    ("IMU correction", 0.89, "deskew"),
    ("Pcd2Depth", 16.35, "depth"),
)


class Failed(Exception):
    """A command that did not do what it should; the text says which and why."""


def camvox(*arguments, domain=None):
    """Runs the command and gives what it logged."""
    environment = dict(os.environ, ROS_DOMAIN_ID=str(domain)) if domain else None
    command = [str(CAMVOX), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode != 0:
        raise Failed(f"{' '.join(command)}\n{done.stderr.strip()[-2000:]}")
    return done.stderr


def recording(name):
    """The folder of a recording; a preset that is not there yet is simulated first."""
    folder = pathlib.Path(name)
    if name in PRESETS and not folder.is_dir():
        folder = ROOT / "output/recordings" / name
        if not (folder / "metadata.yaml").is_file():
            print(f"simulating {name} ...", file=sys.stderr)
            folder.parent.mkdir(parents=True, exist_ok=True)
            camvox("simulate", name, "-o", folder)
    for needed in ("metadata.yaml", "rig.yaml"):
        if not (folder / needed).is_file():
            raise Failed(f"{folder}: no {needed}; a recording of `camvox simulate` or `import`?")
    return folder


def run(arguments, bag, out, *settings):
    """One lockstep run of all components into `out`; gives what they logged."""
    return camvox("run", ROOT / "config" / arguments.config, "--bag", bag, "--parameters",
                  bag / "rig.yaml", "--lockstep", "--out", out, "--overwrite",
                  *(part for setting in settings for part in ("--set", setting)),
                  domain=arguments.domain)


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def evaluate(bag, out):
    """What `camvox evaluate` says of trajectory.tum against the truth of the recording. A path
    that stays in one place has no SE(3) alignment; it is compared from its first pose on."""
    file = out / "evaluation.json"
    command = ("evaluate", bag / "truth_body.tum", out / "trajectory.tum", "--json", file)
    try:
        camvox(*command)
    except Failed as failure:
        if "do not determine an alignment" not in str(failure):
            raise
        camvox(*command, "--align", "origin")
    return json.loads(file.read_text(encoding="utf-8"))


def map_points(log):
    """The number of landmarks that mapping says it has saved."""
    found = re.search(r"map of \d+ keyframes, (\d+) landmarks", log)
    if not found:
        raise Failed("mapping did not say how many landmarks it saved")
    return int(found.group(1))


def table(header, rows):
    """Markdown; the first column to the left, numbers to the right."""
    print("| " + " | ".join(header) + " |")
    print("| --- |" + " ---: |" * (len(header) - 1))
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |", flush=True)
    print()


def close_depth(arguments, folder):
    """The paper's figure on the threshold of close points: matches of the first 100 frames."""
    bag, rows = recording(arguments.recordings[0]), []
    for threshold_m in (20, 50, 90, 130):
        out = folder / f"{threshold_m}"
        log = run(arguments, bag, out, f"tracking.tracker.close_depth_m={threshold_m}")
        matches = [int(row["matches"]) for row in rows_of(out / "frames.csv")[2:102]]
        ape = evaluate(bag, out)["ape_m"]["rmse"]
        rows.append((threshold_m, f"{sum(matches) / len(matches):.1f}", min(matches),
                     map_points(log), f"{ape:.3f}"))
    print(f"Close-depth threshold, {bag.name}\n")
    table(("close_depth_m", "matches a frame (first 100, mean)", "least", "map points (whole run)",
           "APE rmse (m)"), rows)


def accuracy(arguments, folder):
    rows = []
    for name in arguments.recordings:
        bag = recording(name)
        out = folder / bag.name
        run(arguments, bag, out)
        frames = rows_of(out / "frames.csv")
        tracked = sum(frame["state"] in TRACKED for frame in frames)
        figures = evaluate(bag, out)
        ape, scale = figures["ape_m"], figures.get("scale_error_percent")
        rows.append((bag.name, f"{figures['length_m']:.1f}",
                     f"{tracked} of {len(frames)}",
                     *(f"{ape[key]:.3f}" for key in
                       ("max", "mean", "median", "min", "rmse", "std", "sse")),
                     "" if scale is None else f"{scale:+.2f}", figures["alignment"]))
    print("Absolute pose error in m\n")
    table(("recording", "length (m)", "frames tracked", "max", "mean", "median", "min", "rmse",
           "std", "sse", "scale (%)", "aligned by"), rows)


def timing(arguments, folder):
    bag = recording(arguments.recordings[0])
    out = folder / bag.name
    run(arguments, bag, out)
    ours = {row["component"]: row for row in rows_of(out / "timing.csv")}
    rows = []
    for name, paper_ms, component in PAPER_TIMING:
        row = ours.pop(component)
        rows.append((component, row["frames"], row["median_ms"], row["p99_ms"], row["max_ms"],
                     f"{name} {paper_ms}"))
    rows += [(name, row["frames"], row["median_ms"], row["p99_ms"], row["max_ms"], "")
             for name, row in sorted(ours.items())]
    print(f"Processor time in ms, {bag.name}; paper: wall time, i7-8550U\n")
    table(("component", "times", "median", "p99", "max", "paper"), rows)


def orb_ms(images):
    """Median time of cv::ORB's detectAndCompute on one thread for one of bench_extraction's sets."""
    bench = ROOT / "build/camvox_test/bench/features/bench_extraction"
    if not bench.is_file():
        raise Failed(f"{bench} is not built: bringup/build")
    done = subprocess.run([bench, "2"], capture_output=True, text=True, check=True)
    line = re.search(rf"^{re.escape(images)} .*?\].*?([\d.]+) \[", done.stdout, re.MULTILINE)
    if not line:
        raise Failed(f"{bench}: no images named {images}")
    return float(line.group(1))


def yardstick(arguments, folder):
    """The run stands between two measurements of the yardstick on the same machine."""
    bag = recording(arguments.recordings[0])
    before_ms = orb_ms(arguments.images)
    out = folder / bag.name
    run(arguments, bag, out)
    after_ms = orb_ms(arguments.images)
    orb, rows = (before_ms + after_ms) / 2, []
    tracking = sorted(float(row["time_ms"]) for row in rows_of(out / "frames.csv")[1:])
    for name, value in (("tracking, median", tracking[len(tracking) // 2]),
                        ("tracking, p99", tracking[len(tracking) * 99 // 100])):
        rows.append((name, f"{value:.2f}", f"{value / orb:.2f}"))
    rows.append(("cv::ORB before and after", f"{before_ms:.2f}, {after_ms:.2f}", "1"))
    print(f"Processor time, {bag.name}; yardstick on {arguments.images}\n")
    table(("what", "ms", "ratio"), rows)


def digests(out, files):
    return {name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in files}


def repeat(arguments, folder):
    """Same input, same bytes: trajectories and map of every run against the first."""
    files = ("trajectory.tum", "odometry.tum", "keyframes.tum", "map.mcap", "dense_map.ply")
    bag, rows, first, differ = recording(arguments.recordings[0]), [], None, 0
    for number in range(1, arguments.runs + 1):
        out = folder / "run"
        run(arguments, bag, out)
        now = digests(out, files)
        first = first or now
        differ += now != first
        rows.append((number, *("equal" if now[name] == first[name] else "DIFFERS"
                               for name in files)))
    print(f"{arguments.runs} lockstep runs of {bag.name}: {differ} differ from the first\n")
    table(("run", *files), rows)
    return 1 if differ else 0


def carry_out(parser, domain, work):
    """Calls `work` with the arguments and a folder, which stays only with --keep; the exit code."""
    parser.add_argument("--domain", type=int, default=domain, help="ROS_DOMAIN_ID of the runs")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for what the runs leave")
    arguments = parser.parse_args()
    folder = arguments.keep or pathlib.Path(tempfile.mkdtemp(prefix="camvox_experiments_"))
    try:
        return work(arguments, folder.absolute()) or 0
    except Failed as failure:
        print(failure, file=sys.stderr)
        return 1
    finally:
        if not arguments.keep:
            shutil.rmtree(folder, ignore_errors=True)


def main():
    commands = {"close-depth": (close_depth, ["demo"]), "accuracy": (accuracy, list(PRESETS[:6])),
                "timing": (timing, ["demo"]), "yardstick": (yardstick, ["loop_400m"]),
                "repeat": (repeat, ["demo"])}
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiment", choices=commands)
    parser.add_argument("recordings", nargs="*", help="folders or names of presets")
    parser.add_argument("--config", default="replay.yaml", help="a file in config/")
    parser.add_argument("--runs", type=int, default=10, help="of repeat")
    parser.add_argument("--images", default="synthetic 1520x568",
                        help="of yardstick: a line of bench_extraction")

    def work(arguments, folder):
        experiment, default = commands[arguments.experiment]
        arguments.recordings = arguments.recordings or default
        return experiment(arguments, folder)

    return carry_out(parser, 96, work)


if __name__ == "__main__":
    sys.exit(main())
