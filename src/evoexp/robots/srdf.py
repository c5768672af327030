"""An SRDF: groups of joints, named states, end effectors, pairs that are never judged."""

from evoexp.errors import SettingError, demand, demand_known, nearest
from evoexp.robots.urdf_reading import LARGEST, NUMBER, UrdfJoint, parsed_xml

MOST_GROUPS = 300  # nested in one another


class Srdf:
    """Groups, states and disabled pairs of the robot of a URDF."""

    def __init__(self, content: bytes, joints: dict[str, UrdfJoint]) -> None:
        """Read the text, of the robot that has some joints, by their names."""
        self._root = root = parsed_xml(content, "robot.srdf")
        self._joints = joints
        self._above = {joint.child: joint for joint in joints.values()}
        self._groups = {str(group.get("name")): group for group in root.iterfind("group")}
        # joints of the groups that were looked up: one may be in many others
        self._joints_of: dict[str, set[str]] = {}
        # pairs of links that are never judged
        disabled = root.iterfind("disable_collisions")
        self.disabled = [(str(pair.get("link1")), str(pair.get("link2"))) for pair in disabled]
        # the frame to which a virtual joint ties the root, empty where none does: MoveIt's planning
        # frame is that of a virtual joint that is not fixed (`buildRecursive` in moveit_core's
        # `robot_model.cpp`)
        self._virtual = [joint.get("name") for joint in root.iterfind("virtual_joint")]
        free = (j for j in root.iterfind("virtual_joint") if j.get("type") != "fixed")
        self.ground = next((str(joint.get("parent_frame")) for joint in free), "")

    def tip(self, group: str) -> str:
        """Name the link at the end of a group's only chain, or where a hand is mounted, if any."""
        if group not in self._groups:
            return ""
        chains = self._groups[group].findall("chain")
        if len(chains) == 1:
            return str(chains[0].get("tip_link"))
        hands = [
            str(hand.get("parent_link"))
            for hand in self._root.iterfind("end_effector")
            if hand.get("parent_group") == group
        ]
        return hands[0] if len(hands) == 1 else ""

    def states(self) -> dict[str, dict[str, float]]:
        """Return values of joints [rad, m] by the names of states; of several groups, one state."""
        states: dict[str, dict[str, float]] = {}
        for state in self._root.iterfind("group_state"):
            values = states.setdefault(str(state.get("name")), {})
            for joint in state.iterfind("joint"):
                name, words = str(joint.get("name")), str(joint.get("value")).split()
                if len(words) != 1:
                    continue  # of a joint of several coordinates
                if not NUMBER.fullmatch(words[0]) or abs(float(words[0])) > LARGEST:
                    must = f"an SRDF whose states are finite numbers, at most {LARGEST:g}"
                    raise SettingError("robot.srdf", must, f"'{words[0]}' of '{name}'")
                values[name] = float(words[0])
        return states

    def group_joints(self, group: str, field: str, above: tuple[str, ...] = ()) -> set[str]:
        """Find the joints of a group that lies in those above: of its chains, links and groups."""
        must = f"a group of the SRDF ({', '.join(self._groups) or 'it has none'})"
        demand_known(group, self._groups, field, must)
        is_outside = group not in above and len(above) <= MOST_GROUPS
        demand(is_outside, field, "a group that does not contain itself", group)
        if group in self._joints_of:
            return self._joints_of[group]
        joints: set[str] = set()
        for part in self._groups[group]:
            match part.tag:
                case "chain":
                    joints |= self._chain(str(part.get("base_link")), str(part.get("tip_link")))
                case "joint" if (name := str(part.get("name"))) in self._joints:
                    joints.add(name)
                case "joint" if name not in self._virtual:  # those tie the robot to the world
                    must = f"an SRDF whose group '{group}' names joints of the URDF"
                    raise SettingError("robot.srdf", must, name, nearest(name, list(self._joints)))
                case "link" if (above_it := self._above.get(str(part.get("name")))) is not None:
                    joints.add(above_it.name)
                case "group":
                    joints |= self.group_joints(str(part.get("name")), field, (*above, group))
        self._joints_of[group] = joints
        return joints

    def _chain(self, base: str, tip: str) -> set[str]:
        joints, link = set[str](), tip
        while link != base:
            joint = self._above.get(link)
            if joint is None or joint.name in joints:
                must = "an SRDF whose chains lead from a tip down to a base"
                raise SettingError("robot.srdf", must, f"'{tip}' does not hang on '{base}'")
            joints.add(joint.name)
            link = joint.parent
        return joints
