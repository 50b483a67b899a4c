"""Pages of the Python API: one per room, with its public modules."""

from docs.generate.markdown import code

ROOMS = {
    "world": (
        "Character, scenes, furniture, motions and tasks.",
        (
            "world.config",
            "world.errors",
            "world.rotations",
            "world.character.features",
            "world.character.model",
            "world.character.kinematics",
            "world.character.servos",
            "world.furniture.piece",
            "world.furniture.catalogue",
            "world.motions.clip",
            "world.motions.load",
            "world.motions.library",
            "world.motions.formats.registry",
            "world.tasks.task",
            "world.episodes.shard",
        ),
    ),
    "policy": (
        "Networks, checkpoints and the policy service.",
        (
            "policy.model.networks",
            "policy.model.normaliser",
            "policy.checkpoints.format",
            "policy.checkpoints.served",
            "policy.rollout",
            "policy.service.servicer",
        ),
    ),
    "learner": (
        "Returns, PPO and the training loop.",
        (
            "learner.protocols",
            "learner.returns",
            "learner.surrogate",
            "learner.ppo",
            "learner.loop",
        ),
    ),
    "discriminator": (
        "The style reward.",
        (
            "discriminator.protocols",
            "discriminator.network",
            "discriminator.loss",
            "discriminator.trainer",
            "discriminator.client",
        ),
    ),
    "actors": (
        "Rollout workers, on this machine or over a Ray cluster.",
        ("actors.worker", "actors.local", "actors.fleet", "actors.cluster"),
    ),
    "rpc": (
        "Tensor codec, servers and channels of both gRPC services.",
        ("rpc.codec", "rpc.channel", "rpc.server", "rpc.aio_server", "rpc.credentials"),
    ),
}


def page(room: str) -> str:
    """The modules of one room."""
    about, modules = ROOMS[room]
    parts = [f"# {room}\n", about + "\n"]
    for module in modules:
        parts.append(f"## {code(module)}\n\n::: {module}\n")
    return "\n".join(parts)
