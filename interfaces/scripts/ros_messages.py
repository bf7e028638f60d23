"""ROS 2 message definitions: reading, schema text with dependencies, type hash."""
import hashlib
import json

from rosidl_adapter.parser import parse_message_string, parse_service_string

# Type ids of type_description_interfaces/msg/FieldType.
TYPE_IDS = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
            "uint64": 9, "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17}
BOUNDED_STRING = 21
NESTED = 1
ARRAY, BOUNDED_SEQUENCE, SEQUENCE = 48, 96, 144


class DefinitionError(ValueError):
    """A message definition is wrong; the text says where and why."""


class Message:
    """One message: fields as rosidl_adapter gives them, and its own definition text."""

    def __init__(self, package, namespace, name, fields, text):
        self.package, self.namespace, self.name = package, namespace, name
        self.fields, self.text = fields, text

    @property
    def full_name(self):
        return f"{self.package}/{self.namespace}/{self.name}"

    def dependencies(self):
        """Names of the message types used, in the order of their first use."""
        used = [f"{f.type.pkg_name}/msg/{f.type.type}" for f in self.fields if f.type.pkg_name]
        return list(dict.fromkeys(used))


class Package:
    """Messages of one package, each behind those that it uses."""

    plain = False

    def __init__(self, name):
        self.name, self.messages = name, []

    @property
    def depends(self):
        used = {d.split("/")[0] for m in self.messages for d in m.dependencies()}
        return used - {self.name}

    def sort(self):
        ordered, pending = [], list(self.messages)
        while pending:
            done = {m.full_name for m in ordered}
            ready = [m for m in pending
                     if all(d in done for d in m.dependencies() if d.startswith(self.name + "/"))]
            if not ready:
                names = ", ".join(m.full_name for m in pending)
                raise DefinitionError(f"{names}: contains itself, or a message that is not defined")
            ordered += ready
            pending = [m for m in pending if m not in ready]
        self.messages = ordered


def _placeholder():
    return parse_message_string("x", "X", "uint8 structure_needs_at_least_one_member").fields


def _parse(parse, package, path):
    """What rosidl makes of a file; its errors do not name the file."""
    text = path.read_text()
    try:
        return parse(package.name, path.stem, text), text
    except Exception as error:  # rosidl_adapter has no common base for its errors
        raise DefinitionError(f"{path}: {error or type(error).__name__}") from error


def _load_service(package, path):
    service, text = _parse(parse_service_string, package, path)
    request_text, _, response_text = text.partition("---\n")
    for part, body, suffix in ((service.request, request_text, "_Request"),
                               (service.response, response_text, "_Response")):
        package.messages.append(
            Message(package.name, "srv", path.stem + suffix, part.fields or _placeholder(), body))


def load_ros_packages(folder):
    """{name: Package} of every <folder>/<package>/{msg,srv}, in order of dependence."""
    packages = {}
    for directory in sorted(p for p in folder.iterdir() if p.is_dir()):
        package = Package(directory.name)
        for path in sorted(directory.glob("msg/*.msg")):
            spec, text = _parse(parse_message_string, package, path)
            package.messages.append(
                Message(package.name, "msg", path.stem, spec.fields or _placeholder(), text))
        for path in sorted(directory.glob("srv/*.srv")):
            _load_service(package, path)
        package.sort()
        packages[package.name] = package
    for message in (m for package in packages.values() for m in package.messages):
        for name in message.dependencies():
            if find(name, packages) is None:
                raise DefinitionError(f"{message.full_name}: there is no definition of {name}")
    return packages


def find(full_name, packages):
    """The message of that name, or None."""
    package, namespace, name = full_name.split("/")
    for message in packages[package].messages if package in packages else ():
        if (message.namespace, message.name) == (namespace, name):
            return message
    return None


def _closure(message, packages):
    """Every message type that this one contains, depth first, each once."""
    found = []
    for name in message.dependencies():
        if name not in found:
            found.append(name)
        for deeper in _closure(find(name, packages), packages):
            if deeper not in found:
                found.append(deeper)
    return found


def schema_text(message, packages):
    """Definition with dependencies, as MCAP's `ros2msg` schema encoding wants it."""
    parts = [message.text]
    for name in _closure(message, packages):
        package, _, short = name.split("/")
        parts.append("=" * 80 + f"\nMSG: {package}/{short}\n" + find(name, packages).text)
    return "".join(part if part.endswith("\n") else part + "\n" for part in parts)


def _field_description(field):
    kind = field.type
    nested = f"{kind.pkg_name}/msg/{kind.type}" if kind.pkg_name else ""
    type_id = NESTED if nested else TYPE_IDS[kind.type]
    if kind.string_upper_bound:
        type_id = BOUNDED_STRING
    capacity = 0
    if kind.is_array:
        capacity = kind.array_size or 0
        type_id += SEQUENCE if kind.array_size is None else BOUNDED_SEQUENCE if kind.is_upper_bound else ARRAY
    return {"name": field.name,
            "type": {"type_id": type_id, "capacity": capacity,
                     "string_capacity": kind.string_upper_bound or 0, "nested_type_name": nested}}


def rihs01(message, packages):
    """The ROS 2 type hash (REP-2016): SHA-256 of the type description as JSON."""
    def describe(m):
        return {"type_name": m.full_name, "fields": [_field_description(f) for f in m.fields]}
    description = {
        "type_description": describe(message),
        "referenced_type_descriptions":
            [describe(find(name, packages)) for name in sorted(_closure(message, packages))]}
    return "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()
