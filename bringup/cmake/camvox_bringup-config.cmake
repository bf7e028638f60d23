# find_package(camvox_bringup): imported targets camvox::configuration (plugins and the config
# file, no middleware) and camvox::container.
include(CMakeFindDependencyMacro)
find_dependency(camvox)
find_dependency(camvox_interfaces)
find_dependency(camvox_components)
include("${CMAKE_CURRENT_LIST_DIR}/camvox_bringup_targets.cmake")
