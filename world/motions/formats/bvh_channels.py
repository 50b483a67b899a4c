"""Removal of position channels from BVH files in which every joint has them.

The channels repeat the OFFSETs, since bones do not stretch, and pybvh does not read them.
"""


def rigid(text: str) -> str | None:
    """The text without the position channels of all joints but the root; None where there are none.

    Raises ValueError where a CHANNELS line is damaged.
    """
    lines = text.splitlines()
    kept: list[bool] = []
    joint, found, head = "ROOT", False, 0
    for index, line in enumerate(lines):
        words = line.split()
        if not words:
            continue
        if words[0] in ("ROOT", "JOINT"):
            joint = words[0]
        elif words[0] == "CHANNELS":
            channels = words[2:]
            keep = [joint == "ROOT" or not c.lower().endswith("position") for c in channels]
            kept += keep
            if not all(keep):
                found = True
                left = [c for c, k in zip(channels, keep, strict=True) if k]
                lines[index] = f"CHANNELS {len(left)} {' '.join(left)}"
        elif words[0] == "Frame" and words[1:2] == ["Time:"]:
            head = index + 1
            break
    if not found:
        return None
    for index in range(head, len(lines)):
        values = lines[index].split()
        if values and len(values) != len(kept):
            raise ValueError(f"a frame has {len(values)} values, not {len(kept)}")
        lines[index] = " ".join(v for v, k in zip(values, kept, strict=False) if k)
    return "\n".join(lines) + "\n"
