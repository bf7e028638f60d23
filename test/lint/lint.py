#!/usr/bin/python3
"""Checks rules of this workspace that no compiler knows. Prints file:line: what, and fails on any."""
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
CODE = {".cpp", ".hpp"}
MAX_LINES = 500

MIDDLEWARE = re.compile(r'#include [<"](fastdds|fastrtps|fastcdr|class_loader|camvox/(interfaces|component|dds|container))')
DDS = re.compile(r'#include [<"](fastdds|fastrtps|fastcdr)/|eprosima::')
SIDE_EFFECTS = re.compile(r"std::(cout|cerr|clog)\b|\b(abort|exit|quick_exit)\(|(system|steady|high_resolution)_clock::now")
UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX)\b|not implemented")


def tracked_files():
    """What git knows of, or would add; without git, all that lies in the workspace's folders."""
    if shutil.which("git"):
        listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                                capture_output=True, text=True, check=False)
        if listed.returncode == 0:
            return [ROOT / n for n in listed.stdout.split("\n") if n and (ROOT / n).is_file()]
    tops = ("src", "interfaces", "components", "bringup", "config", "test")
    return [p for top in tops for p in (ROOT / top).rglob("*") if p.is_file()]


def line_rules(path):
    """(pattern, message) pairs that hold for the file."""
    parts = path.relative_to(ROOT).parts
    if parts[0] == "src":
        yield MIDDLEWARE, "a library in src knows no middleware and no component"
        yield SIDE_EFFECTS, "a library in src has no console, no clock, and ends no process"
    if parts[0] == "components" and parts[1] not in ("base", "dds"):
        yield DDS, "a component names no DDS type; use its context"
    if parts[:2] != ("test", "lint"):
        yield UNFINISHED, "unfinished work is an issue, not a comment"


def check_file(path):
    text = path.read_text(errors="replace")
    lines = text.split("\n")
    name = path.relative_to(ROOT)
    rules = list(line_rules(path))
    for number, line in enumerate(lines, 1):
        for pattern, message in rules:
            if pattern.search(line):
                yield f"{name}:{number}: {message}: {line.strip()}"
    if len(lines) > MAX_LINES:
        yield f"{name}:{MAX_LINES}: {len(lines)} lines; split it ({MAX_LINES} at most)"
    if path.suffix == ".hpp" and not text.lstrip().startswith("#pragma once"):
        yield f"{name}:1: a header starts with #pragma once"


def check_format(paths):
    tool = shutil.which("clang-format")
    if tool is None:
        print("clang-format is not installed: formatting not checked")
        return
    result = subprocess.run([tool, "--dry-run", "--ferror-limit=1", *map(str, paths)],
                            capture_output=True, text=True, check=False)
    for line in result.stderr.split("\n"):
        if "code should be clang-formatted" in line:
            yield line.replace(str(ROOT) + "/", "")


def main():
    files = [p for p in tracked_files() if p.suffix in CODE]
    problems = [problem for path in files for problem in check_file(path)]
    problems += check_format(files)
    print("\n".join(problems) or f"{len(files)} files keep the rules")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
