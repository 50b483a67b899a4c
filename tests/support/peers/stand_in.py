"""A peer's process without a library: it speaks the protocol and notes its turns in a file.

The seed of the experiment says how it behaves: 1 is sound, 2 dies in its second turn, 3 at its
start.
"""

import json
import os
import sys


def main() -> None:
    """Answer the lines of standard input until it ends."""
    seed = json.loads(sys.stdin.readline())["experiment"]["seed"]
    if seed == 3:
        sys.exit("no such accelerator")
    print(json.dumps({"ready": True}), flush=True)
    for number, line in enumerate(sys.stdin):
        if seed == 2 and number == 1:
            raise MemoryError("out of scenes")
        with open(os.environ["STAND_IN_TURNS"], "a") as file:
            file.write(f"{os.getppid()} {seed} {json.loads(line)['seconds']}\n")
        turn = {"samples": 100 * (number + 1), "seconds": 2.0, "processor_s": 4.0}
        turn |= {"iterations": 1, "resident_gb": 1.0, "peak_gb": 2.0}
        print(json.dumps(turn), flush=True)


if __name__ == "__main__":
    main()
