# SPDX-License-Identifier: Apache-2.0
# Frames between contributions, included by lib/CMakeLists.txt.
target_sources(tessera
  PUBLIC FILE_SET HEADERS FILES
    include/tessera/frames/frame_finder.hpp
    include/tessera/frames/internal/columns.hpp
    include/tessera/frames/internal/overlap_check.hpp
    include/tessera/frames/internal/surface_fit.hpp
    include/tessera/frames/internal/symmetric.hpp
    include/tessera/frames/internal/yaw_search.hpp
    include/tessera/frames/map_sketch.hpp
  PRIVATE
    src/frames/columns.cpp
    src/frames/frame_finder.cpp
    src/frames/frame_finder_fit.cpp
    src/frames/map_sketch.cpp
    src/frames/overlap_check.cpp
    src/frames/surface_fit.cpp
    src/frames/symmetric.cpp
    src/frames/yaw_search.cpp)
