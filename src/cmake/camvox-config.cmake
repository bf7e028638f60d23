# find_package(camvox): imported targets camvox::<folder> and the build options shared by all packages.
include(CMakeFindDependencyMacro)
include("${CMAKE_CURRENT_LIST_DIR}/camvox_targets.cmake")
