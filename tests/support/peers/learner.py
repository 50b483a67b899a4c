"""A peer's process without a library, for curves: it speaks the protocol and notes its windows.

STAND_IN_TURNS names the file of its notes. STAND_IN_DIES: seed and number of samples at which it
dies.
"""

import json
import os
import sys


def main() -> None:
    """Answer the lines of standard input until it ends."""
    assignment = json.loads(sys.stdin.readline())
    seed = assignment["experiment"]["seed"]
    rate = assignment["experiment"]["ppo"]["critic_rate"]
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        samples = json.loads(line)["samples"]
        if os.environ.get("STAND_IN_DIES") == f"{seed} {samples}":
            raise MemoryError("out of scenes")
        with open(os.environ["STAND_IN_TURNS"], "a") as file:
            file.write(f"{seed} {rate} {samples}\n")
        # four episodes of a return that is the thousands of samples, and the seed
        window = {"samples": samples + 96, "control_steps": 1000, "reward": 250.0, "episodes": 4}
        window |= {"returns": 4.0 * (samples / 1000 + seed), "falls": 1, "seconds": 0.5}
        print(json.dumps(window), flush=True)


if __name__ == "__main__":
    main()
