"""Signs of life of a command whose interpreter a library holds; runs as a process of its own.

Ray connects with the interpreter locked, and so does a slow disk load a library: meanwhile no
thread of the command can write. The command tells its line several times a second. Once it tells
no more, this process writes the line in its place. It imports little, and starts in 10 ms.
"""

import os
import select
import signal
import sys
import time

#: Time without a word of the command after which its interpreter counts as held, s.
HELD_S = 0.4
MAX_CHARACTERS = 400
"""Length of either part of a line, so that a pipe takes what is told at a time as a whole."""


def told(quiet_since: float, began: float, head: str, tail: str) -> bytes:
    """Return one line of what the command tells.

    quiet_since, began: times on the monotonic clock, s, of its last output and of its start.
    head, tail: what a sign of life says before and after the seconds so far.
    """
    plain = (" ".join(part.splitlines()).replace("\t", " ") for part in (head, tail))
    text = "\t".join(part[:MAX_CHARACTERS] for part in plain)
    return f"{quiet_since!r}\t{began!r}\t{text}\n".encode(errors="replace")


def due(line: bytes, spoke: float, now: float, silence_s: float) -> str | None:
    """Return the sign of life to write now, by what was told last; None while there is none.

    spoke: when this process wrote last, s.
    """
    quiet_since, began, head, tail = line.decode(errors="replace").rstrip("\n").split("\t")
    if now - max(float(quiet_since), spoke) < silence_s:
        return None
    return f"{head}, {now - float(began):.0f} s{tail}"


def is_stopped(pid: int) -> bool:
    """Return whether a process was stopped by a signal; False where the system does not tell."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] in ("T", "t")
    except (OSError, IndexError):
        return False


def main(silence_s: float, held_s: float, replaced: bool) -> None:
    """Speak for the parent process, which tells on standard input, until it ends that.

    replaced: whether each line replaces the one before, as on a terminal.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the command's
    parent, line, spoke = os.getppid(), b"", 0.0
    while True:
        if select.select([0], [], [], held_s)[0]:
            heard = os.read(0, 1 << 16)
            if not heard:
                return
            line = heard.splitlines()[-1]
            continue
        if os.getppid() != parent:
            return
        if not line or is_stopped(parent):
            continue
        now = time.monotonic()
        if (said := due(line, spoke, now, silence_s)) is not None:
            try:
                if replaced:
                    room = os.get_terminal_size(2).columns - 1
                    said = f"\r\x1b[K{said[-room:]}"
                else:
                    said += "\n"
                os.write(2, said.encode())
            except OSError:
                return  # nobody reads it
            spoke = now


if __name__ == "__main__":
    main(float(sys.argv[1]), float(sys.argv[2]), sys.argv[3] == "terminal")
