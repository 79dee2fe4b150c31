// SPDX-License-Identifier: MIT
// All of the module for the compiler at once, which takes four seconds to read the headers of OpenImageIO.
#include "caption.cpp"
#include "colour.cpp"
#include "compare.cpp"
#include "heat_map.cpp"
#include "library.cpp"
#include "picture.cpp"
#include "similarity.cpp"
#include "tiff.cpp"
