# SPDX-License-Identifier: Apache-2.0
# Frames between contributions, and of a team; included by lib/CMakeLists.txt.
target_sources(tessera
  PUBLIC FILE_SET HEADERS FILES
    include/tessera/frames/frame_finder.hpp
    include/tessera/frames/frame_follower.hpp
    include/tessera/frames/frame_link.hpp
    include/tessera/frames/internal/columns.hpp
    include/tessera/frames/internal/overlap_check.hpp
    include/tessera/frames/internal/place_fit.hpp
    include/tessera/frames/internal/surface_fit.hpp
    include/tessera/frames/internal/symmetric.hpp
    include/tessera/frames/internal/yaw_search.hpp
    include/tessera/frames/map_sketch.hpp
    include/tessera/frames/team_frames.hpp
  PRIVATE
    src/frames/columns.cpp
    src/frames/dense_factor.cpp
    src/frames/frame_finder.cpp
    src/frames/frame_finder_fit.cpp
    src/frames/frame_follower.cpp
    src/frames/frame_link.cpp
    src/frames/loop_trials.cpp
    src/frames/map_sketch.cpp
    src/frames/overlap_check.cpp
    src/frames/place_fit.cpp
    src/frames/statement_error.cpp
    src/frames/surface_fit.cpp
    src/frames/symmetric.cpp
    src/frames/team_frames.cpp
    src/frames/team_judgement.cpp
    src/frames/team_loops.cpp
    src/frames/team_solver.cpp
    src/frames/team_statements.cpp
    src/frames/team_votes.cpp
    src/frames/turn_to_priors.cpp
    src/frames/yaw_search.cpp)
