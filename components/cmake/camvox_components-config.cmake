# find_package(camvox_components): imported targets camvox::component, camvox::fake_context, camvox::dds.
include(CMakeFindDependencyMacro)
find_dependency(camvox)
find_dependency(camvox_interfaces)
find_dependency(fastrtps)
find_dependency(fmt)
include("${CMAKE_CURRENT_LIST_DIR}/class_loader.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/camvox_register_components.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/camvox_components_targets.cmake")
