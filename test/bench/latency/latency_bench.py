#!/usr/bin/python3
"""Replays a recording in real time with all components, and prints how long after its inputs each
frame's odometry leaves; the same for the frames around loop corrections, if there were any, so that
it shows for how long a correction holds a frame back. All on this machine: keep it quiet. The load
is printed, too.

    latency_bench.py CAMVOX PREFIX RECORDING [--duration S] [--start S] [--rate R] [--out DIR]
"""
import argparse
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

# A correction is solved, applied and sent within this time before tracking takes it over; after it,
# mapping adjusts the whole map.
NEAR_S = 1.0
FAR_S = 5.0
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
         f"replay.start_offset_s={options.start}", "--set", f"replay.rate={options.rate}", "--set", "mapping.wait_for_loop_closing=false",
         "--out", str(output), "--overwrite"],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if result.returncode != 0:
        sys.exit(result.stdout[-3000:])


def latencies_ms(rows, key="last_input_ns"):
    return [1e-6 * (row["odometry_ns"] - row[key]) for row in rows]


def table(first, lines):
    """Markdown; a line is a name and its times in ms."""
    print(f"| {first} | frames | median | p95 | p99 | max |\n| --- |" + " ---: |" * 5)
    for name, times in lines:
        cells = [f"{percentile(times, share):.1f}" for share in (0.5, 0.95, 0.99, 1.0)]
        print(f"| {name} | {len(times)} | " + " | ".join(cells) + " |")


def corrections(frames):
    """Stamps of the frames that were the first of a new epoch of the map."""
    known = [row for row in frames if row["state"] == "ok"]
    return [int(row["stamp_ns"]) for before, row in zip(known, known[1:])
            if row["map_epoch"] != before["map_epoch"]]


def report_corrections(whole, frames):
    stamps = corrections(frames)
    print(f"\n{len(stamps)} loop corrections reached tracking")
    if not stamps:
        return
    distance_s = {row["image_stamp_ns"]: min(1e-9 * abs(row["image_stamp_ns"] - stamp)
                                             for stamp in stamps) for row in whole}
    first = [row for row in whole if row["image_stamp_ns"] in stamps]
    near = [row for row in whole if distance_s[row["image_stamp_ns"]] <= NEAR_S]
    far = [row for row in whole if distance_s[row["image_stamp_ns"]] > FAR_S]
    work_ms = {int(row["stamp_ns"]): float(row["time_ms"]) for row in frames}
    groups = [(name, rows) for name, rows in (
        ("the first with the corrected map", first),
        (f"within {NEAR_S:g} s of one", near),
        (f"more than {FAR_S:g} s from any", far)) if rows]
    table("ms, last input in -> odometry out",
          [(name, latencies_ms(rows)) for name, rows in groups])
    print()
    table("ms, tracking's work",
          [(name, [work_ms[row["image_stamp_ns"]] for row in rows]) for name, rows in groups])
    if near and far:
        held_ms = max(latencies_ms(near)) - percentile(latencies_ms(far), 0.5)
        print(f"\nHeld back near a correction, at most: {held_ms:.1f} ms "
              "(the slowest frame there against the median far from any)")


def report(output):
    with open(output / "latency.csv", newline="") as file:
        rows = [{key: int(value) for key, value in row.items()} for row in csv.DictReader(file)]
    with open(output / "frames.csv", newline="") as file:
        frames = list(csv.DictReader(file))
    stamps = {int(row["stamp_ns"]) for row in frames}
    tracked = sum(row["state"] == "ok" for row in frames)
    whole = [row for row in rows if row["odometry_ns"] and row["last_input_ns"]]
    # The end of the last image's scan is not in the recording any more.
    dropped = [row for row in rows[:-1] if row["image_stamp_ns"] not in stamps]
    print(f"{len(rows)} images, {tracked} frames tracked, {len(dropped)} dropped "
          f"(the last image, whose scan is cut, does not count)\n")
    table("ms", [("last input in -> odometry out", latencies_ms(whole)),
                 ("image in -> odometry out", latencies_ms(whole, "image_in_ns"))])
    report_corrections(whole, frames)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("camvox")
    parser.add_argument("prefix")
    parser.add_argument("recording")
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--start", type=float, default=0.0)
    parser.add_argument("--rate", type=float, default=1.0, help="of the replay; 1: real time")
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
