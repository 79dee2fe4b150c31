/* The version of farlight: its only source. The Makefile reads it from here for other languages. The protocol
 * has a version of its own (handshake.h). */
#ifndef FARLIGHT_PROTOCOL_VERSION_H
#define FARLIGHT_PROTOCOL_VERSION_H

#define FARLIGHT_VERSION "0.1.0"

#endif
