# SPDX-License-Identifier: Apache-2.0
# cpack -G DEB: tessera (command, unit, pages, messages) and libtessera-dev (archive, headers, CMake package, pkg-config file).
set(TESSERA_PACKAGE_MAINTAINER "The tessera authors <tessera@tessera.invalid>" CACHE STRING "Who answers for the packages: name <address>")
string(TIMESTAMP TESSERA_PACKAGE_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH, if it is set

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${TESSERA_PACKAGE_MAINTAINER})
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
# With DESTDIR the install scripts know the final prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL development)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libtessera-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.3)")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "To build with: a static archive, headers for C++20 and C, a CMake
package and a file for pkg-config. The library uses only the memory that it
is given, and needs no heap, threads or exceptions.")
if(TESSERA_BUILD_PLATFORM)
  list(APPEND CPACK_COMPONENTS_ALL command)
  set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME tessera)
  set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_COMMAND_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_COMMAND_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/postinst)
  set(CPACK_DEBIAN_COMMAND_DESCRIPTION "The command that maps recorded scans, evaluates and draws maps, and a
robot's process that shares its map with the others of its team over a local
network, with a unit for systemd.")
endif()

# Files that Debian requires in every package; installing by hand leaves out Debian's own changelog.
find_program(TESSERA_GZIP gzip)
if(TESSERA_GZIP)
  set(built ${PROJECT_BINARY_DIR}/packages)
  file(MAKE_DIRECTORY ${built})
  configure_file(${CMAKE_CURRENT_LIST_DIR}/changelog.in ${built}/changelog.Debian @ONLY)
  configure_file(${PROJECT_SOURCE_DIR}/docs/changelog.md ${built}/changelog COPYONLY)
  foreach(text changelog changelog.Debian)
    execute_process(COMMAND ${TESSERA_GZIP} -9nc ${built}/${text} OUTPUT_FILE ${built}/${text}.gz COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} upper)
    set(doc ${CMAKE_INSTALL_DATAROOTDIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
    install(FILES ${built}/changelog.gz ${CMAKE_CURRENT_LIST_DIR}/copyright DESTINATION ${doc} COMPONENT ${component})
    install(FILES ${built}/changelog.Debian.gz DESTINATION ${doc} COMPONENT ${component} EXCLUDE_FROM_ALL)
  endforeach()
endif()
include(CPack)
