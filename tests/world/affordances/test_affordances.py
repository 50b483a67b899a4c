"""Each task's object is one of the records, and each record says how clips are learned from."""

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


def test_names_and_clips_are_told_apart() -> None:
    assert len({record.name for record in RECORDS}) == len(RECORDS)
    assert [record.kind for record in RECORDS] == [
        "furniture",
        "furniture",
        "box",
        "floor",
        "reference",
    ]
    assert [record.clips.kind for record in RECORDS] == ["seat", "bed", "box", "", ""]
