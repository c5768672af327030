import base64
import json
import re
from typing import Any

import numpy as np
import pytest

from evoexp.playback.player_page import page
from evoexp.playback.recording import Heading
from playback_samples import SAMPLES, recording, refuted

LARGEST = 2_000_000  # [B]
ELSEWHERE = rb"https?://|//cdn|@import|url\(|<script[^>]+src=|fetch\(|XMLHttpRequest"


def motions(content: bytes) -> list[dict[str, Any]]:
    script = rb'<script type="application/json" id="motions">(.*?)</script>'
    (data,) = re.findall(script, content, re.DOTALL)
    return json.loads(data)


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f4")


@pytest.mark.examples(2)
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_page_holds_its_motion_and_refers_to_nothing(name: str) -> None:
    shown = recording(name)
    content = page([shown])
    assert content == page([shown]) and len(content) < LARGEST
    assert not re.search(ELSEWHERE, content) and b"{{" not in content
    (motion,) = motions(content)
    assert np.array_equal(unpacked(motion["poses"]), shown.poses.world.astype("<f4").ravel())
    assert np.array_equal(unpacked(motion["times"]), shown.times.astype("<f4"))
    shapes = [(shape["name"], tuple(shape["size"])) for shape in motion["shapes"]]
    assert shapes == [(shape.name, shape.outline.size) for shape in shown.shapes]
    assert motion["planar"] == shown.view.planar


def test_two_motions_share_a_page_and_a_refuted_one_says_when() -> None:
    first, second = motions(page([recording("two arms"), refuted()]))
    assert (first["title"], second["title"]) == ("two arms", "refuted")
    assert second["status"] == "refuted" and "touch at instant" in second["verdict"]
    assert second["contacts"] == [list(contact) for contact in refuted().clearance.contacts]


@pytest.mark.parametrize(
    ("certified", "kept", "margin", "badge"),
    [
        (True, True, 0.5, "required margin kept"),
        (True, False, 0.5, "required margin not kept"),
        (True, None, 0.5, "required margin undecided"),
        (True, True, 0.0, None),  # none is required
        (False, False, 0.5, None),  # in contact: refuted says it all
    ],
)
def test_whether_the_required_margin_is_kept_is_a_badge_of_its_own(
    certified: bool, kept: bool | None, margin: float, badge: str | None
) -> None:
    shown = recording("two arms")
    verdict = shown.verdict._replace(certified=certified, certified_margin=kept)
    (motion,) = motions(page([shown._replace(verdict=verdict, margin=margin)]))
    assert motion["status"] == ("certified" if certified else "refuted")
    assert motion.get("margin_text") == badge
    assert motion["margin"] == margin, "the number stays for the line in the chart"
    assert (motion.get("margin_kind") in ("kept", "broken", "unsure")) == (badge is not None)


def test_a_title_cannot_end_the_script_or_the_head() -> None:
    title = "</script><b>{{motions}}&"
    content = page([recording("two arms")._replace(heading=Heading(title))])
    assert content.count(b"</script>") == 2
    assert b"<title>&lt;/script&gt;&lt;b&gt;" in content
    assert motions(content)[0]["title"] == title
