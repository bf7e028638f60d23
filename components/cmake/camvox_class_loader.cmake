# Imported target class_loader::class_loader. Debian's own config file of the package needs
# ament's build tools and their python at configure time; the library itself does not.
if(TARGET class_loader::class_loader)
  return()
endif()
find_package(console_bridge REQUIRED)
find_path(CAMVOX_CLASS_LOADER_INCLUDE class_loader/class_loader.hpp PATH_SUFFIXES class_loader REQUIRED)
find_path(CAMVOX_RCPPUTILS_INCLUDE rcpputils/shared_library.hpp PATH_SUFFIXES rcpputils REQUIRED)
find_path(CAMVOX_RCUTILS_INCLUDE rcutils/shared_library.h PATH_SUFFIXES rcutils REQUIRED)
find_library(CAMVOX_CLASS_LOADER_LIBRARY class_loader REQUIRED)
mark_as_advanced(CAMVOX_CLASS_LOADER_INCLUDE CAMVOX_RCPPUTILS_INCLUDE CAMVOX_RCUTILS_INCLUDE
                 CAMVOX_CLASS_LOADER_LIBRARY)
add_library(class_loader::class_loader SHARED IMPORTED)
set_target_properties(class_loader::class_loader PROPERTIES
  IMPORTED_LOCATION ${CAMVOX_CLASS_LOADER_LIBRARY}
  INTERFACE_INCLUDE_DIRECTORIES
    "${CAMVOX_CLASS_LOADER_INCLUDE};${CAMVOX_RCPPUTILS_INCLUDE};${CAMVOX_RCUTILS_INCLUDE}"
  INTERFACE_LINK_LIBRARIES console_bridge::console_bridge)
