#pragma once

namespace camvox::interfaces {

/// How a plain message is laid out. Specialisations are generated from the IDL; each has
///
///     template <typename Message, typename Visitor>
///     static void visit(Message& message, Visitor&& visitor);
///
/// which calls, in the order of the layout, `visitor.fixed(member)` for a member that is always
/// used whole and `visitor.list(array, count)` for a list of which `count` rows are used.
template <typename T>
struct PlainLayout;

}  // namespace camvox::interfaces
