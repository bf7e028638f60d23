#!/usr/bin/python3
"""Replays a recording in real time with all components, and prints how long after its inputs each
frame's odometry leaves. All on this machine: keep it quiet. The load is printed, too.

    latency_bench.py CAMVOX PREFIX RECORDING [--duration S] [--start S] [--out DIR]
"""
import argparse
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

COMPONENT = "  - {plugin: bench::LatencyComponent, name: latency}\n"


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * (len(values) - 1) + 0.5))]


def config_text(camvox):
    """replay.yaml with the component that measures."""
    installed = pathlib.Path(camvox).resolve().parent.parent / "share/camvox_bringup/config/replay.yaml"
    return installed.read_text().rstrip() + "\n" + COMPONENT


def run(options, output):
    config = output.parent / "latency.yaml"
    config.write_text(config_text(options.camvox))
    path = [options.prefix, os.environ.get("AMENT_PREFIX_PATH", "")]
    environment = dict(os.environ, AMENT_PREFIX_PATH=":".join(filter(None, path)))
    recording = pathlib.Path(options.recording)
    result = subprocess.run(
        [options.camvox, "run", str(config), "--bag", str(recording), "--parameters",
         str(recording / "rig.yaml"), "--set", f"replay.duration_s={options.duration}", "--set",
         f"replay.start_offset_s={options.start}", "--set", "mapping.wait_for_loop_closing=false",
         "--out", str(output), "--overwrite"],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if result.returncode != 0:
        sys.exit(result.stdout[-3000:])


def report(output):
    with open(output / "latency.csv", newline="") as file:
        rows = [{key: int(value) for key, value in row.items()} for row in csv.DictReader(file)]
    with open(output / "frames.csv", newline="") as file:
        states = {int(row["stamp_ns"]): row["state"] for row in csv.DictReader(file)}
    tracked = sum(state == "ok" for state in states.values())
    whole = [row for row in rows if row["odometry_ns"] and row["last_input_ns"]]
    # The end of the last image's scan is not in the recording any more.
    dropped = [row for row in rows[:-1] if row["image_stamp_ns"] not in states]
    print(f"{len(rows)} images, {tracked} frames tracked, {len(dropped)} dropped "
          f"(the last image, whose scan is cut, does not count)\n")
    print("| ms | median | p95 | p99 | max |\n| --- | --- | --- | --- | --- |")
    for name, key in (("last input in -> odometry out", "last_input_ns"),
                      ("image in -> odometry out", "image_in_ns")):
        times = [1e-6 * (row["odometry_ns"] - row[key]) for row in whole]
        cells = [percentile(times, share) for share in (0.5, 0.95, 0.99, 1.0)]
        print(f"| {name} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("camvox")
    parser.add_argument("prefix")
    parser.add_argument("recording")
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--start", type=float, default=0.0)
    parser.add_argument("--out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="latency_") as folder:
        output = pathlib.Path(options.out or folder) / "out"
        output.parent.mkdir(parents=True, exist_ok=True)
        before = os.getloadavg()[0]
        run(options, output)
        print(f"load {before:.2f} before, {os.getloadavg()[0]:.2f} after, {os.cpu_count()} cores")
        report(output)


if __name__ == "__main__":
    main()
