"""Each task's object is one of the records, and each record has a use of clips."""

from world import affordances, tasks

RECORDS = (
    affordances.SEAT,
    affordances.BED,
    affordances.CARRIED,
    affordances.FLOOR,
    affordances.REFERENCE,
)


def test_every_task_uses_one_of_them() -> None:
    used = {name: tasks.make(name).affordance for name in tasks.REGISTRY}
    assert set(used.values()) == set(RECORDS)
    assert {name for name, found in used.items() if found.cargo} == {"carry"}
    assert {name for name, found in used.items() if found.follows_clips} == {"track"}


def test_names_and_files_are_distinguished() -> None:
    assert len({record.name for record in RECORDS}) == len(RECORDS)
    kinds = ["furniture", "furniture", "box", "floor", "reference"]
    assert [record.kind for record in RECORDS] == kinds
    assert [record.clips.kind for record in RECORDS] == ["seat", "bed", "box", "", ""]
