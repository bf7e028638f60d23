#!/usr/bin/python3
"""Tests of count_results.py: what ctest and GoogleTest leave behind, counted."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[1] / "count_results.py"


class CountResults(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def count(self, ctests):
        junit = self.folder / "ctest.xml"
        junit.write_text(f"<testsuite>{ctests}</testsuite>")
        result = subprocess.run([sys.executable, SCRIPT, junit, self.folder], capture_output=True, text=True)
        return result.returncode, result.stdout.strip().split("\n")

    def gtest(self, name, cases):
        (self.folder / f"{name}.gtest.xml").write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")

    def test_counts_cases_of_programs_and_other_tests(self):
        self.gtest("a", '<testcase name="x" classname="A" status="run"/><testcase name="y" classname="A" status="run"/>'
                        '<testcase name="z" classname="A" status="run"><skipped/></testcase>')
        code, lines = self.count('<testcase name="a" status="run"/><testcase name="script" status="run"/>')
        self.assertEqual((code, lines), (0, ["3 passed, 0 failed, 1 skipped"]))

    def test_names_failed_cases(self):
        self.gtest("a", '<testcase name="x" classname="A" status="run"><failure/></testcase>')
        code, lines = self.count('<testcase name="a" status="fail"/><testcase name="script" status="fail"/>')
        self.assertEqual((code, lines), (1, ["FAILED A.x", "FAILED script", "0 passed, 2 failed"]))

    def test_crash_and_timeout_count_as_failed(self):
        self.gtest("late", '<testcase name="x" classname="L" status="run"/>')  # passed, then crashed
        code, lines = self.count('<testcase name="late" status="fail"/><testcase name="gone" status="fail"/>')
        self.assertEqual(code, 1)
        self.assertEqual(lines, ["FAILED late (crashed or timed out)", "FAILED gone", "1 passed, 2 failed"])

    def test_program_that_was_not_built_counts_as_failed(self):
        code, lines = self.count('<testcase name="a" status="notrun"><skipped message="Unable to find executable"/></testcase>')
        self.assertEqual((code, lines[-1]), (1, "0 passed, 1 failed"))

    def test_skipped_by_return_code(self):
        code, lines = self.count('<testcase name="a" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/></testcase>'
                                 '<testcase name="b" status="run"/>')
        self.assertEqual((code, lines), (0, ["1 passed, 0 failed, 1 skipped"]))

    def test_nothing_run_is_no_success(self):
        self.assertEqual(self.count("")[0], 1)
        (self.folder / "ctest.xml").write_text("broken")
        result = subprocess.run([sys.executable, SCRIPT, self.folder / "ctest.xml", self.folder], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertIn("0 passed, 1 failed", result.stdout)


if __name__ == "__main__":
    unittest.main()
