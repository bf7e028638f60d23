#!/usr/bin/python3
"""Writes IDL for another DDS vendor from our message definitions, with the type names of the wire.

Usage: cyclone_idl.py <interfaces folder> <out.idl> [--impostors] <pkg/msg/Name>...
With --impostors the messages get our names but wrong contents: a ROS message becomes one number,
the lists of a plain message lose their bounds. For writers that nobody should trust.
"""
import pathlib
import re
import sys


def wire_name(name):
    return re.sub(r"(\w+)::(msg|srv)::(\w+)", r"\1::\2::dds_::\3_", name)


def with_dependencies(name, packages, find, found):
    message = find(name, packages)
    for used in message.dependencies():
        with_dependencies(used, packages, find, found)
    if message not in found:
        found.append(message)
    return found


def struct_idl(message, idl_field, impostor, is_plain):
    fields = [wire_name(idl_field(field)) for field in message.fields]
    if impostor and is_plain:
        fields = [re.sub(r"sequence<(\w+), \d+>", r"sequence<\1>", field) for field in fields]
    elif impostor:
        fields = ["uint32 nonsense;"]
    body = "".join(f"  {field}\n" for field in fields)
    return (f"module {message.package} {{ module {message.namespace} {{ module dds_ {{\n"
            f"@final struct {message.name}_ {{\n{body}}};\n}}; }}; }};\n")


def main():
    arguments = [a for a in sys.argv[1:] if a != "--impostors"]
    impostors = "--impostors" in sys.argv
    interfaces, out = pathlib.Path(arguments[0]), pathlib.Path(arguments[1])
    sys.path.insert(0, str(interfaces / "scripts"))
    from generate_types import idl_field
    from plain_types import load_plain_package
    from ros_messages import find, load_ros_packages
    packages = load_ros_packages(interfaces / "msg")
    plain = load_plain_package(interfaces / "idl" / "camvox_interfaces.idl")
    packages[plain.name] = plain
    messages = []
    for name in arguments[2:]:
        if impostors and not name.startswith(plain.name):
            messages.append(find(name, packages))
        else:
            with_dependencies(name, packages, find, messages)
    out.write_text("".join(
        struct_idl(m, idl_field, impostors and m.full_name in arguments, m.package == plain.name)
        for m in messages))


if __name__ == "__main__":
    main()
