#!/usr/bin/python3
"""The type generator refuses bad definitions, and says where and why.

Usage: generator_test.py <interfaces folder>
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

INTERFACES = pathlib.Path(sys.argv.pop(1))

GOOD_HEADER = "struct Stamp { long long stamp_ns; };\n"


class Generator(unittest.TestCase):
    def generate(self, idl=GOOD_HEADER, messages=None):
        """Runs the generator on these definitions; its exit status and its last line of error."""
        folder = pathlib.Path(self.enterContext_(tempfile.TemporaryDirectory()))
        (folder / "msg").mkdir()
        for name, text in (messages or {}).items():
            path = folder / "msg" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        (folder / "plain.idl").write_text(f"module plain {{ module msg {{\n{idl}\n}}; }};\n")
        self.out = folder / "out"
        done = subprocess.run(
            ["/usr/bin/python3", "-B", INTERFACES / "scripts" / "generate_types.py", "--msg", folder / "msg",
             "--idl", folder / "plain.idl", "--out", self.out], capture_output=True, text=True)
        return done.returncode, done.stderr.strip()

    def enterContext_(self, context):
        self.addCleanup(context.__exit__, None, None, None)
        return context.__enter__()

    def assert_refused(self, idl, *words):
        status, error = self.generate(idl)
        self.assertNotEqual(status, 0, "accepted")
        for word in words:
            self.assertIn(word, error)
        self.assertNotIn("Traceback", error)

    def test_good_definition_is_accepted(self):
        status, error = self.generate(GOOD_HEADER + "struct A { plain::msg::Stamp s; octet a; octet pad[7]; };")
        self.assertEqual((status, error), (0, ""))
        self.assertIn("visitor.fixed(message.s());", (self.out / "camvox/interfaces/plain.hpp").read_text())

    def test_lists_become_bounded_sequences_without_counter(self):
        self.generate("const unsigned long N = 6;\n"
                      "struct A { unsigned long points_count; unsigned long padding; float points[plain::msg::N][4]; };")
        source = (self.out / "plain_types.cpp").read_text()
        self.assertIn("float32[<=24] points", source)
        self.assertNotIn("points_count", source)

    def test_misaligned_member(self):
        self.assert_refused("struct Bad { octet a; double b; octet pad[7]; };", "plain.idl", "Bad.b", "offset 1", "multiple of 8")

    def test_misaligned_nested_struct(self):
        self.assert_refused(GOOD_HEADER + "struct Bad { unsigned long a; plain::msg::Stamp s; };", "Bad.s", "offset 4")

    def test_missing_padding_at_the_end(self):
        self.assert_refused("struct Bad { double a; octet b; };", "Bad", "size 9", "padding at the end")

    def test_members_that_are_not_plain(self):
        for member in ("string name", "sequence<octet> data", "wchar c", "boolean b", "plain::msg::Later l", "Mode mode"):
            self.assert_refused(f"struct Bad {{ {member}; }};", "plain.idl", "Bad", f"'{member}'", "not a plain member")

    def test_unknown_capacity(self):
        self.assert_refused("struct Bad { octet data[plain::msg::NOWHERE]; };", "plain.idl", "Bad.data", "NOWHERE")

    def test_counter_that_is_not_an_unsigned_long(self):
        self.assert_refused("struct Bad { unsigned long long data_count; octet data[8]; };", "Bad.data_count", "unsigned long")

    def test_lists_of_structs(self):
        self.assert_refused(GOOD_HEADER + "struct Bad { unsigned long s_count; unsigned long pad; plain::msg::Stamp s[4]; };",
                            "Bad.s", "primitives")

    def test_two_members_with_one_ros_name(self):
        self.assert_refused("struct Bad { double T_a; double t_a; };", "Bad", "t_a")

    def test_bad_ros_message_names_the_file(self):
        status, error = self.generate(messages={"foo_msgs/msg/Bad.msg": "uint8 a\nnonsense\n"})
        self.assertNotEqual(status, 0)
        self.assertIn("Bad.msg", error)
        self.assertNotIn("Traceback", error)

    def test_missing_ros_dependency_names_both(self):
        status, error = self.generate(messages={"foo_msgs/msg/Bad.msg": "bar_msgs/Other other\n"})
        self.assertNotEqual(status, 0)
        self.assertIn("foo_msgs/msg/Bad", error)
        self.assertIn("bar_msgs/msg/Other", error)
        self.assertNotIn("Traceback", error)

    def test_nothing_is_written_when_nothing_changed(self):
        folder = pathlib.Path(self.enterContext_(tempfile.TemporaryDirectory()))
        command = ["/usr/bin/python3", "-B", INTERFACES / "scripts" / "generate_types.py", "--msg", INTERFACES / "msg",
                   "--idl", INTERFACES / "idl" / "camvox_interfaces.idl", "--out", folder]
        subprocess.run(command, check=True)
        first = {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}
        subprocess.run(command, check=True)
        self.assertEqual(first, {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()})
        self.assertGreater(len(first), 10)


if __name__ == "__main__":
    unittest.main(verbosity=2)
