# SPDX-License-Identifier: Apache-2.0
# Headers of the interface for C programs; included by lib/CMakeLists.txt, where its sources are: worst cases are counted with units in
# the order of that list.
target_sources(tessera
  PUBLIC FILE_SET HEADERS FILES
    include/tessera/c/config.h
    include/tessera/c/frames.h
    include/tessera/c/queries.h
    include/tessera/c/report.h
    include/tessera/tessera.h
)
