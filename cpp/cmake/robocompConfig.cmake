# find_package(robocomp): the headers and the library of the framework, as the target
# robocomp::robocomp, and the function that makes the program of a component.
#
# ROBOCOMP_LIBRARY is the file librobocomp_cpp.so; `rcdeploy up --build` sets it. Without it, that of
# the framework's own target folder is taken: `cargo build -p rc-cpp` there builds it, with `--target` if a
# toolchain file is for another processor.
get_filename_component(_robocomp_folder "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)
set(_robocomp_target "${_robocomp_folder}/../target")
if(CMAKE_CROSSCOMPILING)
  set(_robocomp_target "${_robocomp_target}/${CMAKE_SYSTEM_PROCESSOR}-unknown-linux-gnu")
endif()
if(NOT ROBOCOMP_LIBRARY)
  find_file(ROBOCOMP_LIBRARY librobocomp_cpp.so
    PATHS "${_robocomp_target}/release" "${_robocomp_target}/debug"
    NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
endif()
if(NOT ROBOCOMP_LIBRARY AND CMAKE_CROSSCOMPILING)
  set(robocomp_FOUND FALSE)
  set(robocomp_NOT_FOUND_MESSAGE
    "librobocomp_cpp.so is not built for this processor: \
`cargo build -p rc-cpp --release --target ${CMAKE_SYSTEM_PROCESSOR}-unknown-linux-gnu` in the framework builds it")
  return()
endif()
if(NOT ROBOCOMP_LIBRARY)
  set(robocomp_FOUND FALSE)
  set(robocomp_NOT_FOUND_MESSAGE
    "librobocomp_cpp.so is not built: `rcdeploy up --build` of a network with the component builds it")
  return()
endif()

# g++ 7 and clang++ 6 have C++17 without <filesystem>.
if((CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 8)
    OR (CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 7)
    OR NOT "cxx_std_17" IN_LIST CMAKE_CXX_COMPILE_FEATURES)
  set(robocomp_FOUND FALSE)
  set(robocomp_NOT_FOUND_MESSAGE
    "robocomp needs C++17: g++ 8, clang++ 7 or later; \
${CMAKE_CXX_COMPILER} is ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}, and the variable CXX chooses another one")
  return()
endif()

# `cargo run` and `cargo test` name their target folder in LD_LIBRARY_PATH. A program has the library that it
# was built with all the same: a search path of the old kind (DT_RPATH) comes before this variable.
if(NOT TARGET robocomp::robocomp)
  add_library(robocomp::robocomp SHARED IMPORTED)
  set_target_properties(robocomp::robocomp PROPERTIES
    IMPORTED_LOCATION "${ROBOCOMP_LIBRARY}"
    IMPORTED_NO_SONAME TRUE
    INTERFACE_INCLUDE_DIRECTORIES "${_robocomp_folder}/include"
    INTERFACE_COMPILE_FEATURES cxx_std_17
    INTERFACE_LINK_OPTIONS "LINKER:--disable-new-dtags"
    INTERFACE_LINK_LIBRARIES "${CMAKE_DL_LIBS}")
endif()

# A sanitizer of the compiler, for all that is compiled from here on; `rcdeploy up --sanitize` sets it.
if(ROBOCOMP_SANITIZER)
  add_compile_options(-fsanitize=${ROBOCOMP_SANITIZER} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${ROBOCOMP_SANITIZER})
endif()

option(ROBOCOMP_TESTS "Build the tests of components" OFF)
if(ROBOCOMP_TESTS)
  enable_testing()
endif()

# The program `program` of the component whose CMakeLists.txt includes generated/component.cmake.
# ROBOCOMP_PROGRAMS is the folder that it is built into, ROBOCOMP_PROGRAM another name for it;
# `rcdeploy up --build` sets both.
#
# An installed program finds the library in `lib` of its prefix: PREFIX/components/NAME/bin/NAME. In the target folder,
# the library is beside the program; it comes first, because `lib` would be outside of the workspace there. Packages set
# ROBOCOMP_FOLDER, the folder in which the component will be, and CMAKE_BUILD_WITH_INSTALL_RPATH.
function(robocomp_component name program)
  set(folder "${CMAKE_CURRENT_SOURCE_DIR}")
  if(ROBOCOMP_FOLDER)
    set(folder "${ROBOCOMP_FOLDER}")
  endif()
  add_executable(${name} generated/main.cpp generated/description.cpp generated/component.cpp)
  set_source_files_properties(generated/description.cpp PROPERTIES COMPILE_DEFINITIONS
    "ROBOCOMP_COMPONENT_FOLDER=R\"rc_path(${folder})rc_path\"")
  target_include_directories(${name} PRIVATE generated src)
  target_link_libraries(${name} PRIVATE robocomp::robocomp)
  set_target_properties(${name} PROPERTIES
    CXX_EXTENSIONS OFF
    BUILD_RPATH "$ORIGIN;$ORIGIN/../../../lib"
    INSTALL_RPATH "$ORIGIN/../../../lib"
    ENABLE_EXPORTS ON  # names of functions in the report of a crash
    OUTPUT_NAME "${program}")
  if(ROBOCOMP_PROGRAM)
    set_target_properties(${name} PROPERTIES OUTPUT_NAME "${ROBOCOMP_PROGRAM}")
  endif()
  if(ROBOCOMP_PROGRAMS)
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${ROBOCOMP_PROGRAMS}")
  endif()
endfunction()

# The clause `kinematics` of the component `name`: its solvers take and return matrices of Eigen.
function(robocomp_kinematics name)
  find_package(Eigen3 QUIET NO_MODULE)
  if(NOT TARGET Eigen3::Eigen)
    message(FATAL_ERROR
      "the solvers of `${name}` need Eigen 3; on Debian and Ubuntu: `apt install libeigen3-dev`")
  endif()
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
endfunction()

# The window of the component `name`: `form` is its file of Qt's Designer. A macro, because cmake looks for
# the version of Qt in the folder's variables.
macro(robocomp_window name form)
  find_package(Qt6 6.2 QUIET COMPONENTS Widgets)
  if(NOT Qt6_FOUND)
    message(FATAL_ERROR
      "the window of ${name} needs Qt 6.2 or later; on Debian and Ubuntu: apt install qt6-base-dev")
  endif()
  qt6_wrap_ui(_robocomp_form ${form})
  target_sources(${name} PRIVATE ${_robocomp_form})
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
  target_link_libraries(${name} PRIVATE Qt6::Widgets)
  set_target_properties(${name} PROPERTIES AUTOMOC ON ROBOCOMP_WINDOW ON)
endmacro()

# A test of the component `name`, with the sources and libraries that its program has here: a program whose
# `main` uses generated/testing.h. With ROBOCOMP_TESTS=ON it is built, and ctest runs it.
function(robocomp_test name)
  if(NOT ROBOCOMP_TESTS)
    return()
  endif()
  # What the program compiles is not compiled again, except its `main`.
  set(objects "$<FILTER:$<TARGET_OBJECTS:${name}>,EXCLUDE,generated/main\\.cpp>")
  get_target_property(libraries ${name} LINK_LIBRARIES)
  get_target_property(includes ${name} INCLUDE_DIRECTORIES)
  get_target_property(window ${name} ROBOCOMP_WINDOW)
  foreach(test IN LISTS ARGN)
    get_filename_component(test_name ${test} NAME_WE)
    set(target ${name}_${test_name})
    add_executable(${target} ${test} ${objects})
    add_dependencies(${target} ${name})
    target_include_directories(${target} PRIVATE ${includes})
    target_link_libraries(${target} PRIVATE ${libraries})
    set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF ENABLE_EXPORTS ON)
    add_test(NAME ${target} COMMAND ${target})
    set_tests_properties(${target} PROPERTIES TIMEOUT 60)
    if(window)
      set_tests_properties(${target} PROPERTIES ENVIRONMENT "QT_QPA_PLATFORM=offscreen")
    endif()
  endforeach()
endfunction()
