"""What completes a value: enumerated ones, tasks, policies, runs and files; nothing for numbers."""

import pretrained
from console import commands
from console.manual import page, values
from console.manual.values import Values
from world.tasks import REGISTRY


def found(kind: type) -> dict[str, Values]:
    return {f.name: values.of(f) for f in page.flags_of(kind)}


def test_values_of_train() -> None:
    train = found(commands.Train)
    assert train["task"] == Values(tuple(REGISTRY))
    assert train["preset"] == Values(("fast", "paper", "track", "finetune"))
    assert train["init"] == Values(tuple(pretrained.names()), files=True, runs=True)
    assert train["run"] == Values(files=True, runs=True)
    assert train["objects"] == Values(("train", "test", "all"), files=True)
    assert train["motions"] == Values(files=True)
    assert "paper" in train["recipe"].words and "sit=" in train["mix"].words
    assert train["samples"] == train["ppo.gamma"] == train["resume"] == Values()


def test_distill_completes_the_tasks_that_it_takes() -> None:
    assert found(commands.Distill)["task"] == Values(("sit", "lie", "carry"))


def test_values_of_words_without_a_flag() -> None:
    for kind in (commands.Evaluate, commands.Video, commands.Play, commands.Serve, commands.Demo):
        word = next(f for f in page.flags_of(kind) if f.positional)
        assert values.of(word) == Values(tuple(pretrained.names()), files=True, runs=True)
    assert found(commands.Completion)["shell"].words == ("bash", "zsh", "fish")
    assert found(commands.MotionsImport)["paths"] == Values(files=True)
    assert found(commands.ObjectsCheck)["paths"].files
