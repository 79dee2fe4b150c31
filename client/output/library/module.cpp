// SPDX-License-Identifier: MIT
// The whole module as one translation unit, since the compiler takes four seconds to read OpenImageIO's headers.
#include "caption.cpp"
#include "colour.cpp"
#include "compare.cpp"
#include "heat_map.cpp"
#include "library.cpp"
#include "picture.cpp"
#include "similarity.cpp"
#include "tiff.cpp"
