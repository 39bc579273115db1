// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Standing and moving objects of the street, each built at a placement in its own frame (x forward,
// y left, z up). Its shape is drawn from `random`; the same numbers give the same object anywhere.
#pragma once

#include "simulator/assembly.hpp"
#include "simulator/random.hpp"

namespace tessera::street {

/// A saloon, hatchback or van with wheels and windows; id is kCar or kMovingCar.
void add_car(Assembly& out, Random random, RawId id);

/// Legs, body, arms and head, about 1.7 m; stride_rad swings the legs. id is kPerson or
/// kMovingPerson.
void add_person(Assembly& out, Random random, RawId id, double stride_rad);

void add_bicycle(Assembly& out, Random random);

/// A trunk with a few boughs. The crown is added to `leaves`, a separate object: networks have
/// separate errors for the two.
void add_tree(Assembly& trunk, Assembly& leaves, Random random);

void add_bush(Assembly& out, Random random);

/// length_m along x, centred.
void add_hedge(Assembly& out, Random random, double length_m);

enum class FenceKind { kBoards, kPickets, kMesh };

/// length_m along x, centred.
void add_fence(Assembly& out, Random random, double length_m, FenceKind kind);

/// A street lamp of about 6 m whose arm points along +y.
void add_lamp(Assembly& out, Random random);

/// A post and, as an object of its own, the plate facing +x.
void add_sign(Assembly& post, Assembly& plate, Random random);

/// Dustbins and boxes: objects outside the class table, unlabelled in the truth.
void add_bin(Assembly& out, Random random);

}  // namespace tessera::street
