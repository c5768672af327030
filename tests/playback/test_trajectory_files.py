"""Joint trajectories out of files: matched by name, in known units, or refused in one line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from evoexp.input_files import TableError
from evoexp.playback.recording import Joint
from evoexp.playback.trajectory_files import fitted, parse_message, read_columns, read_message

JOINTS = (Joint("turn", False), Joint("turn_2", False), Joint("slide", True))
Q = [[0.0, 0.5, 0.1], [1.0, -0.5, 0.2], [0.5, 0.0, 0.0]]
DEGREES = [[float(np.degrees(a)), float(np.degrees(b)), 100.0 * c] for a, b, c in Q]


def table(head: str, rows: Any, mark: str = ",", times: bool = False) -> bytes:
    cells = ([k, *row] if times else row for k, row in enumerate(rows))
    return "\n".join([head, *(mark.join(map(str, row)) for row in cells)]).encode()


def message(points: Any, names: Any = ("turn", "turn_2", "slide"), **more: Any) -> dict[str, Any]:
    return {"joint_names": list(names), "points": points, **more}


def of_csv(content: bytes) -> tuple[Any, tuple[str, ...]]:
    return fitted(read_columns(content), JOINTS, "m")


@pytest.mark.parametrize(
    ("head", "rows", "times"),
    [
        ("turn_rad,turn_2_rad,slide_m", Q, False),
        ("time_s,turn_rad,turn_2_rad,slide_m", Q, True),
        ("time,turn,turn_2,slide", Q, True),
        ("t,turn_deg,turn_2 [deg],slide (cm)", DEGREES, True),
        ("time_from_start,turn.position,turn_2/pos,slide_position_m", Q, True),
        ("slide_m,turn_rad,turn_2_rad", [[c, a, b] for a, b, c in Q], False),
        ("turn_rad,gripper,turn_2_rad,slide_m", [[a, 7, b, c] for a, b, c in Q], False),
        ("turn,turn_vel,turn_2,slide", [[a, 9, b, c] for a, b, c in Q], False),
        ("turn,turn_2,turn_2_effort,slide", [[a, b, 9, c] for a, b, c in Q], False),
    ],
)
def test_columns_are_matched_by_name_and_unit(head: str, rows: Any, times: bool) -> None:
    motion, remarks = of_csv(table(head, rows, times=times))
    assert motion.q == pytest.approx(np.array(Q), abs=1e-15)
    assert motion.coefficients is None
    assert "straight lines between the points" in remarks
    unread = next((r.removeprefix("not read: ") for r in remarks if r.startswith("not")), "")
    words = {"gripper": "gripper", "vel": "velocities", "effort": "turn_2_effort"}
    assert unread == next((words[word] for word in words if word in head), "")
    assert any("without a unit" in r for r in remarks) is ("_rad" not in head and "deg" not in head)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_spreadsheets_are_read(mark: str) -> None:
    head = mark.join(("time_s", "turn_rad", "turn_2_rad", "slide_m"))
    content = b"\xef\xbb\xbf" + table(head, Q, mark, times=True)
    assert of_csv(content)[0].q.tolist() == Q


def test_velocities_of_all_joints_make_cubics() -> None:
    head = "time_ms,turn_rad,turn_2_rad,slide_m,turn_rad_per_s,turn_2_velocity,slide_m/s"
    rows = [[1000 * k, *q, 0.5 * k, 0, 0] for k, q in enumerate(Q)]
    motion, remarks = of_csv(table(head, rows))
    assert "cubics between the points, by their velocities" in remarks
    assert motion.coefficients is not None
    assert motion.coefficients[:, 1, 0].tolist() == [0.0, 0.5]
    degrees = table(head.replace("turn_rad_per_s", "turn_deg_per_s"), rows)
    assert of_csv(degrees)[0].coefficients[1, 1, 0] == pytest.approx(np.radians(0.5))


REFUSED: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("refused_files.yaml").read_text())


@pytest.mark.parametrize(
    ("content", "said"),
    [
        *((text.encode(), said) for text, said in REFUSED["tables"].items()),
        ("turn,slide\n0,0\n".encode("utf-16"), "line 1: must be text in UTF-8"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(content: bytes, said: str) -> None:
    with pytest.raises((ValueError, TableError), match=said) as caught:
        of_csv(content)
    assert "\n" not in str(caught.value)


def points(**more: Any) -> list[dict[str, Any]]:
    return [{"positions": q, **more} for q in Q]


def read(data: dict[str, Any]) -> tuple[Any, tuple[str, ...]]:
    return fitted(read_message(data), JOINTS, "m")


def test_messages_are_those_of_ros_and_ours() -> None:
    moving = [{"positions": q, "velocities": [0.1 * k] * 3} for k, q in enumerate(Q)]
    ros = [each | {"time_from_start": {"sec": k, "nanosec": 0}} for k, each in enumerate(moving)]
    ours = [each | {"time_from_start": float(k)} for k, each in enumerate(moving)]
    expected, _ = read(message(ours))
    assert expected.coefficients is not None
    wrapped = {"joint_trajectory": message(ros), "multi_dof_joint_trajectory": {}}
    for data in (message(ros), wrapped, {"trajectory": message(ros)}):
        motion, remarks = read(data)
        assert np.array_equal(motion.coefficients, expected.coefficients)
        assert "values without a unit are read in rad and m" in remarks
    other = [{"positions": [c, a, b]} for a, b, c in DEGREES]
    names, units = ("slide", "turn", "turn_2"), ["cm", "deg", "deg"]
    motion, remarks = read(message(other, names, units=units))
    assert motion.q == pytest.approx(np.array(Q), abs=1e-15)
    assert remarks == ("straight lines between the points",)


def test_accelerations_are_told_not_to_be_read() -> None:
    told = read(message(points(accelerations=[0.0, 1.0, 0.0])))[1]
    assert "not read: accelerations" in told
    still = read(message(points(accelerations=[0.0] * 3, effort=[])))[1]
    assert still[-1] == "straight lines between the points"


@pytest.mark.parametrize(("data", "said"), [each.values() for each in REFUSED["messages"]])
def test_a_bad_message_is_refused_by_place(data: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said) as caught:
        read_message(data)
    assert "\n" not in str(caught.value)


def test_yaml_is_read_as_ros_prints_it() -> None:
    text = (
        "header:\n  frame_id: ''\njoint_names:\n- turn\n- turn_2\n- slide\npoints:\n"
        "- positions: [0, 5e-1, 1e-1]\n  time_from_start: {sec: 0, nanosec: 0}\n"
        "- positions: [1.0, -0.5, 0.2]\n  time_from_start: {sec: 1, nanosec: 500000000}\n---\n"
    )
    motion, _ = read(parse_message(text, is_yaml=True))
    assert motion.q.tolist() == Q[:2]
    with pytest.raises(ValueError, match="must hold one message, holds 2"):
        parse_message(text + text, is_yaml=True)
    with pytest.raises(ValueError, match="expected"):
        parse_message("a: [", is_yaml=True)
