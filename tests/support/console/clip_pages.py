"""What a page of clips holds."""

import json
import re


def data_of(text: str) -> dict[str, list[dict[str, object]]]:
    found = re.search(r"^const DATA = (.*);$", text, re.MULTILINE)
    assert found is not None
    return json.loads(found.group(1))
