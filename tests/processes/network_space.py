# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Networks that nobody else sees: the whole test program goes into a network and mount namespace of its own first, so
that all that it makes is gone when it ends, however it ends."""
import json
import os
import shutil
import subprocess
import sys
import unittest

INSIDE = "TESSERA_OWN_NETWORK"
TIME_LIMIT_S = 20
NEEDED = {"ip": "iproute2", "tc": "iproute2", "nft": "nftables", "unshare": "util-linux"}


def run(*command, text=None):
    done = subprocess.run(command, input=text, text=True, capture_output=True, timeout=TIME_LIMIT_S, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout


def enter(*programs):
    """Returns inside such namespaces only: starts this Python program again in them. Skips where none are permitted."""
    if INSIDE in os.environ:
        return
    for program in ("unshare", "ip", *programs):
        if shutil.which(program) is None:
            raise RuntimeError(f"{program} is not installed: apt-get install {NEEDED[program]}")
    # As root without a user namespace, which containers often do not permit.
    ways = [["unshare", "-nm"]] if os.geteuid() == 0 else []
    for way in [*ways, ["unshare", "-rnm"]]:
        # A /run of its own, as names of namespaces are files there.
        way += ["sh", "-c", 'mount -t tmpfs tmpfs /run && exec "$@"', "sh"]
        tried = subprocess.run([*way, "ip", "netns", "add", "trial"], capture_output=True, text=True, timeout=TIME_LIMIT_S,
                               check=False)
        if tried.returncode == 0:
            os.environ[INSIDE] = "1"
            os.execvp(way[0], [*way, sys.executable, *sys.orig_argv[1:]])
    print(f"skipped: no network namespaces permitted here: {tried.stderr.strip()}", file=sys.stderr)
    raise unittest.SkipTest("no network namespaces")


class Network:
    """Hosts on one bridge, each in a namespace of its own with eth0 at 10.77.0.(its number + 1)."""

    def __init__(self, hosts):
        self.hosts = hosts
        # Nobody asks for group members here, so the bridge must pass multicast on to all.
        links = ["link add bridge0 type bridge mcast_snooping 0", "link set bridge0 up"]
        for i in range(hosts):
            run("ip", "netns", "add", self.name(i))
            links += [f"link add port{i} type veth peer name eth0 netns {self.name(i)}",
                      f"link set port{i} master bridge0 up"]
        run("ip", "-batch", "-", text="\n".join(links) + "\n")
        for i in range(hosts):
            inside = ["link set lo up", "link set eth0 up", f"address add {self.address(i)}/24 dev eth0",
                      "route add 224.0.0.0/4 dev eth0"]
            run("ip", "-netns", self.name(i), "-batch", "-", text="\n".join(inside) + "\n")

    @staticmethod
    def name(i):
        return f"host{i}"

    @staticmethod
    def address(i):
        return f"10.77.0.{i + 1}"

    def inside(self, i):
        """What a command begins with to run on a host."""
        return ["ip", "netns", "exec", self.name(i)]

    def shape(self, i, loss_percent=0, deaf_to=()):
        """What host i does not hear, from now on: a share of all, drawn anew for each datagram, and some hosts at all."""
        rules = [f"ip saddr {{ {', '.join(map(self.address, deaf_to))} }} counter drop"] if deaf_to else []
        if loss_percent:
            rules.append(f"ip saddr != {self.address(i)} numgen random mod 100 < {loss_percent} counter drop")
        table = ["table ip shape {}", "delete table ip shape", "table ip shape {", "chain arriving {",
                 "type filter hook prerouting priority raw;", *rules, "}", "}", ""]
        run(*self.inside(i), "nft", "-f", "-", text="\n".join(table))

    def shape_all(self, **how):
        for i in range(self.hosts):
            self.shape(i, **how)

    def partition(self, groups):
        """groups: of each host a number; hosts of different numbers do not hear each other."""
        for i, own in enumerate(groups):
            self.shape(i, deaf_to=[other for other, group in enumerate(groups) if group != own])

    def dropped(self, i):
        """Datagrams that the shape of host i dropped since it was given."""
        found = json.loads(run(*self.inside(i), "nft", "-j", "list", "table", "ip", "shape"))
        rules = [entry["rule"] for entry in found["nftables"] if "rule" in entry]
        return sum(part["counter"]["packets"] for rule in rules for part in rule["expr"] if "counter" in part)

    def queue(self, i, *discipline):
        """Gives what host i sends to a queueing discipline of tc's, as "netem", "delay", "10ms"."""
        run("tc", "-netns", self.name(i), "qdisc", "replace", "dev", "eth0", "root", *discipline)

    def queue_statistics(self, i):
        return json.loads(run("tc", "-netns", self.name(i), "-s", "-j", "qdisc", "show", "dev", "eth0"))[0]

    def close(self):
        # A namespace goes some time after its name, and would keep its end of a link until then.
        run("ip", "-batch", "-", text="".join(f"link delete port{i}\n" for i in range(self.hosts)) + "link delete bridge0\n")
        for i in range(self.hosts):
            run("ip", "netns", "delete", self.name(i))
