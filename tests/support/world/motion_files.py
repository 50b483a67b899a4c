"""Motion files of other programs, and the comparison of what is read with what was meant."""

from pathlib import Path

import numpy as np

from world.motions.clip import Clip
from world.motions.formats import own
from world.motions.formats.recording import Recording


def same_motion(recording: Recording, clip: Clip, within_m: float = 1e-4) -> None:
    expected = own.recording(
        Path("x"), clip.fps, clip.root_position_m.astype(float), clip.local_rotation.astype(float)
    )
    np.testing.assert_allclose(recording.position, expected.position, atol=within_m)
    np.testing.assert_allclose(recording.rotation, expected.rotation, atol=20 * within_m)


ASF = """:version 1.10
:name TEST
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name upper
     direction 0 1 0
     length 2
     axis 0 0 90 XYZ
    dof rx rz
  end
  begin
     id 2
     name lower
     direction 1 0 0
     length 3
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root upper
    upper lower
  end
"""
AMC = """:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 0 0 0
upper 0 0
2
root 1 2 3 0 0 90
upper 90 0
"""
