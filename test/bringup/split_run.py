#!/usr/bin/python3
"""Runs a recording with front end and back end in two containers: two processes, or two hosts.

Two network namespaces joined by a veth pair stand for two hosts; each has a /dev/shm of its own.
That needs no root where the kernel allows user namespaces.
"""
import csv
import json
import pathlib
import shutil
import signal
import subprocess

FRONT_IP, BACK_IP = "10.60.0.1", "10.60.0.2"
HOSTS_SCRIPT = f"""
mount -t tmpfs none /dev/shm && ip link set lo up || exit 1
unshare --net --mount sh -c 'mount -t tmpfs none /dev/shm; ip link set lo up; echo up; exec sleep 1d' &
back=$!
sleep 0.2
ip link add veth0 type veth peer name veth1 netns $back || exit 1
ip addr add {FRONT_IP}/24 dev veth0 && ip link set veth0 up || exit 1
nsenter -t $back -n sh -c 'ip addr add {BACK_IP}/24 dev veth1; ip link set veth1 up' || exit 1
echo ready $back
trap "kill $back" EXIT
read end
"""


class OneHost:
    """Both processes on this machine."""

    options = []

    def front(self, command):
        return command

    def back(self, command):
        return command

    def close(self):
        pass


class TwoHosts:
    """A front and a back host. Raises OSError where the kernel forbids it."""

    options = ["--set", "container.network=subnet"]

    def __init__(self):
        self._process = subprocess.Popen(
            ["unshare", "--user", "--map-root-user", "--net", "--mount", "sh", "-c", HOSTS_SCRIPT],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = ""
        for line in self._process.stdout:
            said += line
            if line.startswith("ready "):
                self._back_pid = int(line.split()[1])
                return
        self.close()
        raise OSError("no private network here: " + said.strip())

    @staticmethod
    def _enter(pid, command):
        return ["nsenter", "-t", str(pid), "-U", "--preserve-credentials", "-n", "-m", "--"] + command

    def front(self, command):
        return self._enter(self._process.pid, command)

    def back(self, command):
        return self._enter(self._back_pid, command)

    def set_link(self, state):
        subprocess.run(self.front(["ip", "link", "set", "veth0", state]), check=True)

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


class Runs:
    """Runs of one recording, each with a folder of its own under `work`."""

    def __init__(self, recording, work, camvox="camvox"):
        self.recording = pathlib.Path(recording).resolve()
        self.work = pathlib.Path(work).resolve()
        self.camvox = shutil.which(str(camvox)) or str(pathlib.Path(camvox).resolve())

    def start(self, config, output, more, prefix=lambda command: command):
        """Starts `camvox run`; its log is beside its output folder."""
        output.parent.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(output, ignore_errors=True)
        command = [self.camvox, "run", config, "--parameters", str(self.recording / "rig.yaml"),
                   "--out", str(output)] + more
        with open(str(output) + ".log", "wb") as log:
            return subprocess.Popen(prefix(command), stdout=log, stderr=subprocess.STDOUT)

    def one(self, name, more):
        """One container with everything in it."""
        output = self.work / name
        run = self.start("replay.yaml", output, ["--bag", str(self.recording)] + more)
        finish(run, output)
        return output

    def split(self, name, more, hosts=None, front_more=(), meanwhile=None):
        """Front end and back end. `meanwhile` is called with this and the back end's process while
        they run; it returns the process that is the back end then."""
        hosts = hosts or OneHost()
        front_output = self.work / name / "front"
        back_output = self.work / name / "back"
        back = self.start("back_end.yaml", back_output, more + hosts.options, hosts.back)
        try:
            front = self.start("front_end.yaml", front_output,
                               ["--bag", str(self.recording)] + more + hosts.options + list(front_more),
                               hosts.front)
            try:
                if meanwhile:
                    back = meanwhile(back)
                finish(front, front_output)
            finally:
                front.kill()
            back.send_signal(signal.SIGINT)
            finish(back, back_output)
        finally:
            back.kill()
        return front_output, back_output

    def compare(self, reference, estimate, align="none"):
        """What `camvox evaluate` says of two trajectories."""
        file = pathlib.Path(estimate).with_suffix(".json")
        subprocess.run([self.camvox, "evaluate", str(reference), str(estimate), "--align", align,
                        "--json", str(file)], check=True, stdout=subprocess.DEVNULL)
        return json.loads(file.read_text())


def finish(process, output, timeout_s=600):
    """Waits for the end; raises RuntimeError with the log if it is not a good one."""
    code = process.wait(timeout=timeout_s)
    if code != 0:
        log = pathlib.Path(str(output) + ".log").read_text(errors="replace")
        raise RuntimeError(f"{output}: exit code {code}\n{log[-3000:]}")


def states(output):
    """How many frames were in each state of tracking."""
    counts = {}
    with open(output / "frames.csv", newline="") as file:
        for row in csv.DictReader(file):
            counts[row["state"]] = counts.get(row["state"], 0) + 1
    return counts
