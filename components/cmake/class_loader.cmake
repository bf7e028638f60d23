# class_loader::class_loader from Debian's libclass-loader-dev. Its own CMake config needs ament and
# a Python script at configure time; the library does not.
find_package(console_bridge REQUIRED)
find_path(CLASS_LOADER_INCLUDE class_loader/class_loader.hpp PATH_SUFFIXES class_loader REQUIRED)
find_path(RCPPUTILS_INCLUDE rcpputils/shared_library.hpp PATH_SUFFIXES rcpputils REQUIRED)
find_path(RCUTILS_INCLUDE rcutils/shared_library.h PATH_SUFFIXES rcutils REQUIRED)
find_library(CLASS_LOADER_LIBRARY class_loader REQUIRED)
if(NOT TARGET class_loader::class_loader)
  add_library(class_loader::class_loader SHARED IMPORTED)
  set_target_properties(class_loader::class_loader PROPERTIES
    IMPORTED_LOCATION ${CLASS_LOADER_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES "${CLASS_LOADER_INCLUDE};${RCPPUTILS_INCLUDE};${RCUTILS_INCLUDE}"
    INTERFACE_LINK_LIBRARIES console_bridge::console_bridge)
endif()
