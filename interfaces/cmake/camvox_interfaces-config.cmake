# find_package(camvox_interfaces): imported target camvox::interfaces.
include(CMakeFindDependencyMacro)
find_dependency(fastcdr)
find_dependency(fastrtps)
include("${CMAKE_CURRENT_LIST_DIR}/camvox_interfaces_targets.cmake")
