/* SPDX-License-Identifier: MIT */
/* Enumerations of protocol/words.def under the server's names: enum stage, STAGE_BUILD, STAGE_COUNT. The
 * numbers are those of the wire, so that sessions may cast. */
#ifndef FARLIGHT_BASE_WORDS_H
#define FARLIGHT_BASE_WORDS_H

/* Enumerations whose word is a struct of the server get the suffix _kind. */
#define integrator integrator_kind
#define ldc_levels ldc_levels_kind
#define primary primary_kind
#define tracer tracer_kind

/* clang-format off */
#define ENUMERATION(PREFIX, name, doc) enum name {
#define VALUE(PREFIX, VALUE_NAME, number, text, doc) PREFIX##_##VALUE_NAME = (number),
#define ENUMERATION_END(PREFIX, name) PREFIX##_COUNT };
#include "protocol/words.def"
/* clang-format on */

#undef integrator
#undef ldc_levels
#undef primary
#undef tracer

#endif
