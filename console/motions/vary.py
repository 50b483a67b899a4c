"""`inhabit motions vary`: variants of clips with a box."""

from collections import Counter
from collections.abc import Iterator, Sequence

from console.commands import MotionsVary
from console.motions.reading import clips
from console.terminal import counted, progress
from world.errors import ClipError, ConfigError
from world.motions import clip_file, segments
from world.motions.clip import Clip
from world.motions.variants import variant

#: Least fraction of a variant's frames without overlapping limbs, sliding soles or jumps.
_SOUND = 0.9


def vary_command(command: MotionsVary) -> int:
    """Write the clips and their variants; return 0."""
    if not command.stand_m or not command.size:
        raise ConfigError("--stand-m and --size: name one or more of each")
    given = clips(tuple(map(str, command.paths)))
    if not any(clip.box is not None and clip.box.held.any() for clip in given):
        raise ClipError(f"{', '.join(map(str, command.paths))}: no clip carries a box")
    _require_new(command, given)  # before the work
    made, left_out = list(given), list[str]()
    with progress("clips", len(given), "making variants") as update:
        for done, clip in enumerate(given, 1):
            for found, why in variants(clip, command.stand_m, command.size):
                if found is not None and not why:
                    made.append(found)
                else:
                    left_out.append(why)
            update(done)
    _require_new(command, made)
    for clip in made:
        clip_file.write(command.out / f"{clip.name}.npz", clip)
    for why in left_out:
        print(f"note: left out: {why}")
    seconds = sum(clip.seconds for clip in made)
    variations = len(made) - len(given)
    print(
        f"{counted(len(given), 'clip')} and {counted(variations, 'variant')}, {seconds:.0f} s of"
        f" motion: {command.out}"
    )
    return 0


def _require_new(command: MotionsVary, made: Sequence[Clip]) -> None:
    """Raise for two clips that would be one file, and for files that would be replaced unasked."""
    twice = [name for name, count in Counter(clip.name for clip in made).items() if count > 1]
    if twice:
        raise ConfigError(f"two clips have the name {twice[0]}: vary their folders one by one")
    there = [clip.name for clip in made if (command.out / f"{clip.name}.npz").exists()]
    if there and not command.replace:
        raise ClipError(
            f"{command.out}: already holds {there[0]}.npz"
            + (f" and {len(there) - 1} more" if len(there) > 1 else "")
            + "; --replace overwrites them"
        )


def variants(
    clip: Clip, stands_m: tuple[float, ...], sizes: tuple[float, ...]
) -> Iterator[tuple[Clip | None, str]]:
    """Yield the variants of a clip, each once; with why not, where one is not natural or there is
    none."""
    seen = {clip.name}
    if clip.box is None or not clip.box.held.any():
        return
    for stand_m in stands_m:
        for size in sizes:
            found = variant(clip, stand_m, size)
            if found is None:
                yield (
                    None,
                    f"{clip.name} never raises its box to a stand of {stand_m:g} m, or takes it"
                    " more than once",
                )
                break
            if found.name in seen:
                continue
            seen.add(found.name)
            sound = float(segments.usable(found).mean())
            why = f"{found.name}: {100 * sound:.0f} % of it is sound" if sound < _SOUND else ""
            yield found, why
