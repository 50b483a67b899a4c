"""`inhabit objects check --drop`: drop tests of a seated ragdoll on pieces of several scales."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from typing import Any

from rich.console import Console

from world.furniture.piece import TEST_SCALES, Piece
from world.objects.drop_test import drop, scales
from world.surroundings import settle_sockets


def drops(pieces: Sequence[Piece], seconds: float, workers: int) -> list[list[dict[str, Any]]]:
    """Return for each piece its drops, one per scale and seat; empty for a piece without seats."""
    if workers == 1:
        return [_of(piece, seconds) for piece in pieces]
    settle_sockets()
    with ProcessPoolExecutor(workers, get_context("forkserver")) as pool:
        return list(pool.map(_of, pieces, [seconds] * len(pieces), chunksize=4))


def _of(piece: Piece, seconds: float) -> list[dict[str, Any]]:
    found = []
    for scale in TEST_SCALES:
        sized = piece.scaled(scale)
        for which, place in enumerate(piece.sit):
            if scale in scales(place):
                rest = drop(sized, seconds, which=which)
                found.append({"scale": scale, "place": which, "rests": rest.rests, **asdict(rest)})
    return found


def summarise(rows: Sequence[dict[str, Any]], output: Console) -> None:
    """Print the number of drops at rest, a line on each other, and the number that became
    non-finite."""
    tried = [(row["piece"], one) for row in rows for one in row["drops"]]
    for name, one in tried:
        if not one["rests"]:
            output.print(
                f"{name}, place {one['place']}, at scale {one['scale']}:"
                f" {100 * one['height_error_m']:+.1f} cm from the seat's height,"
                f" {100 * one['off_m']:.0f} cm off, {100 * one['deepest_m']:.1f} cm deep",
                markup=False,
            )
    output.print(
        f"{sum(one['rests'] for _, one in tried)} of {len(tried)} drops came to rest on the seat,"
        f" {sum(not one['finite'] for _, one in tried)} non-finite"
    )
