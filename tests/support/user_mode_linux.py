# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a command as root in a kernel of its own: Debian's User-Mode Linux, an ordinary process that is gone afterwards.
It has what the machine's own kernel may lack, as netem, and its root file system is the machine's, read only."""
import os
import pathlib
import shlex
import shutil
import signal
import subprocess
import tempfile

MODULES = pathlib.Path("/usr/lib/uml/modules")
WHOLE_REGISTERS = pathlib.Path(__file__).with_name("whole_registers.c")
# Beyond the command's own limit: to boot and to power off.
BOOT_LIMIT_S = 60

# The first process in there. Without a power-off at its end the kernel would stop with a panic, which is as well.
INIT = """#!/bin/sh
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t tmpfs tmp /run
mkdir /run/outside
mount -t hostfs -o {folder} none /run/outside
exec >/run/outside/output 2>&1 </dev/null
for module in {modules}; do busybox insmod "$module"; done
ip link set lo up
cd {directory}
{command}
echo $? >/run/outside/status
busybox poweroff -f
"""


class Failed(Exception):
    """There was no such kernel, or it did not come as far as the command."""


def in_order(wanted, modules):
    """Files of kernel modules, each behind those that it needs."""
    needs = {}
    for line in (modules / "modules.dep").read_text().splitlines():
        file, _, rest = line.partition(":")
        needs[file] = rest.split()
    files = []
    for name in wanted:
        file = next((file for file in needs if file.endswith(f"/{name}.ko")), None)
        if file is None:
            raise Failed(f"this kernel has no module {name}")
        # modules.dep names the needed ones nearest first.
        files += [str(modules / one) for one in [*reversed(needs[file]), file]]
    return list(dict.fromkeys(files))


def run(command, directory, environment, modules=(), limit_s=120, memory="256M"):
    """Runs the command in directory; gives its exit status, and all that it wrote as text."""
    for program, package in (("linux.uml", "user-mode-linux"), ("busybox", "busybox")):
        if shutil.which(program) is None:
            raise Failed(f"{program} is not installed: apt-get install {package}")
    tree = sorted(MODULES.iterdir())[-1]
    with tempfile.TemporaryDirectory(prefix="tessera-uml-") as name:
        folder = pathlib.Path(name)
        words = [f"{key}={value}" for key, value in environment.items()]
        init = folder / "init"
        init.write_text(INIT.format(
            folder=folder, modules=" ".join(map(shlex.quote, in_order(modules, tree))), directory=shlex.quote(str(directory)),
            command=shlex.join(["env", "TMPDIR=/run", *words, "timeout", str(limit_s), *map(str, command)])))
        init.chmod(0o755)
        whole_registers = folder / "whole_registers.so"
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", whole_registers, WHOLE_REGISTERS], check=True)
        kernel = subprocess.Popen(
            ["linux.uml", f"mem={memory}", "rootfstype=hostfs", "rootflags=/", "ro", f"init={init}", "con0=null,fd:1", "con=null",
             "quiet", "panic=-1"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            # Its memory is a file there: not every /dev/shm has the room.
            errors="replace", start_new_session=True,
            env={**os.environ, "TMPDIR": name, "LD_PRELOAD": str(whole_registers)})
        try:
            console, _ = kernel.communicate(timeout=limit_s + BOOT_LIMIT_S)
        except subprocess.TimeoutExpired:
            # What runs in there are processes of this machine, all of one group.
            os.killpg(kernel.pid, signal.SIGKILL)
            console, _ = kernel.communicate()
        output, status = folder / "output", folder / "status"
        said = output.read_text(errors="replace") if output.exists() else ""
        if not status.exists():
            raise Failed(f"{said}\n{console}")
        return int(status.read_text()), said
