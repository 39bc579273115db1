# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A network that a test has to itself: this process moves into a namespace with a loopback interface and nothing else."""
import ctypes
import os
import pathlib
import subprocess
import sys
import unittest

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000


def enter():
    """For good; with multicast on the loopback interface. False iff the system does not permit it."""
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.getuid(), os.getgid()
    if libc.unshare(CLONE_NEWNET) != 0:
        if libc.unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
            return False
        # As root in there, or files would seem to belong to somebody else.
        pathlib.Path("/proc/self/setgroups").write_text("deny")
        pathlib.Path("/proc/self/uid_map").write_text(f"0 {user} 1")
        pathlib.Path("/proc/self/gid_map").write_text(f"0 {group} 1")
    return subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=False).returncode == 0


def enter_or_skip():
    """For good; skips the module where the system does not permit it."""
    if not enter():
        print("skipped: no network namespaces permitted here (unshare -rn)", file=sys.stderr)
        raise unittest.SkipTest("no network namespaces")
