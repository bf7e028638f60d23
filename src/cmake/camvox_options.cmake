# Language level and warnings, the same for every package of this workspace.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
# Installed programs and libraries find each other without LD_LIBRARY_PATH, in one common prefix
# and in colcon's prefix per package.
list(APPEND CMAKE_INSTALL_RPATH "$ORIGIN" "$ORIGIN/../lib")
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

option(CAMVOX_WERROR "Treat warnings as errors" OFF)
option(CAMVOX_SANITIZE "Build with -fsanitize=address,undefined" OFF)

# -O2 with -O3's vectoriser: loops over pixels and points need it, and the rest of -O3 makes GCC 12
# warn of faults that are none.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -fvect-cost-model=dynamic -DNDEBUG")
add_compile_options(-g1)  # line numbers in backtraces and profiles, at little cost
add_compile_options(-Wall -Wextra -Wshadow -Wconversion $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor>)
if(CAMVOX_WERROR)
  add_compile_options(-Werror)
endif()
if(CAMVOX_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

find_program(CAMVOX_CCACHE ccache)
if(CAMVOX_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CAMVOX_CCACHE})
endif()
