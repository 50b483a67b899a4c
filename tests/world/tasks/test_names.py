"""A task and a kind of object are known by their records alone: nothing else compares names."""

import re

from tests.support.paths import ROOT
from world import tasks

FLOORS = ("world", "policy", "actors", "discriminator", "learner", "console")
#: Where an affordance checks that a bank is the one that it made.
RECORDS = ROOT / "world" / "affordances"


def names() -> list[str]:
    found = [tasks.make(name) for name in tasks.REGISTRY]
    of_objects = {"furniture"} | {t.affordance.name for t in found}
    return sorted({t.name for t in found} | of_objects)


def patterns() -> re.Pattern[str]:
    name = '"(' + "|".join(names()) + ')"'
    return re.compile(
        rf"[=!]= *{name}|{name} *(==|!=|in\b)|\bin *[\[({{]{name}"
        r"|isinstance\(.*\b\w*Bank\b"
        r"|affordance(\.name|\.kind)? *(==|!=|in\b)"
        r'|category *[=!]= *"box"'
    )


def test_the_patterns_find_what_they_look_for() -> None:
    wrong = ('if t == "sit":', 'if "lie" == t', 'x in ("carry", "sit")', "if a.affordance == b:",
             "isinstance(bank, BoxBank)", 'piece.category == "box"', 'task != "walk"')  # fmt: skip
    assert all(patterns().search(line) for line in wrong)
    right = ('"sit": Sit,', "affordance = SEAT", 'name = "walk"', "class BoxBank(ObjectBank):")
    assert not any(patterns().search(line) for line in right)


def test_no_name_of_a_task_or_an_object_is_compared() -> None:
    found = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()}"
        for floor in FLOORS
        for file in sorted((ROOT / floor).rglob("*.py"))
        if not file.is_relative_to(RECORDS)
        for number, line in enumerate(file.read_text().splitlines(), 1)
        if patterns().search(line)
    ]
    assert found == []
