#!/usr/bin/python3
"""Counts test results: each case of a GoogleTest program, and each other ctest as one.

A program that crashed, timed out, or left no result file counts as one failure beside the cases
that it reported. Prints the failed ones, and closes with "N passed, N failed[, N skipped]".
"""
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def count_cases(path):
    """(passed, failed names, skipped) of one GoogleTest XML; None if it cannot be read."""
    try:
        suites = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError):
        return None
    passed, failed, skipped = 0, [], 0
    for case in suites.iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            failed.append(f"{case.get('classname')}.{case.get('name')}")
        elif case.get("status") == "notrun" or case.find("skipped") is not None:
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def count_program(test, folder):
    """(passed, failed names, skipped) of one ctest."""
    name, status = test.get("name"), test.get("status")
    ok = status == "run"
    cases = count_cases(folder / f"{name}.gtest.xml")
    if cases is None:
        if status in ("notrun", "disabled"):
            skipped = test.find("skipped") is not None and test.find("skipped").get("message", "")
            # "SKIP_RETURN_CODE" is a skip; a missing program or a failed fixture is a failure
            return (0, [], 1) if skipped and "SKIP" in skipped.upper() else (0, [f"{name} (did not run)"], 0)
        return (1, [], 0) if ok else (0, [name], 0)
    passed, failed, skipped = cases
    if not ok and not failed:
        failed = [f"{name} (crashed or timed out)"]
    return passed, failed, skipped


def main():
    junit, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    passed, failed, skipped = 0, [], 0
    try:
        tests = ElementTree.parse(junit).getroot().iter("testcase")
    except (ElementTree.ParseError, OSError) as error:
        tests = []
        failed.append(f"ctest left no results: {error}")
    for test in tests:
        counts = count_program(test, folder)
        passed, failed, skipped = passed + counts[0], failed + counts[1], skipped + counts[2]
    for name in failed:
        print(f"FAILED {name}")
    print(f"{passed} passed, {len(failed)} failed" + (f", {skipped} skipped" if skipped else ""))
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
