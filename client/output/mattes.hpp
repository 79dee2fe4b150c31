// SPDX-License-Identifier: MIT
// Cryptomatte: Friedman and Jones. Fully Automatic ID Mattes with Support for Motion Blur and Transparency. 2015;
// the form of the file by Psyop's "Cryptomatte Specification", version 1.2.
#pragma once

#include "mattes.h"
#include "metadata.hpp"

#include <string>
#include <vector>

// What stands for an object in channels: the hash of its name as a float; 0: it has none.
float matte_identifier(const struct mattes *mattes, enum protocol_object_kind kind, uint32_t object);
// Of the layers that are of Cryptomatte: their attributes, with whole names.
std::vector<metadata_entry> matte_metadata(const struct mattes *mattes, unsigned layers);
