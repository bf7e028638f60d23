# find_package(camvox): imported targets camvox::<folder> and the build options shared by all packages.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 3.4)
find_dependency(OpenCV COMPONENTS core)
include("${CMAKE_CURRENT_LIST_DIR}/camvox_targets.cmake")
