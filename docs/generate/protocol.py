"""The pages of the gRPC protocol, from the comments of the .proto files."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from docs.generate.markdown import code, table

ROOT = Path(__file__).parents[2]
FILES = {"policy": "proto/rpc/v1/policy.proto", "style": "proto/rpc/v1/style.proto"}


@dataclass
class Block:
    """A service, message or enum with its lines."""

    kind: str
    name: str
    comment: str
    rows: list[tuple[str, str, str, str]] = field(default_factory=list)
    """Number, name, type and comment; of calls: name, request, reply, comment."""


def page(name: str) -> str:
    """Calls, then messages, of one protocol."""
    head, blocks = read((ROOT / FILES[name]).read_text())
    parts = [
        f"# Protocol of the {name} service\n",
        f"From `{FILES[name]}`. {head}\n",
    ]
    for block in blocks:
        parts.append(f"## {block.kind} {block.name}\n")
        parts.append(block.comment + "\n")
        if block.kind == "service":
            heads = ("call", "request", "reply", "meaning")
        else:
            heads = ("number", "field", "type", "meaning")
        parts.append(table(heads, ([*map(code, row[:3]), row[3]] for row in block.rows)))
    return "\n".join(parts)


def read(text: str) -> tuple[str, list[Block]]:
    """The comment at the head of a .proto, and its blocks; comments belong to what follows."""
    head, _, body = text.partition('syntax = "proto3";')
    blocks: list[Block] = []
    comment: list[str] = []
    choice = ""
    for line in map(str.strip, body.splitlines()):
        if line.startswith("//"):
            comment.append(line[2:].strip())
            continue
        said, comment = " ".join(comment), []
        if opened := re.match(r"(service|message|enum) (\w+) {", line):
            blocks.append(Block(opened[1], opened[2], said))
        elif opened := re.match(r"oneof (\w+) {", line):
            choice = f"one of {opened[1]}"
        elif line == "}":
            choice = ""
        elif call := re.match(r"rpc (\w+)\((.+?)\) returns \((.+?)\)", line):
            blocks[-1].rows.append((call[1], call[2], call[3], said))
        elif found := re.match(r"(.+) (\w+) = (\d+);", line):
            said = "; ".join(filter(None, (choice, said)))
            blocks[-1].rows.append((found[3], found[2], found[1], said))
        elif found := re.match(r"(\w+) = (\d+);", line):
            blocks[-1].rows.append((found[2], found[1], "", said))
    return " ".join(line.lstrip("/ ").strip() for line in head.splitlines()).strip(), blocks
