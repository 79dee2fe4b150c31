// SPDX-License-Identifier: MIT
// Cryptomatte (Friedman and Jones. Fully Automatic ID Mattes with Support for Motion Blur and Transparency. 2015),
// stored as in Psyop's "Cryptomatte Specification", version 1.2.
#pragma once

#include "mattes.h"
#include "metadata.hpp"

#include <string>
#include <vector>

// The identifier of an object in channels: the hash of its name as a float; 0: the object has no name.
float matte_identifier(const struct mattes *mattes, enum protocol_object_kind kind, uint32_t object);
// The attributes of the layers that belong to Cryptomatte, with whole names.
std::vector<metadata_entry> matte_metadata(const struct mattes *mattes, unsigned layers);
