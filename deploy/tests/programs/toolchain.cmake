# The compiler of this machine, with a flag that shows which file has chosen it.
set(CMAKE_CXX_COMPILER c++)
set(CMAKE_CXX_FLAGS_INIT "-DFLAG_OF_THE_TOOLCHAIN")
