"""The plain types: reads the IDL, and derives layout and the ROS 2 view of every struct.

On the wire (another process, a recording) a plain type is the ROS 2 message of the same name in
which every list is a bounded sequence and its counter is gone, so any ROS 2 tool can read it.
"""
import re

from rosidl_adapter.parser import parse_message_string
from ros_messages import DefinitionError, Message, Package

# IDL type: (ROS type, bytes)
PRIMITIVES = {"octet": ("uint8", 1), "char": ("uint8", 1), "float": ("float32", 4), "double": ("float64", 8),
              "unsigned long": ("uint32", 4), "long": ("int32", 4),
              "unsigned long long": ("uint64", 8), "long long": ("int64", 8)}
MEMBER = re.compile(r"^((?:unsigned )?[\w:]+(?: long)?(?: long)?) (\w+)((?:\[[\w:]+\])*)$")


class Member:
    def __init__(self, kind, name, dimensions):
        self.kind, self.name, self.dimensions = kind, name, dimensions
        self.is_list = False

    @property
    def elements(self):
        total = 1
        for dimension in self.dimensions:
            total *= dimension
        return total


class PlainMessage(Message):
    def __init__(self, package, name, members):
        self.members = members
        counters = {m.name for m in members if m.name.endswith("_count")}
        for member in members:
            member.is_list = bool(member.dimensions) and member.name + "_count" in counters
        text = "".join(line + "\n" for line in self._ros_lines())
        fields = parse_message_string(package, name, text).fields
        super().__init__(package, "msg", name, fields, text)

    def _list_names(self):
        return {m.name for m in self.members if m.is_list}

    def _is_counter(self, member):
        return member.name.endswith("_count") and member.name[:-len("_count")] in self._list_names()

    def _ros_lines(self):
        for member in self.members:
            if self._is_counter(member):
                continue
            kind = PRIMITIVES[member.kind][0] if member.kind in PRIMITIVES else member.kind.split("::")[-1]
            name = member.name.lower()  # ROS field names are lower case: T_map_camera
            if member.is_list:
                rows = "".join(f" rows of {member.dimensions[1]}" for _ in member.dimensions[1:2])
                yield f"{kind}[<={member.elements}] {name}" + (f"  #{rows}" if rows else "")
            elif member.dimensions:
                yield f"{kind}[{member.elements}] {name}"
            else:
                yield f"{kind} {name}"

    def layout_code(self):
        """C++: PlainLayout specialisation that visits the members in order."""
        yield ""
        yield "template <>"
        yield f"struct PlainLayout<{self.package}::msg::{self.name}> {{"
        yield "  template <typename Message, typename Visitor>"
        yield "  static void visit(Message& message, Visitor&& visitor) {"
        for member in self.members:
            if self._is_counter(member):
                continue
            if member.is_list:
                yield f"    visitor.list(message.{member.name}(), message.{member.name}_count());"
            else:
                yield f"    visitor.fixed(message.{member.name}());"
        yield "  }"
        yield "};"


def _check_layout(name, members, sizes):
    """C++ puts every member where CDR does, and there is no padding at the end."""
    offset, widest = 0, 1
    for member in members:
        size, alignment = sizes[member.kind]
        if offset % alignment:
            raise DefinitionError(f"{name}.{member.name}: offset {offset} is not a multiple of {alignment}; "
                                  "put larger members first or add padding")
        offset += size * member.elements
        widest = max(widest, alignment)
    if offset % widest:
        raise DefinitionError(f"{name}: size {offset} is not a multiple of {widest}; add padding at the end")
    return offset, widest


def _check_lists(name, members):
    """Rows of a list are primitives, and its counter is what the codec counts with."""
    for member in members:
        counters = [m for m in members if m.name == member.name + "_count" and member.dimensions]
        if not counters:
            continue
        if member.kind not in PRIMITIVES:
            raise DefinitionError(f"{name}.{member.name}: a list must have rows of primitives, not of {member.kind}")
        if counters[0].kind != "unsigned long" or counters[0].dimensions:
            raise DefinitionError(f"{name}.{counters[0].name}: the counter of a list must be an unsigned long")
    lower = [m.name.lower() for m in members]
    for ros_name in lower:
        if lower.count(ros_name) > 1:
            raise DefinitionError(f"{name}: two members are called '{ros_name}' in ROS, where names are lower case")


def _bound(text, constants, place):
    name = text.split("::")[-1]
    if not name.isdigit() and name not in constants:
        raise DefinitionError(f"{place}: the capacity '{text}' is not a constant of this file")
    return int(name) if name.isdigit() else constants[name]


def _read_struct(name, body, constants, sizes):
    members = []
    for statement in filter(None, (" ".join(s.split()) for s in body.split(";"))):
        match = MEMBER.match(statement)
        if not match or (match[1] not in PRIMITIVES and match[1] not in sizes):
            raise DefinitionError(f"{name}: '{statement}' is not a plain member")
        bounds = re.findall(r"\[([\w:]+)\]", match[3])
        dimensions = [_bound(bound, constants, f"{name}.{match[2]}") for bound in bounds]
        members.append(Member(match[1], match[2], dimensions))
    return members


def load_plain_package(path):
    """Package of all structs of the IDL file; raises DefinitionError with what breaks a rule and where."""
    text = re.sub(r"//[^\n]*", "", path.read_text())
    package = Package(path.stem)
    package.plain = True
    constants = {name: int(value)
                 for name, value in re.findall(r"const [\w ]+? (\w+)\s*=\s*(\d+)\s*;", text)}
    sizes = {kind: (size, size) for kind, (_, size) in PRIMITIVES.items()}
    for name, body in re.findall(r"struct (\w+)\s*\{([^}]*)\}", text):
        place = f"{path.name}: {name}"
        members = _read_struct(place, body, constants, sizes)
        _check_lists(place, members)
        sizes[f"{package.name}::msg::{name}"] = _check_layout(place, members, sizes)
        package.messages.append(PlainMessage(package.name, name, members))
    return package
