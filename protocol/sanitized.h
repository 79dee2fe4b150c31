/* SPDX-License-Identifier: MIT */
/* Whether AddressSanitizer is built in. It maps terabytes of shadow memory, and traces its own process to find
 * leaks, so that sandboxes and locked memory leave it room for both. */
#ifndef FARLIGHT_PROTOCOL_SANITIZED_H
#define FARLIGHT_PROTOCOL_SANITIZED_H

#if defined(__SANITIZE_ADDRESS__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

#endif
