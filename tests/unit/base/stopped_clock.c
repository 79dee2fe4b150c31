/* SPDX-License-Identifier: MIT */
/* The clock of all tests of this program; the linker puts it in the place of base/clock.h's. */
#include "tests/fixtures/stopped_clock.h"

#include "base/clock.h"

#include <stdatomic.h>

static atomic_uint_fast64_t stopped_ns; /* 0: it goes, so far ahead of the machine's: */
static atomic_uint_fast64_t ahead_ns;

uint64_t __real_clock_now_ns(void);
uint64_t __wrap_clock_now_ns(void);

uint64_t __wrap_clock_now_ns(void)
{
    const uint64_t at_ns = atomic_load(&stopped_ns);
    return at_ns ? at_ns : __real_clock_now_ns() + atomic_load(&ahead_ns);
}

void clock_stop(void)
{
    atomic_store(&stopped_ns, clock_now_ns());
}

bool clock_is_stopped(void)
{
    return atomic_load(&stopped_ns) != 0;
}

void clock_let_pass(uint64_t ns)
{
    atomic_fetch_add(&stopped_ns, ns);
}

void clock_start(void)
{
    const uint64_t at_ns = atomic_load(&stopped_ns), real_ns = __real_clock_now_ns();
    if (at_ns > real_ns + atomic_load(&ahead_ns))
        atomic_store(&ahead_ns, at_ns - real_ns);
    atomic_store(&stopped_ns, 0);
}
