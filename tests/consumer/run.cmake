# SPDX-License-Identifier: Apache-2.0
# Builds and runs the consumer against an install (MODE=install) or the sources (MODE=sources). Needs BUILD, SOURCE, WORK,
# VERSION, C_COMPILER, CXX_COMPILER; SANITIZE as the library was built with, COMMAND if the tessera command was built.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

function(expect_version)
  run(${ARGV})
  if(NOT output MATCHES "tessera ${VERSION}")
    message(FATAL_ERROR "${ARGV} says ${output}, not tessera ${VERSION}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
# Debug: whether it builds is asked, and all of the core is built once more.
set(arguments -S ${SOURCE}/tests/consumer -B ${WORK}/build -G Ninja -DCMAKE_BUILD_TYPE=Debug
              -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_CXX_COMPILER=${CXX_COMPILER})
if(MODE STREQUAL "install")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
  list(APPEND arguments -DCMAKE_PREFIX_PATH=${WORK}/prefix)
  if(SANITIZE)
    list(APPEND arguments -DCMAKE_CXX_FLAGS=-fsanitize=${SANITIZE})
  endif()
  if(COMMAND)
    expect_version(${WORK}/prefix/bin/tessera --version)
  endif()
else()
  list(APPEND arguments -DTESSERA_SOURCE=${SOURCE})
endif()
run(${CMAKE_COMMAND} ${arguments})
run(${CMAKE_COMMAND} --build ${WORK}/build)
expect_version(${WORK}/build/consumer)
