#!/usr/bin/python3
"""Runs a recording with front end and back end in two containers, in two processes and on two
hosts, with faults of the back end and of the link, and compares with one container. By hand it
prints a table for a whole recording:

    split_run.py RECORDING [--camvox FILE] [--work DIR] [--at S] [--cut S] [--only NAME...]

Two network namespaces joined by a veth pair stand for two hosts; each has a /dev/shm of its own.
That needs no root where the kernel allows user namespaces.
"""
import argparse
import csv
import json
import pathlib
import shutil
import signal
import subprocess
import time

FRONT_IP, BACK_IP = "10.60.0.1", "10.60.0.2"
HOSTS_SCRIPT = f"""
mount -t tmpfs none /dev/shm && ip link set lo up || exit 1
unshare --net --mount sh -c 'mount -t tmpfs none /dev/shm; ip link set lo up; echo up; exec sleep 1d' &
back=$!
sleep 0.2
ip link add veth0 type veth peer name veth1 netns $back || exit 1
ip addr add {FRONT_IP}/24 dev veth0 && ip link set veth0 up || exit 1
nsenter -t $back -n sh -c 'ip addr add {BACK_IP}/24 dev veth1; ip link set veth1 up' || exit 1
# A participant sees only the interfaces that run when it starts.
until ip link show veth0 | grep -q "state UP" &&
      nsenter -t $back -n ip link show veth1 | grep -q "state UP"; do sleep 0.1; done
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
        self.camvox = str(pathlib.Path(shutil.which(str(camvox)) or camvox).resolve())

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


    # Faults, for `split(meanwhile=...)`: each returns the back end that runs afterwards.

    def kill_back_end(self, name, after_s, hosts=None, more=()):
        """kill -9 after some time, and a new back end one second later."""
        hosts = hosts or OneHost()

        def fault(back):
            time.sleep(after_s)
            back.kill()
            back.wait()
            time.sleep(1.0)
            return self.start("back_end.yaml", self.work / name / "back",
                              hosts.options + list(more), hosts.back)

        return fault

    @staticmethod
    def cut_link(hosts, after_s, for_s):
        def fault(back):
            time.sleep(after_s)
            hosts.set_link("down")
            time.sleep(for_s)
            hosts.set_link("up")
            return back

        return fault


def finish(process, output, timeout_s=600):
    """Waits for the end; raises RuntimeError with the log if it is not a good one."""
    code = process.wait(timeout=timeout_s)
    if code != 0:
        raise RuntimeError(f"{output}: exit code {code}\n{log_of(output)[-3000:]}")


def log_of(output):
    return pathlib.Path(str(output) + ".log").read_text(errors="replace")


def states(output):
    """How many frames were in each state of tracking."""
    counts = {}
    with open(output / "frames.csv", newline="") as file:
        for row in csv.DictReader(file):
            counts[row["state"]] = counts.get(row["state"], 0) + 1
    return counts


def stamps(file):
    """The stamps of a TUM file as they are written."""
    lines = pathlib.Path(file).read_text().splitlines()
    return [line.split()[0] for line in lines if line and not line.startswith("#")]


def print_row(runs, name, one, front, back):
    difference = runs.compare(one / "trajectory.tum", front / "trajectory.tum")
    ape = runs.compare(runs.recording / "truth_body.tum", front / "trajectory.tum", "se3")
    counts = states(front)
    missing = set(stamps(front / "keyframes.tum")) - set(stamps(back / "keyframes.tum"))
    print(f"| {name} | {counts.pop('ok', 0)} of {sum(states(front).values())} "
          f"| {1000.0 * difference['ape_m']['max']:.1f} | {ape['ape_m']['rmse']:.4f} "
          f"| {len(stamps(back / 'keyframes.tum'))} | {len(missing)} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description="see the top of this file")
    parser.add_argument("recording")
    parser.add_argument("--camvox", default="camvox")
    parser.add_argument("--work", default="output/split_run")
    parser.add_argument("--at", type=float, default=25.0, help="when the fault comes, s")
    parser.add_argument("--cut", type=float, default=10.0, help="how long the link is cut, s")
    parser.add_argument("--only", nargs="*")
    options = parser.parse_args()
    runs = Runs(options.recording, options.work, options.camvox)
    print("| run | frames tracked | max difference to one container (mm) | APE rmse (m) "
          "| keyframes of the back end | lacking there |\n" + "| --- " * 6 + "|")

    def row(name, one, *arguments, **more):
        if options.only and name not in options.only:
            return
        front, back = runs.split(name, *arguments, **more)
        print_row(runs, name, one, front, back)

    lockstep = ["--lockstep"]
    one = runs.one("one", lockstep)
    print_row(runs, "one", one, one, one)
    row("processes", one, lockstep)
    row("processes_live", one, [])
    row("killed", one, [], meanwhile=runs.kill_back_end("killed", options.at))
    hosts = TwoHosts()
    try:
        row("hosts", one, lockstep, hosts)
        row("hosts_live", one, [], hosts)
        row("cut", one, [], hosts, meanwhile=runs.cut_link(hosts, options.at, options.cut))
    finally:
        hosts.close()


if __name__ == "__main__":
    main()
