"""Messages of tyro's error boxes as one line: the flag as typed, its value, and the valid ones."""

import re
from ast import literal_eval

_STYLING = re.compile(r"\x1b\[[0-9;]*m")
_RULE = re.compile(r"[-─]{3,}")
_CHOICE = re.compile(r"invalid choice (?P<word>'.*?'|\".*?\") for argument '(?P<flag>.+?)'\. "
                     r"Expected one of (?P<choices>\(.*\))")  # fmt: skip
_VALUE = re.compile(r"Error parsing (?P<flag>\S+): (?P<why>.*)")
_ABSENT = re.compile(r"Missing value for argument '(?P<flag>.+?)'\. Expected (?P<count>\d+) value")
_BOUNDS = re.compile(r"; (?P<bounds>[-+.e\d]+ to [-+.e\d]+(?:, [-+.e\d]+ to [-+.e\d]+)*)\.")
_SUGGESTED = "Perhaps you meant"
_KINDS = {"INT": "a whole number", "FLOAT": "a number"}


def one_line(box: str, command: str) -> str:
    """Return the message of tyro's error box in one line; words of a box of another kind are joined
    to one.

    command: the words of the command that is given, to whose help the line refers.
    """
    rows = [_STYLING.sub("", row) for row in box.splitlines()]
    sections: list[list[str]] = [[]]
    for row in _inside(rows):
        if _RULE.fullmatch(row.strip()):
            sections.append([])
        elif row.strip():
            sections[-1].append(row)
    sections = [section for section in sections if section]
    if not sections:
        return f"these arguments are no command; see {command} --help"
    title = sections[0][0].strip()
    parts = [_message(sections, command)]
    if title.startswith("Unrecognized"):
        parts += [_similar(section, command) for section in sections[1:]]
    parts.append(f"see {command} --help")
    return "; ".join(part.rstrip(".") for part in parts if part)


def _message(sections: list[list[str]], command: str) -> str:
    """What is wrong, and what is valid."""
    text = _joined(sections[0])
    if text.startswith("Unrecognized"):
        return _unknown(sections[0], command)
    if text.startswith("Missing from"):
        return _missing(sections[0][1:])
    if found := _CHOICE.search(text):
        # a set of choices comes in any order, and None is what a flag without a value means
        choices = [str(one) for one in literal_eval(found["choices"]) if one != "None"]
        shown = choices if "'None'" not in found["choices"] else sorted(choices)
        flag = f"{found['flag']} " if found["flag"].startswith("-") else ""
        return f"{flag}{literal_eval(found['word'])}: choose one of {', '.join(shown)}"
    if found := _ABSENT.search(text):
        count = int(found["count"])
        return f"{found['flag']}: needs {'a value' if count == 1 else f'{count} values'}"
    if found := _VALUE.match(text):
        return _refused(found["flag"], found["why"], sections)
    if found := re.match(r"Expected one of \{(.*)\}", text):
        return f"a command is missing: choose one of {found[1]}"
    return text


def _missing(rows: list[str]) -> str:
    """The flags and words that are required; of one alone also what it is."""
    # a name is a row of its own; its meaning is in rows below that are indented further
    names: list[str] = []
    for row in rows:
        if row[4:5].strip():
            word = row.split()[0]
            # a long list of choices goes on in the next row
            if names and names[-1].startswith("{") and not names[-1].endswith("}"):
                names[-1] += word
            else:
                names.append(word)
    if len(names) != 1:
        return f"{', '.join(names)}: missing"
    about = _joined([row for row in rows if not row[4:5].strip()]).removesuffix(" (required)")
    if names[0].startswith("{"):
        return f"a word is missing: choose one of {names[0].strip('{}').replace(',', ', ')}"
    return f"{names[0]}: missing: {about}"


def _unknown(rows: list[str], command: str) -> str:
    """The first flag or word that the command does not have."""
    listed = _joined(rows).partition(":")[2].split()
    word = listed[0].rstrip(",") if listed else ""
    if word.startswith("-"):
        return f"{word}: no flag of {command}"
    return f"{word}: a word too many for {command}"


def _similar(rows: list[str], command: str) -> str:
    """The commands of a group, or flags of the command like the unknown one."""
    text = _joined(rows)
    if text.startswith("Available subcommands:"):
        return f"choose one of {text.partition(':')[2].strip()}"
    if not rows[0].strip().startswith((_SUGGESTED, "Arguments similar to")):
        return ""
    own: dict[str, None] = {}
    flag = ""
    for row in rows[1:]:
        if row[:6] == "    --":
            flag = row.split()[0].rstrip(",")
        elif row.strip() == f"in {command} --help":
            own[flag] = None
    return f"perhaps {' or '.join(own)}" if own else ""


def _refused(flag: str, why: str, sections: list[list[str]]) -> str:
    """A value of another kind: the kind and the bounds by the flag's own help."""
    given = re.search(r"(?:from|arguments:?) (\[.*?\])", why)
    alone = re.search(r"(?:base 10|to float): ('.*?'|\".*?\")", why)
    words = literal_eval(given[1]) if given else [literal_eval(alone[1])] if alone else []
    value = " ".join(map(str, words))
    text = next((_joined(rows[1:]) for rows in sections[1:] if "helptext" in rows[0]), "")
    form = _form(text.removeprefix(flag).split(" (default:")[0])
    bounds = found["bounds"] if (found := _BOUNDS.search(text)) else ""
    if not form:
        return f"{flag} {value}: {why}"
    return f"{flag} {value}: must be {form}" + (f", {bounds}" if bounds else "")


def _form(metavar: str) -> str:
    """What the words of a metavar are: {None}|INT, FLOAT FLOAT, [INT [INT ...]]; empty for others
    than numbers."""
    shown = re.match(r"\s*(?:\{None\}\|)?((?:\[?(?:INT|FLOAT)\b|[\s\].])+)", metavar)
    kinds = re.findall(r"INT|FLOAT", shown[1]) if shown else []
    if shown is None or not kinds:
        return ""
    one = _KINDS[kinds[0]]
    plural = f"{one.removeprefix('a ')}s"
    if "[" not in shown[1]:
        return one if len(kinds) == 1 else f"{len(kinds)} {plural}"
    return plural if len(kinds) == 2 else f"pairs of {plural}"


def _joined(rows: list[str]) -> str:
    return " ".join(" ".join(row.split()) for row in rows)


def _inside(rows: list[str]) -> list[str]:
    """Return the rows without title and frame."""
    framed = [row[2:-1].rstrip() for row in rows if row.startswith("│")]
    if framed:
        return framed
    # With an ASCII-only standard output tyro prints a title, a rule, then rows indented by two.
    if len(rows) > 1 and _RULE.fullmatch(rows[1].strip()):
        return [row[2:].rstrip() for row in rows[2:]]
    return rows
