"""MuJoCo's warnings, kept out of the working folder.

MuJoCo writes them to MUJOCO_LOG.TXT there. They are counted in `MjData.warning`, which the callers
read. Imported by the modules that compile models.
"""

import mujoco


def _drop(_text: str) -> None:
    """Drop a warning."""


mujoco.set_mju_user_warning(_drop)
