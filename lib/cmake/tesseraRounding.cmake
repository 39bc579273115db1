# SPDX-License-Identifier: Apache-2.0
# tessera_probe_rounding(RESULT SOURCE_FOLDER INCLUDE_FOLDER): RESULT is empty if this compiler, with the flags in CMAKE_CXX_FLAGS and
# each optimisation, rounds where base/rounding.hpp tells it to, else a sentence. Runs what it compiles; where that cannot be run, in
# a cross build without an emulator, it only compiles it. Kept in the cache by the compiler and its flags.
function(tessera_probe_rounding result source_folder include_folder)
  set(${result} "" PARENT_SCOPE)
  set(asked "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_CXX_FLAGS}")
  if(TESSERA_ROUNDING_PROBED STREQUAL asked)
    return()
  endif()
  foreach(level 0 1 2 3)
    set(arguments ${source_folder}/rounding_probe.cpp
        CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${include_folder}" COMPILE_DEFINITIONS -O${level} -ffp-contract=off
        CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON)
    set(place ${CMAKE_BINARY_DIR}/CMakeFiles/tessera_rounding/${level})
    unset(ran CACHE)
    unset(compiled CACHE)
    if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
      set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
      try_compile(compiled ${place} SOURCES ${arguments} OUTPUT_VARIABLE said)
      set(ran 0)
    else()
      try_run(ran compiled ${place} ${arguments} COMPILE_OUTPUT_VARIABLE said)
    endif()
    set(worked ${compiled})
    set(status "${ran}")
    unset(ran CACHE)
    unset(compiled CACHE)
    if(NOT worked)
      set(${result} "${CMAKE_CXX_COMPILER} does not compile tessera's base/rounding.hpp at -O${level}:\n${said}" PARENT_SCOPE)
      return()
    endif()
    if(NOT status MATCHES "^[0-9]+$")
      set(${result} "What ${CMAKE_CXX_COMPILER} compiles does not run here (${status}), so that its roundings cannot be tested. Set \
CMAKE_SYSTEM_NAME if this is a cross build." PARENT_SCOPE)
      return()
    endif()
    if(NOT status EQUAL 0)
      set(${result} "${CMAKE_CXX_COMPILER} drops roundings to float at -O${level} even where tessera forbids it (base/rounding.hpp): maps made \
by it would differ from those of other compilers. Take another compiler, or leave out flags that change floating-point arithmetic."
          PARENT_SCOPE)
      return()
    endif()
  endforeach()
  set(TESSERA_ROUNDING_PROBED "${asked}" CACHE INTERNAL "The compiler and flags by which tessera's roundings were found kept")
endfunction()
