"""A live scene with all of its past moments."""

import numpy as np
from numpy.typing import NDArray

from console.kinds import kind
from console.play.frames import Frames
from console.play.scene import Moment, Scene
from console.play.source import Curves
from console.recording.format import Take, boxes_of
from policy.checkpoints import lineage
from world.character import model as character


class Live(Frames[Moment]):
    """A scene and its moments; a Source."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.scene, self.piece = scene, scene.piece.name

    def curves(self) -> Curves:
        """See Source."""
        task, moments = self.scene.task, self.moments
        terms = np.array([moment.terms for moment in moments], np.float64)
        style = None
        if self.scene.served.style is not None:
            style = np.array([np.nan if m.style is None else m.style for m in moments])
        return Curves(
            terms={name: terms[:, i] for i, name in enumerate(task.terms)},
            style=style,
            error_m=np.array([moment.error_m for moment in moments]),
            success_m=task.success_m,
            fell=np.array([moment.fell for moment in moments]),
            missing=""
            if style is not None
            else "no style score: this checkpoint has no "
            "discriminator (published policies leave it out)",
        )

    def take(self) -> Take:
        """See Source."""
        setup, piece = self.scene.setup, self.scene.piece
        cargo = self.scene.task.affordance.cargo

        def column(name: str) -> NDArray[np.float64]:
            return np.stack([m.physics[name][0].numpy() for m in self.moments])

        mocap_pos = column("mocap_pos").reshape(len(self), -1, 3)
        mocap_quat = column("mocap_quat").reshape(len(self), -1, 4)
        return Take(
            qpos=column("qpos")[:, : character.NQ + 7 * cargo],
            qvel=column("qvel")[:, : character.NV + 6 * cargo],
            ctrl=column("ctrl"),
            mocap_pos=mocap_pos[:, 0],
            mocap_quat=mocap_quat[:, 0],
            boxes=boxes_of(kind(self.scene.task).shown(piece)),
            piece=piece.name,
            scale=setup.scale,
            meta={"distance_m": float(np.hypot(setup.goal.x - setup.start.x,
                                               setup.goal.y - setup.start.y))},
            balls=np.stack([m.balls for m in self.moments]),
            cargo=np.array(piece.boxes[0].half_m) if cargo else np.zeros(0),
            stand=mocap_pos[-1, 1] if cargo else np.zeros(0),
        )  # fmt: skip

    def status(self, frame: int) -> str:
        """See Source."""
        moment = self.moments[frame]
        words = [f"{100 * moment.error_m:.0f} cm from the goal"]
        if moment.style is not None:
            words.append(f"style {moment.style:.2f}")
        if moment.fell:
            words.append("**fallen**")
        elif moment.success:
            words.append("**success**")
        return ", ".join(words)

    def origins(self) -> dict[str, str]:
        """See Source."""
        found, piece = lineage.origins([self.scene.served.manifest.notes]), self.scene.piece
        text = lineage.with_furniture(found["licence"], piece.name, piece.licence, piece.credit)
        return found | {"licence": text}
