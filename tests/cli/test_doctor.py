# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera doctor, in network namespaces that each lack something else."""
import json
import subprocess
import sys
import unittest

from command_case import DONE, FAILURE, TIME_LIMIT_S, USAGE, CommandCase, command_path

UP = "ip link set lo up multicast on"
ROUTE = "ip route add 224.0.0.0/4 dev lo"
URL = "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=100000"
CHECKS = ["LCM URL", "interface", "multicast route", "MTU", "receive buffer", "loopback multicast", "monotonic clock",
          "wall clock", "key file", "real-time priority", "locked memory"]


def namespaces_permitted():
    try:
        return subprocess.run(["unshare", "-rn", "ip", "link"], capture_output=True, timeout=TIME_LIMIT_S,
                              check=False).returncode == 0
    except FileNotFoundError:
        return False


if not namespaces_permitted():
    print("skipped: no network namespaces permitted here (unshare -rn)", file=sys.stderr)
    raise unittest.SkipTest("no network namespaces")


class Doctor(CommandCase):
    def doctor(self, *options, network=(UP, ROUTE), status=DONE):
        """Runs it in a network of its own; gives the run and the checks by name."""
        report = self.folder / "doctor.json"
        script = " && ".join([*network, 'exec "$@"'])
        result = subprocess.run(["unshare", "-rn", "sh", "-c", script, "sh", command_path(), "doctor", "--report",
                                 str(report), *map(str, options)], cwd=self.folder, text=True, capture_output=True,
                                stdin=subprocess.DEVNULL, timeout=TIME_LIMIT_S, check=False)
        self.assertEqual(status, result.returncode, result.stdout + result.stderr)
        self.assertEqual(0 if status == DONE else 1, len(result.stderr.splitlines()), result.stderr)
        content = json.loads(report.read_text())
        checks = {check["check"]: check for check in content["checks"]}
        self.assertEqual(len(checks), len(content["checks"]))
        self.assertEqual(content["stops"], sum(c["state"] == "stops" for c in checks.values()))
        self.assertEqual(content["advice"], sum(c["state"] == "advice" for c in checks.values()))
        for check in checks.values():
            self.assertEqual(check["state"] == "good", check["mend"] == "", check)
            for part in (check["check"], check["found"], check["needed"], check["mend"]):
                self.assertIn(part, result.stdout)
            if check["state"] == "stops":
                self.assertIn(check["check"], result.stderr)
        return result, checks

    def test_a_network_that_works(self):
        _, checks = self.doctor("--url", URL)
        self.assertEqual(CHECKS, list(checks))
        for name in CHECKS[:6]:
            self.assertEqual("good", checks[name]["state"], checks[name])
        self.assertIn("20 of 20 heard", checks["loopback multicast"]["found"])

    def test_no_network_at_all(self):
        _, checks = self.doctor(network=(), status=FAILURE)
        self.assertEqual("stops", checks["interface"]["state"])
        self.assertIn("ip route add 224.0.0.0/4", checks["interface"]["found"])
        self.assertIn("monotonic clock", checks)

    def test_no_route_matters_to_other_tools_only(self):
        _, checks = self.doctor("--url", URL, "--interface", "lo", network=(UP,))
        self.assertEqual("advice", checks["multicast route"]["state"])
        self.assertEqual(ROUTE, checks["multicast route"]["mend"])
        self.assertEqual("good", checks["loopback multicast"]["state"])

    def test_an_interface_without_multicast(self):
        network = ("ip link add v0 type veth peer name v1", "ip addr add 10.9.9.1/24 dev v0", "ip link set v1 up", "ip link set v0 up multicast off")
        _, checks = self.doctor("--interface", "v0", network=network, status=FAILURE)
        self.assertEqual("stops", checks["interface"]["state"])
        self.assertEqual("ip link set v0 up multicast on", checks["interface"]["mend"])

    def test_a_loopback_interface_forwards_multicast_without_saying_so(self):
        _, checks = self.doctor("--url", URL, "--interface", "lo", network=("ip link set lo up multicast off",))
        self.assertEqual("advice", checks["interface"]["state"])
        self.assertEqual("good", checks["loopback multicast"]["state"])

    def test_an_interface_that_is_not_there(self):
        _, checks = self.doctor("--interface", "eth99", status=FAILURE)
        self.assertIn("eth99", checks["interface"]["found"])

    def test_frames_that_are_too_small(self):
        _, checks = self.doctor("--url", URL, network=(UP, ROUTE, "ip link set lo mtu 1435"), status=FAILURE)
        self.assertEqual(("stops", "1435 bytes", "1436 bytes"),
                         tuple(checks["MTU"][key] for key in ("state", "found", "needed")))
        self.assertIn("0 of 20 heard, 20 not sent", checks["loopback multicast"]["found"])
        _, checks = self.doctor("--url", URL, network=(UP, ROUTE, "ip link set lo mtu 1436"))
        self.assertEqual("good", checks["MTU"]["state"])
        self.assertEqual("good", checks["loopback multicast"]["state"])

    def test_a_receive_buffer_that_the_system_does_not_grant(self):
        _, checks = self.doctor("--url", "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=1000000000")
        self.assertEqual("advice", checks["receive buffer"]["state"])
        self.assertIn("net.core.rmem_max=1000000000", checks["receive buffer"]["mend"])

    def test_urls(self):
        for url in ("udpm://", "memq://", "udpm://239.255.76.67:7667", "udpm://10.0.0.1:7667?ttl=1"):
            with self.subTest(url):
                _, checks = self.doctor(f"--url={url}", status=FAILURE)
                self.assertEqual("stops", checks["LCM URL"]["state"])
        for ttl in (0, 2):
            _, checks = self.doctor("--url", f"udpm://239.255.76.67:7667?ttl={ttl}&recv_buf_size=2000")
            self.assertEqual("advice", checks["LCM URL"]["state"])

    def test_the_key_file(self):
        self.assertEqual("advice", self.doctor("--url", URL)[1]["key file"]["state"])
        self.done("key", "new", "--fleet", "fleet.key", "--without-signatures")
        self.assertEqual("good", self.doctor("--url", URL, "--key", "fleet.key")[1]["key file"]["state"])
        (self.folder / "fleet.key").chmod(0o644)
        _, checks = self.doctor("--url", URL, "--key", "fleet.key", status=FAILURE)
        self.assertIn("chmod 600 fleet.key", checks["key file"]["found"])

    def test_bad_usage(self):
        self.refused("doctor", "--report", "no/where.json", exit_status=USAGE)
        self.refused("doctor", "extra", exit_status=USAGE)
        self.refused("doctor", "--key", "k", "--report", "k", saying=("--report",), exit_status=USAGE)


if __name__ == "__main__":
    unittest.main()
