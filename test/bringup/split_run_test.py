#!/usr/bin/python3
"""Front end and back end in two containers do what one container does. Usage: CAMVOX TEST..."""
import fcntl
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from split_run import Runs, TwoHosts, log_of, stamps, states  # noqa: E402

CAMVOX = sys.argv.pop(1)


def events(side):
    """What a container's log says of its run, without the config."""
    lines = [line for line in log_of(side).splitlines() if line.startswith("[")]
    return "\n".join(lines[-150:])


class SplitRun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory(prefix="split_run_")
        work = pathlib.Path(cls._folder.name)
        subprocess.run([CAMVOX, "simulate", "demo", "--set", "duration_s=12.0", "-o",
                        str(work / "recording")], check=True, stdout=subprocess.DEVNULL)
        cls.runs = Runs(work / "recording", work, CAMVOX)

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    def expect_same(self, one, outputs):
        for output in outputs:
            for name in ("trajectory.tum", "keyframes.tum"):
                self.assertEqual((one / name).read_bytes(), (output / name).read_bytes(),
                                 f"{output / name}: differs from that of one container")

    def test_lockstep_gives_the_same_bytes(self):
        one = self.runs.one("one", ["--lockstep"])
        self.assertGreater(states(one).get("ok", 0), 30)
        with self.subTest("two processes"):
            self.expect_same(one, self.runs.split("processes", ["--lockstep"]))
        with self.subTest("two hosts"):
            self.expect_same(one, self.runs.split("hosts", ["--lockstep"], self.two_hosts()))

    def expect_whole(self, front, back):
        """Each frame was tracked, and the back end has what the front end made."""
        counts = states(front)
        # The first frame starts the map; the last one may lack the end of its scan.
        self.assertGreaterEqual(counts.get("ok", 0) + 1, sum(counts.values()), counts)
        made = set(stamps(front / "keyframes.tum"))
        self.assertGreater(len(made), 2)
        logs = "".join(f"\n-- {side.name}:\n{events(side)}" for side in (front, back))
        self.assertFalse(made - set(stamps(back / "keyframes.tum")), "keyframes are lacking" + logs)
        same = self.runs.compare(front / "keyframes.tum", back / "keyframes.tum")
        self.assertLess(same["ape_m"]["max"], 0.01)

    # The robot stands still for 3 s. Slower than real: 20 s remain after the kill. Mostly the map is
    # whole after 3 s; what a killed process held in shared memory can keep its messages back longer.
    SLOW = ["--set", "replay.start_offset_s=2.5", "--set", "replay.rate=0.3"]
    DEBUG = ["--set", "container.log_level=debug"]  # who saw whom, should it fail

    def test_tracking_goes_on_without_the_back_end_and_the_map_is_whole_again(self):
        fault = self.runs.kill_back_end("killed", 12.0, more=self.DEBUG)
        front, back = self.runs.split("killed", self.DEBUG, front_more=self.SLOW, meanwhile=fault)
        self.expect_whole(front, back)

    def two_hosts(self):
        try:
            hosts = TwoHosts()
        except OSError as error:
            self.skipTest(str(error))
        self.addCleanup(hosts.close)
        return hosts


def reserve_domain():
    """A DDS domain of our own until we end; the same locks as test/support/dds_domain.cpp."""
    for domain in range(20, 100):
        lock = open(pathlib.Path(tempfile.gettempdir()) / f"camvox_test_domain_{domain}.lock", "w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        return lock
    raise RuntimeError("no free DDS domain for this test")


if __name__ == "__main__":
    domain_lock = reserve_domain()
    unittest.main(verbosity=2)
