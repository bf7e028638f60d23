#!/usr/bin/python3
"""Generates what the build needs from the interface definitions.

Input: ROS 2 `.msg`/`.srv` files (msg/<package>/{msg,srv}/) and the IDL of the plain types.
Output, in --out:
  <package>.idl                     for fastddsgen; one file a package keeps the build short
  camvox/interfaces/<package>.hpp   the include for users: structs + message_type<T>()
  <package>_types.cpp               one MessageType a message: names, schema text, hash, factories
Every file is written only when its content changes, so that nothing is rebuilt for nothing.
"""
import argparse
import pathlib
import sys

from ros_messages import DefinitionError, load_ros_packages, rihs01, schema_text
from plain_types import load_plain_package

IDL_PRIMITIVES = {
    "bool": "boolean", "byte": "octet", "char": "uint8", "int8": "int8", "uint8": "uint8",
    "int16": "int16", "uint16": "uint16", "int32": "int32", "uint32": "uint32",
    "int64": "int64", "uint64": "uint64", "float32": "float", "float64": "double",
    "string": "string",
}


def write_if_changed(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def idl_field(field):
    kind = field.type
    base = IDL_PRIMITIVES.get(kind.type) or f"{kind.pkg_name}::msg::{kind.type}"
    if kind.string_upper_bound:
        base += f"<{kind.string_upper_bound}>"
    if not kind.is_array:
        return f"{base} {field.name};"
    if kind.array_size is None:
        return f"sequence<{base}> {field.name};"
    if kind.is_upper_bound:
        return f"sequence<{base}, {kind.array_size}> {field.name};"
    return f"{base} {field.name}[{kind.array_size}];"


def package_idl(package):
    guard = package.name.upper() + "_IDL"
    lines = [f"#ifndef {guard}", f"#define {guard}"]
    lines += [f'#include "{name}.idl"' for name in sorted(package.depends)]
    for message in package.messages:
        lines.append(f"module {package.name} {{ module {message.namespace} {{")
        lines.append(f"struct {message.name} {{")
        lines += [f"  {idl_field(field)}" for field in message.fields]
        lines.append("}; }; };")
    return "\n".join(lines + ["#endif", ""])


def users_header(package):
    lines = ["#pragma once", "", f'#include "{package.name}.h"',
             '#include "camvox/interfaces/message_type.hpp"']
    lines += [f'#include "camvox/interfaces/{name}.hpp"' for name in sorted(package.depends)]
    if package.plain:
        lines.append('#include "camvox/interfaces/plain_layout.hpp"')
    lines += ["", "namespace camvox::interfaces {"]
    for message in package.messages:
        lines += ["", "template <>",
                  f"const MessageType& message_type<{package.name}::{message.namespace}::{message.name}>();"]
        if package.plain:
            lines += message.layout_code()
    lines += ["", "}  // namespace camvox::interfaces", ""]
    return "\n".join(lines)


def types_source(package, packages):
    kind = "plain" if package.plain else "ros"
    lines = [f'#include "camvox/interfaces/{package.name}.hpp"', "",
             '#include "make_message_type.hpp"', "", "namespace camvox::interfaces {"]
    for message in package.messages:
        cpp = f"{package.name}::{message.namespace}::{message.name}"
        text = schema_text(message, packages)
        lines += ["", "template <>", f"const MessageType& message_type<{cpp}>() {{",
                  f"  static const MessageType kType = make_{kind}_message_type<{cpp}>(",
                  f'      "{message.full_name}",', f'      "{rihs01(message, packages)}",',
                  f'      R"schema({text})schema");', "  return kType;", "}"]
    lines += ["", f"const MessageType* const* {package.name}_types() {{",
              "  static const MessageType* const kTypes[] = {"]
    lines += [f"      &message_type<{package.name}::{m.namespace}::{m.name}>()," for m in package.messages]
    lines += ["      nullptr};", "  return kTypes;", "}", "", "}  // namespace camvox::interfaces", ""]
    return "\n".join(lines)


def registry_source(packages):
    lines = ['#include "camvox/interfaces/message_type.hpp"', "", "namespace camvox::interfaces {"]
    lines += [f"const MessageType* const* {name}_types();" for name in packages]
    lines += ["", "std::vector<const MessageType*> all_message_types() {",
              "  std::vector<const MessageType*> all;", "  for (const auto* list : {"]
    lines += [f"           {name}_types()," for name in packages]
    lines += ["       }) {", "    for (; *list != nullptr; ++list) all.push_back(*list);", "  }",
              "  return all;", "}", "}  // namespace camvox::interfaces", ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--msg", required=True, type=pathlib.Path)
    parser.add_argument("--idl", required=True, type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    options = parser.parse_args()
    try:
        packages = load_ros_packages(options.msg)
        plain = load_plain_package(options.idl)
    except DefinitionError as error:
        sys.exit(f"error: {error}")
    packages[plain.name] = plain
    for name, package in packages.items():
        idl = options.idl.read_text() if package.plain else package_idl(package)
        write_if_changed(options.out / f"{name}.idl", idl)
        write_if_changed(options.out / "camvox" / "interfaces" / f"{name}.hpp", users_header(package))
        write_if_changed(options.out / f"{name}_types.cpp", types_source(package, packages))
    write_if_changed(options.out / "message_registry.cpp", registry_source(packages))
    return 0


if __name__ == "__main__":
    sys.exit(main())
