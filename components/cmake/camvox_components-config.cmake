# find_package(camvox_components): imported targets camvox::component (what a component is written
# against) and camvox::dds (the middleware), and camvox_register_components().
include(CMakeFindDependencyMacro)
find_dependency(camvox)
find_dependency(camvox_interfaces)
find_dependency(fmt)
include("${CMAKE_CURRENT_LIST_DIR}/camvox_class_loader.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/camvox_register_components.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/camvox_components_targets.cmake")
