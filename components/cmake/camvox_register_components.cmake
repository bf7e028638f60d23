# camvox_register_components(<target> <class>...)
# Makes the component classes of a shared library known to containers by name, and installs the
# library:
#
#     add_library(my_components SHARED blur.cpp)
#     target_link_libraries(my_components PRIVATE camvox::component)
#     camvox_register_components(my_components "my::BlurComponent")
#
# Each class is exported in its source with CAMVOX_REGISTER_COMPONENT(my::BlurComponent), spelled
# the same. The names go to share/ament_index/resource_index/camvox_components/<package>, one line
# each, "class;library" with the library relative to the prefix, as rclcpp_components does.
function(camvox_register_components target)
  if(NOT ARGN)
    message(FATAL_ERROR "camvox_register_components(${target}): name at least one component class")
  endif()
  # A missing symbol is then an error when the library is loaded, not when it is first called,
  # where it would end the whole container.
  target_link_options(${target} PRIVATE LINKER:-z,now)
  install(TARGETS ${target} LIBRARY DESTINATION lib RUNTIME DESTINATION bin)

  set(index_property CAMVOX_COMPONENT_INDEX_${PROJECT_NAME})
  get_property(index GLOBAL PROPERTY ${index_property})
  if(NOT index)  # at the end of the project's own CMakeLists.txt, when all lines are known
    cmake_language(DEFER DIRECTORY ${PROJECT_SOURCE_DIR} CALL camvox_install_component_index)
  endif()
  foreach(class IN LISTS ARGN)
    string(APPEND index "${class}$<SEMICOLON>lib/$<TARGET_FILE_NAME:${target}>\n")
  endforeach()
  set_property(GLOBAL PROPERTY ${index_property} "${index}")
endfunction()

function(camvox_install_component_index)
  set(file ${PROJECT_BINARY_DIR}/camvox_component_index/${PROJECT_NAME})
  get_property(index GLOBAL PROPERTY CAMVOX_COMPONENT_INDEX_${PROJECT_NAME})
  file(GENERATE OUTPUT ${file} CONTENT "${index}")
  install(FILES ${file} DESTINATION share/ament_index/resource_index/camvox_components)
endfunction()
