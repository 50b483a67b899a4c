"""An exported page needs nothing else."""

import base64
import json
import re

import numpy as np
import pytest

from console.play import saving
from console.play.player import Player
from tests.support.console.players import live, qpos


def test_an_exported_page_needs_nothing_else() -> None:
    source = live()
    for _ in range(30):
        source.extend()
    text = saving.html(Player(source), "inhabit </script> play").decode()
    assert not re.findall(r"(?:src|href)=|https?:|url\(|import ", text)
    assert text.count("</script>") == 2, "the data's and the viewer's"
    (data,) = json.loads(text.split('id="takes">')[1].split("</script>")[0])
    poses = np.frombuffer(base64.b64decode(data["poses"]), "<i2").reshape(31, -1, 7)
    root = poses[:, data["root"], :3] / 1000.0
    np.testing.assert_allclose(root, [qpos(source, i)[:3] for i in range(31)], atol=6e-4)
    assert data["error"][30] == pytest.approx(source.moments[30].error_m, abs=1e-3)
    assert "no discriminator" in text and "reward terms" in text
