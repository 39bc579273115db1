#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""attack_table.py --build FOLDER [--seconds S] [--nodes] [ATTACK...]: each attack alone, by each degree of trust, on fleets of processes in
network namespaces. Prints a table of what is left 30 s after the last hostile datagram. As root; half an hour for all."""
import argparse
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE.parent / "tests" / folder) for folder in ("attacks", "processes")]
import network_space

network_space.enter()
from attacks import ATTACKS, mixed, title
from node_fleet import NodeScenario
from scenario import COMBINATIONS, Scenario

LIMIT_S = 30


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=8, help="of each attack")
    parser.add_argument("--nodes", action="store_true", help="fleets of tessera node instead of processes that have an exchange and no map")
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help="their names, such as forged_records; all")
    options = parser.parse_args()
    options.build = options.build.resolve()  # Nodes run in folders of their own.
    os.environ["TESSERA_MEMBER"] = str(options.build / "tests/processes/team_member")
    os.environ["TESSERA_COMMAND"] = str(options.build / "tessera")
    chosen = [attack for attack in (*ATTACKS, mixed) if not options.attacks or attack.__name__ in options.attacks]
    print("| attack | fleet | attacker has | datagrams sent | none left after | lasting effects |\n|---|---|---|---|---|---|", flush=True)
    lasting = []
    for attack in chosen:
        for fleet, trust in COMBINATIONS:
            with (NodeScenario if options.nodes else Scenario)(fleet, trust) as scenario:
                sent = scenario.attack(attack, options.seconds)
                scenario.join()
                left, after_s = scenario.last_effects(LIMIT_S)
            after = f"{after_s:.1f} s" if after_s is not None else "-"
            print(f"| {title(attack)} | {fleet} | {trust} | {sent} | {after} | {len(left)} |", flush=True)
            lasting += [f"{title(attack)}, {fleet}, {trust}: {effect}" for effect in left]
    print("\n".join(lasting), file=sys.stderr)
    return 1 if lasting else 0


if __name__ == "__main__":
    sys.exit(main())
